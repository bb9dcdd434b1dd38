"""What is counted right: names within sets, what comes with an effect, parameters of the same thing."""

from typing import Any

import pytest

from concealed.scoring.rescored import rescored
from concealed.scoring.score import compared
from concealed.sealing.truth import Hidden, Truth
from tauscope.diagnosis.documents.document import DiagnosisDocument


def finding(effect: str, joint: str | None, probability: float = 0.95, **more: Any) -> dict[str, Any]:
    told: dict[str, Any] = {
        "effect": effect,
        "joint": joint,
        "probability": probability,
        "equivalent": [],
        "equation": "",
        "parameters": [],
        "statement": "",
        "gain": 1.0,
        "confirmed": None,
        "rms_before": [1.0, 1.0],
        "rms_after": [1.0, 1.0],
        "held_out_rms_before": None,
        "held_out_rms_after": None,
    }
    return {**told, **more}


def diagnosis(*findings: dict[str, Any], verdict: str = "explained") -> DiagnosisDocument:
    change = {"rms_before": [1.0, 1.0], "rms_after": [1.0, 1.0]}
    mismatch = [
        {"joint": f"joint{n}", "excess_rms": size, "significant": size > 0.2, "where": None, "time": None}
        for n, size in ((1, 0.5), (2, 0.3))
    ]
    return DiagnosisDocument.model_validate(
        {
            "robot": "r",
            "joints": ["joint1", "joint2"],
            "against": "identified",
            "verdict": verdict,
            "noise_std": [1.0, 1.0],
            "noise_method": "periods",
            "cutoff_hz": 10.0,
            "mismatch": mismatch,
            "findings": list(findings),
            "fit": {"train": change, "held_out": change},
            "constancy": {"p_value": 0.5, "moved": []},
            "detectable": [],
            "parameter_differences": [],
            "parameter_shifts": [],
            "next_experiment": None,
        }
    )


def hidden(*labels: str, also: tuple[str, ...] = (), **parameters: float) -> Hidden:
    joints: list[str | None] = [label.partition("@")[2] or None for label in labels]
    return Hidden(list(labels), list(also), joints, parameters)


def truth(*told: Hidden) -> Truth:
    return Truth({}, list(told), 15.0, [1.0, 1.0])


COGGING = hidden("cogging@joint1", amplitude=2.0)


def test_the_truth_among_equivalents_is_named_but_not_first() -> None:
    found = compared(truth(COGGING), diagnosis(finding("backlash", "joint2", equivalent=["cogging@joint1"])), 1.0)
    assert (found.named, found.first, found.placed, found.extra, found.size) == (True, False, False, [], 2.0)
    assert found.probabilities == [(0.95, False)]


def test_what_comes_with_an_effect_is_right_and_not_extra() -> None:
    elastic = hidden("joint_elasticity@joint1", also=("rotor_inertia@joint1",))
    said = diagnosis(finding("joint_elasticity", "joint1"), finding("rotor_inertia", "joint1", 0.99))
    found = compared(truth(elastic), said, 1.0)
    assert found.extra == []
    assert found.probabilities == [(0.95, True), (0.99, True)]
    alone = compared(truth(elastic), diagnosis(finding("rotor_inertia", "joint1")), 1.0)
    assert not alone.named


def test_friction_that_the_robot_file_does_not_state_is_no_false_alarm() -> None:
    sound = Truth({}, [], 0.0, [1.0, 1.0], ["stribeck_friction@joint1"])
    assert not compared(sound, diagnosis(finding("stribeck_friction", "joint1")), 1.0).claimed
    assert compared(sound, diagnosis(finding("stribeck_friction", "joint2")), 1.0).claimed


def test_of_two_both_have_to_be_named() -> None:
    both = truth(COGGING, hidden("backlash@joint2"))
    assert not compared(both, diagnosis(finding("cogging", "joint1")), 1.0).named
    assert compared(both, diagnosis(finding("cogging", "joint1"), finding("backlash", "joint2")), 1.0).named


@pytest.mark.parametrize(("value", "inside"), [(2.19, True), (2.21, False), (1.79, False)])
def test_an_interval_is_1_96_standard_errors(value: float, inside: bool) -> None:
    quantity = {"name": "amplitude", "value": value, "std": 0.1, "unit": "Nm"}
    said = diagnosis(finding("cogging", "joint1", parameters=[quantity]))
    (parameter,) = compared(truth(COGGING), said, 1.0).parameters
    assert parameter.inside is inside


@pytest.mark.parametrize(("link", "counted"), [(2.0, 1), (1.0, 0)])
def test_the_displacement_of_another_frame_is_no_estimate_of_this_one(link: float, counted: int) -> None:
    values = {"d": (0.03, 0.001), "link": (link, 0.0), "axis": (3.0, 0.0)}
    said = [{"name": name, "value": value, "std": std, "unit": ""} for name, (value, std) in values.items()]
    error = hidden("kinematic_error", d=0.03, link=2.0, axis=3.0)
    found = compared(truth(error), diagnosis(finding("kinematic_error", None, parameters=said)), 1.0)
    assert found.named
    assert len(found.parameters) == counted


@pytest.mark.parametrize(("exponent", "counted"), [(2.0, 2), (1.0, 0)])
def test_a_decay_of_another_exponent_is_no_estimate_of_this_one(exponent: float, counted: int) -> None:
    values = {"s": (1.2, 0.1), "v_s": (0.2, 0.01), "alpha": (exponent, 0.0)}
    said = [{"name": name, "value": value, "std": std, "unit": ""} for name, (value, std) in values.items()]
    stribeck = hidden("stribeck_friction@joint1", s=1.2, v_s=0.2, alpha=2.0)
    found = compared(truth(stribeck), diagnosis(finding("stribeck_friction", "joint1", parameters=said)), 1.0)
    assert len(found.parameters) == counted


def test_a_power_that_is_estimated_is_a_parameter_and_no_kind() -> None:
    said = [{"name": "c", "value": 2.1, "std": 0.1, "unit": ""}, {"name": "p", "value": 1.8, "std": 0.1, "unit": "1"}]
    drag = hidden("nonlinear_viscous@joint1", c=2.0, p=1.7)
    found = compared(truth(drag), diagnosis(finding("nonlinear_viscous", "joint1", parameters=said)), 1.0)
    assert [each.name for each in found.parameters] == ["c", "p"]


@pytest.mark.parametrize(
    ("minimum", "verdict", "promised"),
    [
        (1.9, "explained", [True]),
        (1.9, "consistent", [False]),
        (1.9, "inconclusive", [False]),
        (2.1, "consistent", []),
        (None, "consistent", []),
    ],
)
def test_what_is_called_detectable_has_to_be_detected(
    minimum: float | None, verdict: str, promised: list[bool]
) -> None:
    told = diagnosis(verdict=verdict).model_dump(mode="json", by_alias=True)
    entry = {"effect": "cogging", "joint": "joint1", "minimum": minimum, "unit": "Nm", "visible": minimum is not None}
    other = {**entry, "joint": "joint2", "minimum": 0.1}
    found = DiagnosisDocument.model_validate({**told, "detectable": [other, entry]}, strict=False)
    assert compared(truth(COGGING), found, 1.0).promised == promised


def test_the_largest_mismatch_has_to_be_at_the_joint() -> None:
    assert compared(truth(COGGING), diagnosis(), 1.0).located
    assert not compared(truth(hidden("cogging@joint2")), diagnosis(), 1.0).located


def test_kept_outcomes_can_be_scored_anew() -> None:
    from dataclasses import asdict

    said = diagnosis(finding("cogging", "joint1"))
    told = {
        "truth": asdict(truth(COGGING)),
        "diagnosis": said.model_dump(mode="json", by_alias=True, exclude={"detectable"}),
        "seconds": 2.0,
        "score": {"named": False},
    }
    assert rescored(told)["score"]["named"]
    assert rescored({"error": "x"}) == {"error": "x"}
