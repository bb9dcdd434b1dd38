"""Whole diagnoses of arms under the simulated drives whose recordings hold qlink and temp."""

from typing import Any

import numpy as np
import pytest

from diagnosis.forward_arm import forward_recording
from identification.simulated import paper_robot
from tauscope.diagnosis import DiagnosisDocument, diagnose, document

ELASTIC = {"effect": "joint_elasticity", "joint": 2, "stiffness": 3000.0, "damping": 1.0, "rotor_inertia": 0.3}
PLAY = {"effect": "backlash", "joint": 3, "gap": 0.004, "contact_stiffness": 20000.0, "rotor_inertia": 0.1}
WARM = {
    "effect": "friction_drift",
    "joint": 1,
    "thermal_resistance": 20.0,
    "time_constant": 15.0,
    "coulomb_per_kelvin": -0.01,
    "viscous_per_kelvin": -0.03,
}


def diagnosed(entry: dict[str, Any], warmer: dict[str, Any], torque_noise: float = 0.3) -> DiagnosisDocument:
    rng = np.random.default_rng(5)
    train = [forward_recording(1, entry, rng, torque_noise), forward_recording(2, warmer, rng, torque_noise)]
    held_out = [forward_recording(11, warmer, rng, torque_noise)]
    return document(diagnose(paper_robot(), train, held_out))


@pytest.mark.proof
@pytest.mark.parametrize(
    ("entry", "name", "true"),
    [
        pytest.param(ELASTIC, "c", 1.0 / 3000.0, id="compliance"),
        pytest.param(PLAY, "b", 0.004, id="play"),
    ],
)
def test_a_transmission_is_measured_by_the_link_s_encoder(entry: dict[str, Any], name: str, true: float) -> None:
    found = {each.effect: each for each in diagnosed(entry, entry).findings}
    finding = found[entry["effect"]]
    assert finding.joint == f"joint{entry['joint']}"
    value = next(each for each in finding.parameters if each.name == name)
    assert abs(value.value - true) < 2.0 * value.std < 0.15 * true
    assert not {"joint_elasticity", "backlash"} & set(found) - {entry["effect"]}


@pytest.mark.proof
def test_friction_that_cools_off_is_named_with_the_recorded_temperature() -> None:
    found = diagnosed(WARM, {**WARM, "initial_temperature": 45.0}, torque_noise=0.1)
    drift = next(each for each in found.findings if each.effect == "friction_drift")
    assert (drift.joint, drift.confirmed) == ("joint1", True)
    assert "temperature" in drift.statement
    place = found.mismatch[0].where
    assert place is not None
    assert place.variable == "temperature"
    assert drift.held_out_rms_before is not None
    assert drift.held_out_rms_after is not None
    assert drift.held_out_rms_after[0] < 0.9 * drift.held_out_rms_before[0]
