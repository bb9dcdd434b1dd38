"""What ``identify --json`` writes: CONTRACT.md's keys with their types, the same read back, no NaN anywhere."""

import json
import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from pydantic import ValidationError

from identification.simulated import PAPER_NOISE, SimulatedArm, paper_robot, simulate, with_shapes
from tauscope.identification import Estimator, Identification, IdentificationDocument, Options, document, identify
from tauscope_sim.motion import random_fourier_motion

NUMBER = (int, float)

CONTRACT: dict[str, Any] = {
    "schema": str,
    "joints": [str],
    "noise_std": [NUMBER],
    "noise_method": str,
    "condition_number": NUMBER,
    "base_parameters": [
        {"name": str, "terms": dict, "value": NUMBER, "std": (*NUMBER, type(None)), "independent": bool}
    ],
    "unidentifiable": [str],
    "friction": [
        {
            "joint": str,
            "stiction": NUMBER,
            "stribeck": NUMBER,
            "viscous": NUMBER,
            "offset": NUMBER,
            "k_v": NUMBER,
            "delta": (*NUMBER, type(None)),
            "std": dict,
            "identifiable": dict,
        }
    ],
    "links": [
        {
            "mass": NUMBER,
            "first_moment": [NUMBER],
            "inertia": {"xx": NUMBER, "yy": NUMBER, "zz": NUMBER, "xy": NUMBER, "xz": NUMBER, "yz": NUMBER},
        }
    ],
    "fit": {
        "train": {"rms": [NUMBER], "relative_error": NUMBER},
        "held_out": {"rms": [NUMBER], "relative_error": NUMBER},
    },
}
"""The form that CONTRACT.md fixes: a list stands for any number of entries of one form."""


@pytest.fixture(scope="module")
def arm() -> SimulatedArm:
    return simulate(paper_robot(), seed=2)


def case(name: str, arm: SimulatedArm) -> Identification:
    """Identifications that put different things into the document."""
    rng = np.random.default_rng(0)
    recording = arm.recording(arm.white(PAPER_NOISE, rng))
    held_out = [arm.recording(arm.white(PAPER_NOISE, rng), name="held out")]
    if name == "plain":
        return identify(arm.robot, [recording], held_out)
    if name == "least squares, no held-out recording":
        return identify(arm.robot, [recording], options=Options(estimator=Estimator.LS))
    if name == "shapes open":
        return identify(with_shapes(arm.robot, None, None), [recording], held_out)
    if name == "shapes found":
        return identify(with_shapes(arm.robot, None, None), [arm.recording(arm.white(0.01, rng))], held_out)
    if name == "rotor and band":
        extra = np.array([0.0, 0.0, 0.3]) * arm.exact.exact.acceleration
        noisy = arm.recording(arm.white(PAPER_NOISE, rng), arm.white(2e-5, rng), extra_torque=extra, periods=False)
        return identify(arm.robot, [noisy], held_out)
    if name == "without noise":
        return identify(arm.robot, [arm.recording()], held_out)
    moving = random_fourier_motion(arm.robot.joints, np.random.default_rng(2))
    scale = np.array([1.0, 1.0, 0.0])[:, None]
    still = simulate(arm.robot, motion=replace(moving, cosine=moving.cosine * scale, sine=moving.sine * scale))
    return identify(arm.robot, [still.recording(still.white(PAPER_NOISE, rng), periods=False)], held_out)


CASES = (
    "plain",
    "least squares, no held-out recording",
    "shapes open",
    "shapes found",
    "rotor and band",
    "without noise",
    "a joint stands still",
)


@pytest.fixture(scope="module", params=CASES)
def result(request: pytest.FixtureRequest, arm: SimulatedArm) -> Identification:
    return case(request.param, arm)


def assert_form(value: Any, form: Any, place: str) -> None:
    """`value` has at least the keys of `form`, each of its type."""
    if isinstance(form, dict):
        assert isinstance(value, dict), place
        for key, inner in form.items():
            assert key in value, f"{place}.{key} is missing"
            assert_form(value[key], inner, f"{place}.{key}")
    elif isinstance(form, list):
        assert isinstance(value, list), place
        for index, entry in enumerate(value):
            assert_form(entry, form[0], f"{place}[{index}]")
    else:
        assert isinstance(value, form), f"{place} is {value!r}"
        assert not (isinstance(value, bool) and form is NUMBER), f"{place} is {value!r}"


def numbers_in(value: Any) -> list[float]:
    """All numbers of a JSON document."""
    if isinstance(value, dict):
        return [number for inner in value.values() for number in numbers_in(inner)]
    if isinstance(value, list):
        return [number for inner in value for number in numbers_in(inner)]
    return [value] if isinstance(value, NUMBER) and not isinstance(value, bool) else []


def refuse(constant: str) -> float:
    raise AssertionError(f"{constant} is no JSON")


def written(result: Identification) -> dict[str, Any]:
    return json.loads(document(result).model_dump_json(by_alias=True), parse_constant=refuse)


def test_the_keys_of_the_contract_are_there_with_their_types(result: Identification) -> None:
    found = written(result)
    form = dict(CONTRACT)
    if found["fit"]["held_out"] is None:
        form["fit"] = {"train": CONTRACT["fit"]["train"]}
    assert_form(found, form, "document")
    assert found["schema"] == "tauscope.identification/1"
    assert found["noise_method"] in ("periods", "residual")
    joint_count = len(found["joints"])
    for key in ("noise_std", "friction", "links"):
        assert len(found[key]) == joint_count
    assert [entry["joint"] for entry in found["friction"]] == found["joints"]
    for entry in found["friction"]:
        assert set(entry["std"]) <= {"stiction", "stribeck", "viscous", "offset", "k_v", "delta"}
        assert set(entry["identifiable"]) == {"stiction", "stribeck", "viscous", "offset", "k_v", "delta"}
        assert all(isinstance(flag, bool) for flag in entry["identifiable"].values())
    for entry in found["base_parameters"]:
        assert all(isinstance(factor, float) for factor in entry["terms"].values())


def test_no_number_is_nan_or_infinite(result: Identification) -> None:
    found = document(result).model_dump(by_alias=True)
    numbers = numbers_in(found)
    assert len(numbers) > 100
    assert all(math.isfinite(number) for number in numbers)
    assert all(number >= 0.0 for number in found["noise_std"])
    assert numbers_in(written(result)) == numbers  # nothing was turned into null on the way out


def test_the_document_survives_json_to_the_last_digit(result: Identification) -> None:
    first = document(result)
    text = first.model_dump_json(by_alias=True)
    again = IdentificationDocument.model_validate_json(text, strict=True)
    assert again == first
    assert again.model_dump_json(by_alias=True) == text


def test_it_is_strict(arm: SimulatedArm) -> None:
    found = written(case("plain", arm))
    for change in (
        {"schema": "tauscope.identification/2"},
        {"surplus": 1},
        {"condition_number": "35"},
        {"links": None},
    ):
        with pytest.raises(ValidationError):
            IdentificationDocument.model_validate_json(json.dumps(found | change), strict=True)
    del found["friction"]
    with pytest.raises(ValidationError):
        IdentificationDocument.model_validate_json(json.dumps(found), strict=True)


def test_every_field_is_described() -> None:
    """The OpenAPI page is written from these."""
    schema = IdentificationDocument.model_json_schema(by_alias=True)
    for name, model in {"document": schema, **schema["$defs"]}.items():
        for field, description in model["properties"].items():
            assert description.get("description"), f"{name}.{field} is not described"


def test_what_the_robot_file_states_has_no_standard_error(arm: SimulatedArm) -> None:
    for entry in document(case("plain", arm)).friction:
        assert (entry.k_v, entry.delta) == (500.0, 10.0)
        assert set(entry.std) == {"stiction", "stribeck", "viscous", "offset"}
        assert all(entry.identifiable.values())


def test_terms_that_the_model_lacks_are_zero_and_not_identifiable(arm: SimulatedArm) -> None:
    for entry in document(case("shapes open", arm)).friction:
        if entry.delta is None:
            assert entry.stribeck == 0.0
            assert not entry.identifiable["stribeck"]
            assert not entry.identifiable["delta"]
            assert "stribeck" not in entry.std


def test_links_weigh_as_much_as_the_bodies_can(result: Identification) -> None:
    for link in document(result).links:
        assert link.mass > 0.0


def test_identifying_twice_gives_the_same_document(arm: SimulatedArm) -> None:
    assert document(case("shapes found", arm)) == document(case("shapes found", arm))


def test_steps_are_told_as_they_begin(arm: SimulatedArm) -> None:
    steps: list[str] = []
    recording = arm.recording(arm.white(PAPER_NOISE, np.random.default_rng(0)))
    identify(arm.robot, [recording], progress=steps.append)
    assert len(steps) == len(set(steps)) >= 4
    assert all(step and "\n" not in step for step in steps)


def test_nothing_is_written_to_the_recording(arm: SimulatedArm) -> None:
    recording = arm.recording(arm.white(PAPER_NOISE, np.random.default_rng(0)))
    before = [np.array(column) for column in (recording.samples().position, recording.samples().effort)]
    identify(arm.robot, [recording], [recording])
    after = (recording.samples().position, recording.samples().effort)
    for old, new in zip(before, after, strict=True):
        np.testing.assert_array_equal(old, new)
