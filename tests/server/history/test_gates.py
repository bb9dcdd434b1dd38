"""What a model has to show: a good one passes, and each fault closes the gate that is meant for it, and no other."""

from typing import Any

import pytest

from identified import identified
from tauscope.identification.result import InertiaEntry, LinkEntry
from tauscope.server.history.gates import ModelPolicy, check_gates, is_physical, passes

POLICY = ModelPolicy()


def closed(**changes: Any) -> dict[str, str]:
    """The gates that a changed identification does not pass, each with its reason."""
    return {
        gate.name: gate.reason for gate in check_gates(identified(**changes), POLICY, identified()) if not gate.passed
    }


def test_a_good_model_passes() -> None:
    gates = check_gates(identified(), POLICY, identified())
    assert [gate.name for gate in gates] == ["held_out", "consistency", "excitation", "structure"]
    assert passes(gates)


@pytest.mark.parametrize(
    ("changes", "gate", "reason"),
    [
        ({"fit__held_out": None}, "held_out", "no held-out recording"),
        ({"fit__held_out__relative_error": 0.21}, "held_out", "relative error 0.21 on held-out motions, allowed 0.2"),
        ({"fit__held_out__rms": [0.5]}, "held_out", "shoulder: held-out residual"),
        ({"fit__price_of_bodies": [1.3]}, "consistency", "shoulder: residual of the model with bodies"),
        ({"links__0__mass": -0.1}, "consistency", "link 1: no real body"),
        ({"undetermined": ["Iyy1"]}, "excitation", "say nothing about Iyy1"),
        ({"condition_number": 501.0}, "excitation", "condition number 501, allowed 500"),
        ({"joints": ["elbow"]}, "structure", "other joints"),
        ({"base_parameters__0__name": "Iyy1 + 0.4*msx1"}, "structure", "other base parameters"),
    ],
)
def test_each_fault_closes_its_gate(changes: dict[str, Any], gate: str, reason: str) -> None:
    found = closed(**changes)
    assert list(found) == [gate]
    assert reason in found[gate]
    assert "\n" not in found[gate]


def test_noise_is_no_reason_to_refuse() -> None:
    # Averaged periods leave less residual than one sample's noise: motions that were not averaged show all of it.
    assert closed(fit__train__rms=[0.01], noise_std=[0.05], fit__held_out__rms=[0.06]) == {}


def test_the_bounds_are_the_policys() -> None:
    strict = ModelPolicy(condition_number=10.0)
    assert [gate.name for gate in check_gates(identified(), strict) if not gate.passed] == ["excitation"]
    assert [gate.name for gate in check_gates(identified(), POLICY)] == ["held_out", "consistency", "excitation"]


def link(mass: float, moment: list[float], xx: float, yy: float, zz: float) -> LinkEntry:
    return LinkEntry(mass=mass, first_moment=moment, inertia=InertiaEntry(xx=xx, yy=yy, zz=zz, xy=0, xz=0, yz=0))


@pytest.mark.parametrize(
    ("body", "physical"),
    [
        (link(2.0, [0, 0, 0], 0.1, 0.1, 0.1), True),
        (link(2.0, [0.4, 0, 0], 0.0, 0.08, 0.08), True),  # a point of 2 kg at 0.2 m: on the edge of what can be
        (link(2.0, [0.4, 0, 0], 0.0, 0.07, 0.07), False),  # less inertia than that point has
        (link(-1.0, [0, 0, 0], 0.1, 0.1, 0.1), False),
        (link(1.0, [0, 0, 0], 0.3, 0.1, 0.1), False),  # against the triangle inequality
        (link(0.0, [0, 0, 0], 0.0, 0.0, 0.0), True),
    ],
)
def test_which_bodies_there_can_be(body: LinkEntry, physical: bool) -> None:
    assert is_physical(body) is physical
