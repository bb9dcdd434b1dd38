"""The four scopes, and which one a request needs. What no rule names needs the highest one."""

import re
from enum import StrEnum

from tauscope.errors import TauscopeError


class Scope(StrEnum):
    """What a key may do; each scope includes those before it."""

    READ = "read"
    """look at everything, and stop every arm"""
    ANALYSE = "analyse"
    """send recordings and robots, hand in and cancel analyses"""
    MOVE = "move"
    """take, arm and move arms"""
    ADMIN = "admin"
    """remove what was measured, take an arm from somebody else"""

    def includes(self, other: "Scope") -> bool:
        """Whether this scope is the other one, or a higher one."""
        order = list(Scope)
        return order.index(self) >= order.index(other)


def parse_scope(text: str) -> Scope:
    """The scope of a name. Raises TauscopeError if there is none of that name."""
    try:
        return Scope(text)
    except ValueError:
        raise TauscopeError(f"scope {text[:40]!r}: not known; give one of {', '.join(Scope)}") from None


_ITEM = r"[^/]+"
_ANALYSES = "(identifications|diagnoses|excitations|rollouts)"

# Of requests that are no plain reading: the first rule that fits decides.
_RULES: tuple[tuple[str, re.Pattern[str], Scope], ...] = tuple(
    (method, re.compile(f"/api/v1/{path}"), scope)
    for method, path, scope in (
        # Whoever may see an arm move may stop it.
        ("POST", "stop", Scope.READ),
        ("POST", f"(runs|campaigns)/{_ITEM}/stop", Scope.READ),
        ("POST", "(robots|mappings)/check", Scope.ANALYSE),
        ("POST", "(recordings|robots)", Scope.ANALYSE),
        ("POST", _ANALYSES, Scope.ANALYSE),
        ("DELETE", f"{_ANALYSES}/{_ITEM}", Scope.ANALYSE),
        ("POST", f"events/{_ITEM}/acknowledge", Scope.ANALYSE),
        ("POST", f"schedules/{_ITEM}/run", Scope.MOVE),
        ("POST", "(runs|campaigns|leases)", Scope.MOVE),
        ("POST", f"leases/{_ITEM}/(heartbeat|arm|disarm)", Scope.MOVE),
        ("DELETE", f"leases/{_ITEM}", Scope.MOVE),
        ("DELETE", f"(recordings|robots/versions|runs|campaigns|schedules)/{_ITEM}", Scope.ADMIN),
        # What is compared with, and what moves at night, is the operator's to decide.
        ("POST", f"models/{_ITEM}/(activate|make-reference)", Scope.ADMIN),
        ("PUT", f"model-policy|schedules/{_ITEM}", Scope.ADMIN),
    )
)


def find_needed_scope(method: str, path: str) -> Scope | None:
    """The scope that a request needs; None for what anybody may read: pages, the interface's description, health."""
    is_reading = method in ("GET", "HEAD", "OPTIONS")
    if not path.startswith("/api/") and path != "/metrics":
        return None if is_reading else Scope.ADMIN
    if is_reading:
        return Scope.READ
    return next((scope for verb, rule, scope in _RULES if verb == method and rule.fullmatch(path)), Scope.ADMIN)


def is_stop(method: str, path: str) -> bool:
    """Whether a request stops an arm: nothing that can fail or wait may stand in its way."""
    return method == "POST" and re.fullmatch(rf"/api/v1/(stop|(runs|campaigns)/{_ITEM}/stop)", path) is not None
