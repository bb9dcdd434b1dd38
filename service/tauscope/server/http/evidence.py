"""Evidence of models: what an active model or a reference rests on is not removed."""

from collections.abc import Collection
from contextlib import suppress

from tauscope.errors import NotFoundError
from tauscope.server.http.services import Services
from tauscope.server.problems import ProblemError
from tauscope.server.queue.analyses import IdentificationWorkspace
from tauscope.server.store.robots import hash_robot


def require_no_model(services: Services, identifier: str) -> None:
    _judge_new(services)
    _require_free(services, identifier, {identifier})


def require_no_evidence(services: Services, recording: str) -> None:
    """Raises ProblemError if an active model or a reference was made from or judged by a recording."""
    _judge_new(services)
    _require_free(services, recording, services.index.index.list_users(recording))


def require_no_identification(services: Services, version: str) -> None:
    """Raises ProblemError if an active model or a reference was identified with a robot."""
    _judge_new(services)
    users = set()
    for identifier in services.models.history.list_protected():
        with suppress(NotFoundError):  # of another service
            workspace = IdentificationWorkspace(services.identifications.items.folder(identifier))
            order = workspace.read_order()
            if order is not None and hash_robot(workspace.robot, order.robot_file) == version:
                users.add(identifier)
    _require_free(services, version, users)


def _judge_new(services: Services) -> None:
    """Judge every identification: one that ended a moment ago may become the active model."""
    services.index.refresh()
    services.models.judge_new()


def _require_free(services: Services, name: str, users: Collection[str]) -> None:
    models = services.models.history.list_protected().intersection(users)
    if models:
        hint = "make another model active, and the reference, first; identify again where there is no other"
        raise ProblemError("in-use", f"{name}: model {min(models)} is in use and rests on it; {hint}")
