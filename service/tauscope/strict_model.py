"""Bases of everything that is read from or written to JSON."""

from dataclasses import fields
from typing import Any, TypeVar, cast, dataclass_transform

from pydantic import BaseModel, ConfigDict, Field
from pydantic.dataclasses import dataclass


class StrictModel(BaseModel):
    """No type is converted, no key is overlooked."""

    model_config = ConfigDict(strict=True, extra="forbid", frozen=True)


class ResultModel(StrictModel):
    """A result; a number that was not measured is null."""

    model_config = ConfigDict(ser_json_inf_nan="null")


Kind = TypeVar("Kind")


@dataclass_transform(frozen_default=True, field_specifiers=(Field,))
def entry(kind: type[Kind]) -> type[Kind]:
    """A frozen dataclass that answers are made of."""
    return cast(type[Kind], dataclass(frozen=True, config=ConfigDict(extra="forbid"))(kind))


def take_fields(kind: type[Kind], source: object, **stated: Any) -> Kind:
    """A model or entry of what a source has under the same names, and of what is stated; arrays become lists."""
    names = kind.model_fields if issubclass(kind, BaseModel) else [each.name for each in fields(cast(Any, kind))]
    taken = {name: getattr(source, name) for name in names if name not in stated and hasattr(source, name)}
    return kind(**{name: _plain(value, kind) for name, value in taken.items()}, **stated)


def _plain(value: Any, kind: type) -> Any:
    if hasattr(value, "tolist"):
        return value.tolist()
    return list(value) if isinstance(value, tuple) and issubclass(kind, BaseModel) else value
