"""Finds arrays of public callables whose shape no docstring states."""

import inspect
import re
import typing
from collections.abc import Iterator, Sequence
from types import FunctionType, ModuleType
from typing import Any

import numpy as np

SHAPE = re.compile(r"\([\w+*\- ×.…,]*,[\w+*\- ×.…,|]*\)|\(\.\.\.\)")
_SECTION = re.compile(r"(?m)^(\w+)\n-{3,}$")


def audit_module(module: ModuleType) -> list[str]:
    """Faults of the public callables that this module defines, each one a line `name: what is missing`."""
    return [
        f"{name}: {fault}"
        for name, function, docstrings in _callables(module)
        for fault in audit_function(function, docstrings)
    ]


def audit_function(function: FunctionType, docstrings: Sequence[str]) -> Iterator[str]:
    """Array arguments and results that none of the docstrings, its own and those that it overrides, gives a shape."""
    hints = _hints(function)
    for name, hint in hints.items():
        if name == "return":
            if _is_array(hint) and not any(SHAPE.search(each) for each in docstrings):
                yield "the returned array has no shape"
        elif _is_array(hint) and not any(SHAPE.search(_entry(each, name)) for each in docstrings):
            yield f"array `{name}` has no shape"


def _callables(module: ModuleType) -> Iterator[tuple[str, FunctionType, list[str]]]:
    for name, member in vars(module).items():
        if name.startswith("_") or getattr(member, "__module__", None) != module.__name__:
            continue
        if isinstance(function := inspect.unwrap(member) if callable(member) else member, FunctionType):
            yield name, function, [inspect.getdoc(function) or ""]
        elif inspect.isclass(member):
            for own, method in vars(member).items():
                if isinstance(method, FunctionType) and not own.startswith("_"):
                    yield (
                        f"{name}.{own}",
                        method,
                        [inspect.getdoc(vars(base).get(own)) or "" for base in member.__mro__],
                    )


def _hints(function: FunctionType) -> dict[str, Any]:
    try:
        return typing.get_type_hints(function)
    except NameError:  # a name for the type checker only
        return {}


def _is_array(hint: Any) -> bool:
    return (typing.get_origin(hint) or hint) is np.ndarray


def _entry(docstring: str, name: str) -> str:
    """What the docstring says of an argument: its entry, or the whole text where the argument stands in prose."""
    entry = re.search(rf"(?m)^(?:\w+, )*\*?{name}(?:, \w+)* : .*(?:\n {{4}}.*)*", docstring)
    if entry:
        return entry.group()
    prose = _SECTION.split(docstring)[0]
    return prose if re.search(rf"\b{name}\b", prose) else ""
