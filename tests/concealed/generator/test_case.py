"""What is drawn becomes the trial that was drawn."""

from pathlib import Path
from typing import Any

import pytest

from concealed.generator import case as cases
from concealed.generator.arms import arm_named, file_without_truth, is_dry
from concealed.generator.case import COARSE, DRY_ARMS, POOR, SENSORS, SIGN, SIGNS, Case, drawn
from concealed.generator.concealment import Concealed
from concealed.generator.effects import CATALOGUE
from concealed.generator.strength import Reference
from tauscope.robot import read_robot


@pytest.mark.parametrize("places", [(), (("cogging", 1),), (("cogging", 1), ("backlash", 2))])
@pytest.mark.parametrize("sensors", [*SENSORS, *COARSE, *POOR])
def test_whatever_is_wrong_with_the_sensors_comes_beside_whatever_is_concealed(
    places: tuple[tuple[str, int], ...], sensors: dict[str, Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(cases, "recorded_trial", lambda arm, concealed, **drawn: (arm, concealed, drawn))
    case, concealed = Case("strong-sensing", 3, "paper", places, 40.0, sensors=sensors), Concealed()
    assert case.recorded(concealed) == ("paper", concealed, {"motion_seed": 0, "seed": 3, "motion": "rich", **sensors})


def test_pairs_share_a_joint_and_drift_has_company() -> None:
    for seed in range(40):
        one, two = drawn("pair-one-joint", seed).places
        assert one[1] == two[1]
        assert one[0] != two[0]
        first, other = drawn("drift-beside", seed).places
        assert (first[0], other[0] != "friction_drift") == ("friction_drift", True)


def test_signs_turn_at_every_joint_the_base_among_them_and_of_all() -> None:
    cases = [drawn("sign", seed, "six") for seed in range(80)]
    assert {case.places[0] for case in cases if case.places[0][0] == SIGN} == {(SIGN, joint) for joint in range(6)}
    assert any(case.places[0][0] == SIGNS for case in cases)
    turned = Case("sign", 1, "six", ((SIGNS, 2),)).concealed()
    assert [(entry["joint"], entry["gain"]) for entry in turned.entries] == [(joint, -1.0) for joint in range(1, 7)]
    assert (turned.truth[0].places, turned.truth[0].names) == ((None,), ("torque_gain_error",))
    one = Case("sign", 1, "six", ((SIGN, 0),)).concealed()
    assert [(entry["joint"], entry["gain"]) for entry in one.entries] == [(1, -1.0)]


def test_stepwise_motion_is_of_dry_arms_and_its_strength_is_its_own(tmp_path: Path) -> None:
    cases = [drawn("poor", seed) for seed in range(200)]
    assert {case.arm for case in cases} == set(DRY_ARMS)
    assert {case.kind for case in cases} == {"jogs", "points"}
    assert {case.places[0][0] for case in cases} == set(CATALOGUE)
    assert all(is_dry(case.arm) for case in cases)
    case = Case("poor", 1, "servo-dry", (), 15.0, "jogs", sensors={"every": 4, "kind": "autoregressive"})
    assert case.reference == Reference("jogs", 4, 0.95)
    assert Case("weak", 1, "six", (), 8.0, sensors={"every": 2}).reference == Reference()
    assert arm_named("servo-dry").joints[0].friction_shape.k_v == 1e5
    file_without_truth("servo-dry", tmp_path / "robot.yaml", states_friction=True)
    assert read_robot(tmp_path / "robot.yaml").joints[0].friction_shape.k_v is None
