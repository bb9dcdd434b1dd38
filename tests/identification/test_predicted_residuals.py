"""The residual that a result predicts for motion that it has not seen is the one that shows."""

from pathlib import Path

import numpy as np
import pytest

from identification.poor_motion import MOTIONS, poor_arm
from identification.residual_ratios import ratios, within
from shared_data import SHARED_CASES, needs_shared_cases
from tauscope.identification import IdentificationDocument, Options, document, identify
from tauscope.recording import read_recording
from tauscope.robot import read_robot


def poor(seed: int, kind: str, folder: Path) -> IdentificationDocument:
    robot, train, held_out = poor_arm(seed, kind, folder)
    return document(identify(robot, [train], [held_out]))


@pytest.mark.parametrize("kind", MOTIONS)
@pytest.mark.parametrize("seed", [11, pytest.param(1, marks=pytest.mark.slow)], ids=["three joints", "six joints"])
def test_poor_motion_gives_no_nonsense(seed: int, kind: str, tmp_path: Path) -> None:
    robot, train, held_out = poor_arm(seed, kind, tmp_path)
    result = identify(robot, [train], [held_out])
    assert result.held_out is not None
    free = identify(robot, [train], [held_out], Options(prior=False)).held_out
    assert free is not None
    assert result.held_out.relative_error < 1.15 * free.relative_error
    found = document(result)
    assert np.all(ratios(found) < 3.0)
    for link, entry in zip(found.links, found.friction, strict=True):
        assert 0.02 < link.mass < 60.0
        assert min(entry.stiction, entry.viscous, entry.stiction + entry.stribeck) >= 0.0


@pytest.mark.proof
def test_two_hundred_poor_arms(tmp_path: Path) -> None:
    """Where one parameter decides over a joint, a third of all such residuals is under half of what is expected."""
    kinds = list(MOTIONS)
    found = np.concatenate([ratios(poor(seed, kinds[seed % len(kinds)], tmp_path)) for seed in range(1000, 1200)])
    assert within(found) > 0.85
    assert np.mean(found >= 2.0) < 0.04


@needs_shared_cases
def test_a_recording_of_one_joint_after_another() -> None:
    """Freely fitted: -30,100 kg m² and 45,289 % held out."""
    robot = read_robot(SHARED_CASES / "ur5" / "ur5.yaml")
    train = read_recording(SHARED_CASES / "recordings" / "46-joint-after-joint.csv")
    found = document(identify(robot, [train], [read_recording(SHARED_CASES / "ur5" / "ur5-held.csv")]))
    assert found.fit.held_out is not None
    assert found.fit.held_out.relative_error < 0.01
    assert np.all(ratios(found) < 2.0)
    assert {"poor-excitation", "extrapolation"} <= {warning.code for warning in found.warnings}
    assert {entry.determined_by for entry in found.base_parameters} > {"data"}
