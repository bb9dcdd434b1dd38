"""A load that is let go in training: held-out motion says whether the arm has it everywhere else or nowhere else."""

import numpy as np
import pytest

from diagnosis.loaded_arm import exact_motion, noisy, seconds, torque_of_load
from identification.simulated import paper_robot
from tauscope.diagnosis import diagnose, document
from tauscope.recording import Recording

SEEDS = (1, 2, 11)
MASS, PLACE = 0.3, np.array([0.05, 0.02, 0.0])
LET_GO_S = 8.3
NEVER, ALWAYS = 0.0, np.inf


def carrying(seed: int, until_s: float, rng: np.random.Generator) -> Recording:
    """A motion with the load up to an instant."""
    arm = exact_motion(seed, SEEDS)
    load = torque_of_load(seed, MASS, PLACE) * (seconds(arm) < until_s)[:, None]
    return noisy(arm, load, seed, rng)


@pytest.mark.slow
@pytest.mark.parametrize("held_out_until_s", [NEVER, pytest.param(ALWAYS, marks=pytest.mark.proof)])
def test_held_out_motion_is_predicted_with_the_load_that_it_has(held_out_until_s: float) -> None:
    """The same training recordings both times: they alone cannot say which body the nominal parameters are of."""
    rng = np.random.default_rng(7)
    train = [carrying(1, ALWAYS, rng), carrying(2, LET_GO_S, rng)]
    found = diagnose(paper_robot(), train, [carrying(11, held_out_until_s, rng)])
    findings = document(found).findings
    assert [(each.effect, each.confirmed) for each in findings] == [("payload_change", True)]
    assert "dropped at" in findings[0].statement
    sizes = {each.name: each.value for each in findings[0].parameters}
    assert abs(sizes["t_off"] - LET_GO_S) < 0.05
    assert abs(sizes["m"] - MASS) < 0.02
    assert found.predicts
