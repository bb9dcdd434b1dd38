"""The methods that each address knows: the framework answers a wrong one with those of the first route alone."""

import re
from collections.abc import Iterable, Sequence

from fastapi import APIRouter
from starlette.routing import Route, compile_path

Methods = Sequence[tuple[re.Pattern[str], frozenset[str]]]
"""For each route the pattern of its path, and its methods."""


def collect_methods(routers: Iterable[tuple[str, APIRouter]]) -> Methods:
    """The methods of all routes.

    Parameters
    ----------
    routers : iterable of (str, APIRouter)
        each with the prefix of its paths
    """
    return tuple(
        (compile_path(prefix + route.path)[0], frozenset(route.methods or ()))
        for prefix, router in routers
        for route in router.routes
        if isinstance(route, Route)
    )


def find_methods(methods: Methods, path: str) -> list[str]:
    """The methods that an address knows, sorted."""
    return sorted({method for pattern, known in methods if pattern.match(path) for method in known})
