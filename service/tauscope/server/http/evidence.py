"""Evidence of models: what an active model or a reference rests on is not removed."""

from collections.abc import Collection

from tauscope.server.http.services import Services
from tauscope.server.problems import ProblemError


def require_no_model(services: Services, identifier: str) -> None:
    """Refuse to remove an identification that is an active model or a reference.

    Raises
    ------
    ProblemError
        if it is one
    """
    _require_free(services, identifier, {identifier})


def require_no_evidence(services: Services, recording: str) -> None:
    """Refuse to remove a recording that an active model or a reference was made from or judged by.

    Raises
    ------
    ProblemError
        if one was
    """
    services.index.refresh()
    _require_free(services, recording, services.index.index.list_users(recording))


def _require_free(services: Services, name: str, users: Collection[str]) -> None:
    """Refuse to remove something while a model that is in use rests on it."""
    models = services.models.history.list_protected().intersection(users)
    if models:
        hint = "make another model active, or the reference, first"
        raise ProblemError("in-use", f"{name}: model {min(models)} is in use and rests on it; {hint}")
