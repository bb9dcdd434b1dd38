"""What happens once, or for a while, in whole diagnoses; effects by formulas and simulations of their own."""

from collections.abc import Callable
from functools import cache

import numpy as np
import pytest

from diagnosis.diagnosed_arm import at_joint
from diagnosis.loaded_arm import exact_motion, noisy, seconds, torque_of_load
from identification.simulated import Array, SimulatedArm, paper_robot
from tauscope.diagnosis import DiagnosisDocument, diagnose, document
from tauscope.dynamics import inverse_dynamics, smooth_sign
from tauscope.effects.kinematic_error import displaced

TRAIN, HELD_OUT = (1, 2, 3), (11, 12)
PLACE = np.array([0.05, 0.02, 0.0])
LONGER = 0.03
"""[m]"""

Extra = Callable[[SimulatedArm, int], Array | float]


def picked_up(arm: SimulatedArm, seed: int) -> Array | float:
    """0.3 kg from 8.3 s of the second recording to its end."""
    return torque_of_load(seed, 0.3, PLACE) * (seconds(arm) > 8.3)[:, None] if seed == 2 else 0.0


def dropped_each_time(arm: SimulatedArm, seed: int) -> Array | float:
    return torque_of_load(seed, 0.3, PLACE) * (seconds(arm) < 12.1)[:, None]


def between_recordings(arm: SimulatedArm, seed: int) -> Array | float:
    return torque_of_load(seed, 0.3, PLACE) if seed == 3 else 0.0


def bumped(arm: SimulatedArm, seed: int) -> Array | float:
    """Half a sine of 4 Nm at joint 2 in the second recording."""
    phase = (seconds(arm) - 6.3) / 1.6
    within = (phase > 0.0) & (phase < 1.0)
    return at_joint(1, 4.0 * np.where(within, np.sin(np.pi * phase), 0.0)) if seed == 2 else 0.0


def nudged(arm: SimulatedArm, seed: int) -> Array | float:
    """Half a sine of 3 Nm and 0.7 s at joint 2 in every recording."""
    phase = (seconds(arm) - 6.47) / 0.7
    within = (phase > 0.0) & (phase < 1.0)
    return at_joint(1, 3.0 * np.where(within, np.sin(np.pi * phase), 0.0))


def offset(arm: SimulatedArm, seed: int) -> Array | float:
    return at_joint(2, np.full(len(arm.exact.time), 0.6))


def one_sided(arm: SimulatedArm, seed: int) -> Array | float:
    """Coulomb friction one way only: half of it is a constant."""
    velocity = arm.exact.exact.velocity[:, 0]
    return at_joint(0, 0.6 * np.maximum(smooth_sign(velocity, 500.0), 0.0))


def longer(arm: SimulatedArm, seed: int) -> Array | float:
    robot = paper_robot()
    links = np.concatenate([link.to_vector() for link in robot.model.links or ()])
    exact = arm.exact.exact
    state = exact.position, exact.velocity, exact.acceleration
    as_built = displaced(robot, 1, np.array([LONGER, 0.0, 0.0]))
    return inverse_dynamics(as_built, links, *state) - inverse_dynamics(robot, links, *state)


@cache
def told(extra: Extra | None) -> DiagnosisDocument:
    rng = np.random.default_rng(7)
    made = []
    for seed in TRAIN + HELD_OUT:
        arm = exact_motion(seed, TRAIN + HELD_OUT)
        made.append(noisy(arm, 0.0 if extra is None else extra(arm, seed), seed, rng))
    return document(diagnose(paper_robot(), made[:3], made[3:]))


def sizes(found: DiagnosisDocument) -> dict[str, tuple[float, float]]:
    return {entry.name: (entry.value, entry.std) for entry in found.findings[0].parameters}


def within(found: tuple[float, float], truth: float, relative: float = 0.03) -> bool:
    return abs(found[0] - truth) < 4.0 * found[1] + relative * abs(truth)


@pytest.mark.proof  # tests/diagnosis/test_outside.py is the quick one
def test_a_mass_that_is_picked_up_is_named_with_its_size_and_instant() -> None:
    found = told(picked_up)
    assert [(finding.effect, finding.joint) for finding in found.findings] == [("payload_change", None)]
    assert found.verdict == "explained"
    values = sizes(found)
    assert within(values["m"], 0.3)
    assert within(values["ms_x"], 0.3 * 0.05, 0.2)
    assert abs(values["t_on"][0] - 8.3) < 0.05
    assert "picked up at 8.3" in found.findings[0].statement
    assert "motion-2" in found.findings[0].statement
    assert found.findings[0].confirmed


@pytest.mark.proof
@pytest.mark.parametrize(("extra", "said"), [(dropped_each_time, "dropped at 12.1"), (between_recordings, "motion-3")])
def test_a_mass_that_changes_otherwise_is_named_too(extra: Extra, said: str) -> None:
    found = told(extra)
    assert [(finding.effect, finding.joint) for finding in found.findings] == [("payload_change", None)]
    assert abs(sizes(found)["m"][0] - 0.3) < 0.02
    assert said in found.findings[0].statement


@pytest.mark.proof
def test_a_contact_is_named_with_joint_size_and_window() -> None:
    found = told(bumped)
    assert [(finding.effect, finding.joint) for finding in found.findings] == [("external_contact", "joint2")]
    values = sizes(found)
    assert within(values["c"], 4.0)
    assert within(values["t_0"], 6.3)
    assert within(values["t_1"], 7.9)


@pytest.mark.proof
def test_a_short_push_that_rises_and_falls_is_told_from_one_that_is_there_at_once() -> None:
    """On a grid of windows either may come nearer to it."""
    found = told(nudged)
    assert [(finding.effect, finding.joint) for finding in found.findings] == [("external_contact", "joint2")]
    values = sizes(found)
    assert within(values["c"], 3.0)
    assert within(values["t_0"], 6.47)
    assert within(values["t_1"], 7.17)


@pytest.mark.slow
def test_a_constant_is_found_beside_friction_that_does_not_declare_it() -> None:
    found = told(offset)
    named = [(finding.effect, finding.joint) for finding in found.findings]
    assert named == [("torque_offset", "joint3")]
    assert within(sizes(found)["c"], 0.6)
    assert found.headline.startswith("The torque has an offset of +0.")


@pytest.mark.proof
def test_friction_that_a_constant_nearly_imitates_is_in_the_set() -> None:
    found = told(one_sided)
    assert len(found.findings) == 1
    (finding,) = found.findings
    names = {f"{finding.effect}@{finding.joint}", *finding.equivalent}
    assert "asymmetric_coulomb@joint1" in names
    assert len(names) <= 3


@pytest.mark.proof
def test_a_wrong_length_is_measured() -> None:
    """Upper arm 30 mm longer than in the file: torque of one arm less that of the other."""
    found = told(longer)
    assert [(finding.effect, finding.joint) for finding in found.findings] == [("kinematic_error", None)]
    size = sizes(found)
    assert (size["link"][0], size["axis"][0]) == (2.0, 1.0)
    assert within(size["d"], LONGER)


@pytest.mark.proof
def test_what_no_motion_shows_is_listed_as_not_visible_and_the_rest_with_its_size() -> None:
    found = told(None)
    assert not found.findings
    (payload,) = [each for each in found.detectable if each.effect == "payload"]
    assert not payload.visible
    (length,) = [each for each in found.detectable if each.effect == "kinematic_error"]
    assert length.visible
    assert length.minimum is not None
    assert 0.0 < length.minimum < LONGER
