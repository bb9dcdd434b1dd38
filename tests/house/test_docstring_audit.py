"""The audit itself: it finds what it is meant to find, and accepts every way of documenting that the house allows."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from types import ModuleType
from typing import Annotated, Any, NamedTuple

import pytest
import typer
from fastapi import APIRouter, Depends, Path, Request
from pydantic import BaseModel, Field

from house.docstring_audit import audit_class, audit_function, audit_module, documented_names


def complete(q: float, *rest: float, scale: float = 1.0, **options: float) -> float:
    """τ = K q.

    Parameters
    ----------
    q, scale : float
        joint position [rad], and what it is multiplied by
    *rest : float
        further positions [rad]
    **options : object
        unused

    Returns
    -------
    nothing : float
        zero
    """
    return 0.0 * q * scale * len(rest) * len(options)


def without_words(q: float) -> float:
    return q


def one_left_out(q: float, qd: float) -> float:
    """Sum of both.

    Parameters
    ----------
    q : float
        joint position [rad]
    """
    return q + qd


def one_too_many(q: float) -> float:
    """q itself.

    Parameters
    ----------
    q : float
        joint position [rad]
    qd : float
        was once an argument
    """
    return q


@cache
def cached(q: float) -> float:
    """q itself."""
    return q


def command(
    robot: Annotated[str, typer.Argument(help="the robot file")], seed: Annotated[int, typer.Option()] = 0
) -> None:
    """Say nothing."""


@pytest.mark.parametrize(
    ("function", "faults"),
    [
        (complete, []),
        (without_words, ["f: no docstring"]),
        (one_left_out, ["f: argument `qd` is not documented"]),
        (one_too_many, ["f: documents `qd`, which is no argument"]),
        (cached, ["f: argument `q` is not documented"]),
        (command, ["f: argument `seed` is not documented"]),
    ],
)
def test_functions(function: Callable[..., Any], faults: list[str]) -> None:
    assert audit_function(function, "f") == faults


def test_only_the_parameters_section_counts() -> None:
    assert documented_names(complete.__doc__) == {"q", "scale", "rest", "options"}


def test_data_class_fields() -> None:
    @dataclass(frozen=True)
    class Limits:
        """Limits of a joint.

        velocity : float
            [rad/s]
        """

        velocity: float
        torque: float
        """[Nm]"""
        acceleration: float

    assert audit_class(Limits, "Limits") == ["Limits: field `acceleration` is not documented"]


def test_the_signature_that_dataclass_writes_is_no_docstring() -> None:
    @dataclass
    class Bare:
        x: float

    class Pair(NamedTuple):
        x: float

    assert audit_class(Bare, "Bare") == ["Bare: no docstring"]
    assert audit_class(Pair, "Pair") == ["Pair: no docstring"]


def test_pydantic_descriptions_count() -> None:
    class Body(BaseModel):
        """A request."""

        robot: str = Field(description="the robot file")
        estimator: str

    assert audit_class(Body, "Body") == ["Body: field `estimator` is not documented"]


def test_methods_and_constructors() -> None:
    class Bus:
        """A bus.

        Parameters
        ----------
        port : str
            device file
        """

        def __init__(self, port: str, baud: int) -> None:
            self.port = port, baud

        def send(self, data: bytes) -> None:
            """Send."""

        @property
        def name(self) -> str:
            return ""

        @staticmethod
        def find(port: str) -> None: ...

        def _private(self, anything: int) -> None: ...

    assert audit_class(Bus, "Bus") == [
        "Bus: argument `baud` is not documented",
        "Bus.send: argument `data` is not documented",
        "Bus.name: no docstring",
        "Bus.find: no docstring",
    ]


def test_an_override_inherits_its_words() -> None:
    class Reader:
        """Reads."""

        def rows(self, start: int) -> None:
            """Rows.

            Parameters
            ----------
            start : int
                first row
            """

    class CsvReader(Reader):
        """Reads CSV."""

        def rows(self, start: int) -> None: ...

    assert audit_class(CsvReader, "CsvReader") == []


def test_routes_leave_injected_arguments_to_the_framework() -> None:
    router = APIRouter()

    class Body(BaseModel):
        """A request."""

    @router.post("/robots/{name}/{part}")
    def post(
        name: Annotated[str, Path(description="the robot")],
        part: str,
        body: Body,
        request: Request,
        store: Annotated[object, Depends(object)],
    ) -> None:
        """Keep a robot."""

    module = ModuleType("routes", "Routes.")
    post.__module__ = "routes"
    vars(module).update(router=router, post=post)
    assert audit_module(module) == ["routes.post: argument `part` is not documented"]


def test_a_module_lists_its_own_public_objects_only() -> None:
    module = ModuleType("kinematics")
    own = type("Frame", (), {"__module__": "kinematics"})
    vars(module).update(Frame=own, _Hidden=own, dataclass=dataclass)
    assert audit_module(module) == ["kinematics: no docstring", "kinematics.Frame: no docstring"]
