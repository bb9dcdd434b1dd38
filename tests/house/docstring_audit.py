"""Reads public objects and says which of their arguments and fields nobody documented."""

import ast
import dataclasses
import enum
import inspect
import re
import textwrap
import typing
from collections.abc import Callable, Iterable, Iterator
from itertools import pairwise
from types import FunctionType, ModuleType
from typing import Any

from fastapi import APIRouter, BackgroundTasks, FastAPI, Request, Response
from fastapi.routing import APIRoute
from pydantic import BaseModel
from sqlalchemy.orm import DeclarativeBase

_ENTRY = re.compile(r"^(?P<names>\*{0,2}\w+(?:, \*{0,2}\w+)*) :(?: |$)")
_UNDERLINE = re.compile(r"^-{3,}$")
_INJECTED = (Request, Response, BackgroundTasks)


def audit_module(module: ModuleType) -> list[str]:
    """Faults of every public object that this module defines, each one a line `module.name: what is missing`."""
    faults = [] if (module.__doc__ or "").strip() else [f"{module.__name__}: no docstring"]
    routes = set(_endpoints(module))
    for name, member in vars(module).items():
        if name.startswith("_") or getattr(member, "__module__", None) != module.__name__:
            continue
        where = f"{module.__name__}.{name}"
        if inspect.isclass(member):
            faults += audit_class(member, where)
        elif _function_of(member) is not None:
            faults += audit_function(member, where, is_route=member in routes)
    return faults


def audit_class(cls: type, where: str) -> list[str]:
    """Faults of a class: its docstring, its fields, its constructor and its public methods."""
    if not (cls.__doc__ or "").strip() or _is_generated_docstring(cls):
        return [f"{where}: no docstring"]
    faults = [f"{where}: field `{name}` is not documented" for name in _undocumented_fields(cls)]
    constructor = vars(cls).get("__init__")
    if isinstance(constructor, FunctionType) and not _has_generated_constructor(cls):
        documented = documented_names(cls.__doc__) | documented_names(constructor.__doc__)
        faults += [f"{where}: argument `{name}` is not documented" for name in _missing(constructor, documented, False)]
    for name, member in vars(cls).items():
        if name.startswith("_"):
            continue
        if isinstance(member, property):
            faults += [] if inspect.getdoc(member) else [f"{where}.{name}: no docstring"]
        elif _function_of(member) is not None:
            faults += audit_function(member, f"{where}.{name}", inherited=_inherited_docstring(cls, name))
    return faults


def audit_function(member: Any, where: str, *, inherited: str = "", is_route: bool = False) -> list[str]:
    """Faults of a function: no docstring, an argument left out, or an entry for an argument that it does not have."""
    function = _function_of(member)
    assert function is not None, where
    docstring = inspect.cleandoc(function.__doc__ or inherited)
    if not docstring:
        return [f"{where}: no docstring"]
    documented = documented_names(docstring)
    faults = [f"{where}: argument `{name}` is not documented" for name in _missing(function, documented, is_route)]
    stale = documented - set(inspect.signature(function).parameters)
    return faults + [f"{where}: documents `{name}`, which is no argument" for name in sorted(stale)]


def documented_names(docstring: str | None) -> set[str]:
    """Names that the `Parameters` section of a NumPy docstring explains."""
    names: set[str] = set()
    inside = False
    lines = inspect.cleandoc(docstring or "").splitlines()
    for line, following in pairwise([*lines, ""]):
        if _UNDERLINE.match(following):
            inside = line in ("Parameters", "Other Parameters")
        elif inside and (entry := _ENTRY.match(line)):
            names |= {name.strip("* ") for name in entry["names"].split(",")}
    return names


def _missing(function: Callable[..., Any], documented: set[str], is_route: bool) -> Iterator[str]:
    """Arguments without any words: neither in the docstring nor in the help of a command's option."""
    hints = _hints(function)
    for position, (name, parameter) in enumerate(inspect.signature(function).parameters.items()):
        receiver = position == 0 and name in ("self", "cls")
        if receiver or name.startswith("_") or name in documented:
            continue
        hint = hints.get(name, parameter.annotation)
        described = any(_words_of(item) for item in (parameter.default, *getattr(hint, "__metadata__", ())))
        if not described and not (is_route and _is_explained_by_framework(hint, parameter.default)):
            yield name


def _words_of(marker: Any) -> str:
    """What typer's Option and Argument call help, and pydantic's and FastAPI's fields a description."""
    for attribute in ("help", "description"):
        words = getattr(marker, attribute, None)
        if isinstance(words, str) and words.strip():
            return words
    return ""


def _is_explained_by_framework(hint: Any, default: Any) -> bool:
    """Whether FastAPI injects a route's argument, or a model of its own documents it."""
    if any(hasattr(item, "dependency") for item in (default, *getattr(hint, "__metadata__", ()))):
        return True
    bare = typing.get_args(hint)[0] if hasattr(hint, "__metadata__") else hint
    return inspect.isclass(bare) and issubclass(bare, (*_INJECTED, BaseModel))


def _endpoints(module: ModuleType) -> Iterator[Any]:
    for value in vars(module).values():
        if isinstance(value, APIRouter | FastAPI):
            yield from (route.endpoint for route in value.routes if isinstance(route, APIRoute))


def _function_of(member: Any) -> FunctionType | None:
    """The Python function behind a function, a method, a cache or a decorator that keeps `__wrapped__`."""
    if isinstance(member, staticmethod | classmethod):
        member = member.__func__
    unwrapped = inspect.unwrap(member) if callable(member) and not inspect.isclass(member) else member
    return unwrapped if isinstance(unwrapped, FunctionType) else None


def _hints(function: Callable[..., Any]) -> dict[str, Any]:
    """Annotations with their metadata; as written where a name in them exists for the type checker only."""
    try:
        return typing.get_type_hints(function, include_extras=True)
    except NameError:
        return {}


def _has_fields(cls: type) -> bool:
    return dataclasses.is_dataclass(cls) or issubclass(cls, BaseModel) or hasattr(cls, "_fields")


def _has_generated_constructor(cls: type) -> bool:
    return _has_fields(cls) or issubclass(cls, enum.Enum | DeclarativeBase) or getattr(cls, "_is_protocol", False)


def _is_generated_docstring(cls: type) -> bool:
    """Whether the docstring is the signature that `dataclass` and `NamedTuple` write where there is none."""
    return _has_fields(cls) and (cls.__doc__ or "").startswith(f"{cls.__name__}(")


def _undocumented_fields(cls: type) -> Iterator[str]:
    """Own public fields of a data class, named tuple, table or pydantic model that no docstring names."""
    named = set(re.findall(r"\w+", cls.__doc__ or "")) | _fields_with_own_docstring(cls)
    for name in _own_fields(cls):
        if not name.startswith("_") and name not in named:
            yield name


def _own_fields(cls: type) -> Iterable[str]:
    own = inspect.get_annotations(cls)
    if issubclass(cls, BaseModel):
        return [name for name, field in cls.model_fields.items() if name in own and not field.description]
    if dataclasses.is_dataclass(cls):
        return [field.name for field in dataclasses.fields(cls) if field.name in own]
    if issubclass(cls, DeclarativeBase):
        return own
    return getattr(cls, "_fields", ())


def _fields_with_own_docstring(cls: type) -> set[str]:
    """Fields that a string literal follows, in the class's source."""
    try:
        tree = ast.parse(textwrap.dedent(inspect.getsource(cls)))
    except (OSError, TypeError):
        return set()
    body = typing.cast(ast.ClassDef, tree.body[0]).body
    return {
        field.target.id
        for field, following in pairwise(body)
        if isinstance(field, ast.AnnAssign)
        and isinstance(field.target, ast.Name)
        and isinstance(following, ast.Expr)
        and isinstance(following.value, ast.Constant)
        and isinstance(following.value.value, str)
    }


def _inherited_docstring(cls: type, name: str) -> str:
    """Docstring of the method that this one overrides."""
    for base in cls.__mro__[1:]:
        if inherited := getattr(vars(base).get(name), "__doc__", None):
            return inherited
    return ""
