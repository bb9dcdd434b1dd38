"""Bases of everything that is read from or written to JSON."""

from typing import TypeVar, cast, dataclass_transform

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
