# %% [markdown]
# # Checks of an arm in your own CI
# `pytest test_arm.py`. The simulated arm stands in for yours: replace `record` by your own recordings, or by
# `tauscope run`. The drift gate fails when a parameter leaves the reference model.

# %%
from pathlib import Path

import numpy as np
import pytest

import tauscope

ROBOT = Path(__file__).parent / "two_joint_arm.yaml"
LARGEST_ERROR = 0.05
"""Largest relative torque error on held-out motion."""
DRIFT_SIGMA = 5.0
"""Standard errors that a parameter may move."""
NOISE = [0.2, 0.1]


def record(seed, effects=()):
    """One recording; every seed plays another motion."""
    motion = tauscope.design_excitation(ROBOT, period_s=3.0, harmonics=3, periods=2, slow_reversals=False, seed=seed)
    scenario = {"torque_noise_std": NOISE, "seed": seed, "effects": list(effects)}
    return tauscope.simulate(ROBOT, motion, scenario=scenario, rate_hz=100, name=f"recording {seed}")


def largest_drift(reference, present):
    """Largest change of a friction coefficient, in standard errors.

    Base parameters are compared in the same way; friction is what drifts first.
    """
    before, after = reference.to_frame().set_index("parameter"), present.to_frame().set_index("parameter")
    both = [name for name in before.index.intersection(after.index) if name.startswith(("viscous", "offset"))]
    change = after.loc[both, "value"] - before.loc[both, "value"]
    return float(np.abs(change / np.hypot(before.loc[both, "std"], after.loc[both, "std"])).max())


# %%
@pytest.fixture(scope="module")
def recordings():
    """Two recordings: one to learn from, one to judge by."""
    return record(0), record(1)


@pytest.fixture(scope="module")
def reference(recordings):
    """The model of record."""
    return tauscope.identify(ROBOT, recordings[0], held_out=recordings[1])


def test_the_model_predicts_other_motions(reference):
    assert reference.document.fit.held_out.relative_error < LARGEST_ERROR


def test_no_physics_is_missing(recordings):
    assert tauscope.diagnose(ROBOT, recordings[0], held_out=recordings[1]).document.verdict == "consistent"


def test_the_arm_has_not_drifted(reference):
    assert largest_drift(reference, tauscope.identify(ROBOT, record(2))) < DRIFT_SIGMA


def test_the_gate_sees_a_drift(reference):
    stiff = [{"effect": "viscous_friction", "joint": 1, "coefficient": 0.8}]
    assert largest_drift(reference, tauscope.identify(ROBOT, record(2, stiff))) > DRIFT_SIGMA
