"""Sizes of what is concealed in recordings: multiples of the plain residual, after the nominal model's share."""

from dataclasses import replace

import numpy as np
import pytest

from concealed.real.concealing.concealment import Concealment
from concealed.real.concealing.draw import total_size
from concealed.real.concealing.ground import Ground
from concealed.real.concealing.kinds import KINDS
from concealed.real.concealing.made_up_set import NOISE, made_up_set
from concealed.real.concealing.nominal import fit_nominal
from concealed.real.concealing.oracle import estimate_sizes
from concealed.real.concealing.sizing import multiple_left, size_for, solve_size

pytestmark = pytest.mark.slow

OF_TORQUE = ("spring", "cogging", "asymmetric_viscous", "coupling", "payload_change", "contact")
OTHERS = ("delay_all", "gain_joint", "saturation", "gravity")


@pytest.fixture(scope="module")
def ground(tmp_path_factory: pytest.TempPathFactory) -> Ground:
    return made_up_set(tmp_path_factory.mktemp("made-up"))


def draw(ground: Ground, kind: str, joint: int = 3) -> Concealment:
    drawn = KINDS[kind](ground, joint, np.random.default_rng(1))
    assert drawn is not None
    return drawn


def changed(ground: Ground, concealment: Concealment, size: float) -> Ground:
    """The set with an effect in its torque, fitted anew."""
    added = concealment.added(ground, size)
    passages = [each.with_torque(each.torque + more) for each, more in zip(ground.passages, added, strict=True)]
    nominal = fit_nominal(ground.robot, passages, ground.band_hz)
    return replace(ground, passages=passages, nominal=nominal, load=nominal.load())


def test_the_plain_residual_is_the_noise_in_the_band(ground: Ground) -> None:
    """White noise of 200 Hz behind two passes of a fourth-order filter at 8 Hz: 0.95 of an ideal band's share."""
    share = np.sqrt(0.95 * ground.band_hz / 100.0)
    np.testing.assert_allclose(ground.nominal.scale, NOISE * share, rtol=0.2)


@pytest.mark.parametrize("kind", OF_TORQUE)
def test_the_nominal_model_leaves_the_wanted_multiple(ground: Ground, kind: str) -> None:
    concealment = draw(ground, kind)
    size = size_for(ground, concealment, 1.5)
    assert size is not None
    assert multiple_left(ground, concealment, size) == pytest.approx(1.5, rel=1e-6)
    # Least squares of our own: the effect's rows beside all columns of the nominal model, joint by joint weighted.
    nominal = ground.nominal
    rows = nominal.rows(concealment.added(ground, size))
    columns = [each / nominal.weights[:, None] for each in nominal.columns]
    stacked = np.concatenate([columns[number].reshape(-1, columns[0].shape[2]) for number in nominal.training])
    target = np.concatenate([(rows[number] / nominal.weights).ravel() for number in nominal.training])
    left = target - stacked @ np.linalg.lstsq(stacked, target, rcond=1e-6)[0]
    if concealment.window is None:
        own = left.reshape(-1, ground.robot.joint_count)[:, 3] * nominal.weights[3] / nominal.scale[3]
        assert np.sqrt(np.mean(own**2)) == pytest.approx(1.5, rel=0.02)


@pytest.mark.parametrize("kind", OTHERS)
def test_sizes_of_what_is_not_proportional_are_found(ground: Ground, kind: str) -> None:
    concealment = draw(ground, kind)
    ends = [multiple_left(ground, concealment, size) for size in concealment.bounds]
    wanted = float(np.sqrt(max(ends[0], 1e-3) * ends[1]))
    size = size_for(ground, concealment, wanted)
    assert size is not None
    assert multiple_left(ground, concealment, size) == pytest.approx(wanted, rel=0.04)


def test_a_root_of_a_rising_and_of_a_falling_power_is_found() -> None:
    assert solve_size(lambda size: 2.0 * size**1.5, 4.0, (0.01, 100.0)) == pytest.approx(2.0 ** (2.0 / 3.0), rel=0.03)
    assert solve_size(lambda size: 2.0 / size, 4.0, (0.01, 100.0)) == pytest.approx(0.5, rel=0.03)
    assert solve_size(lambda size: 2.0 * size, 400.0, (0.01, 100.0)) is None


def test_sizes_beyond_what_moved_the_joint_are_refused(ground: Ground) -> None:
    spring = draw(ground, "spring")
    assert size_for(ground, spring, 3.0) is not None
    weak = replace(ground, effort=0.01 * ground.effort)
    assert size_for(weak, spring, 3.0) is None
    assert size_for(ground, replace(spring, bounds=(0.0, 1e-6)), 3.0) is None


def test_what_the_nominal_model_absorbs_whole_has_no_size(ground: Ground) -> None:
    viscous = replace(draw(ground, "spring"), torque=lambda passage, load: 1.0 * passage.velocity)
    assert size_for(ground, viscous, 0.7) is None


@pytest.mark.parametrize("kind", [*OF_TORQUE, "delay_all", "gain_joint"])
def test_the_oracle_finds_the_size(ground: Ground, kind: str) -> None:
    concealment = draw(ground, kind, joint=1 if kind == "gain_joint" else 3)
    size = 0.3 if kind == "gain_joint" else size_for(ground, concealment, 1.5)
    assert size is not None
    (before,) = estimate_sizes(ground, [concealment], start=0.0) or []
    (found,) = estimate_sizes(changed(ground, concealment, size), [concealment]) or []
    assert abs(found.size - total_size(concealment, size, before.size)) <= 2.0 * found.std
    assert found.std < 0.2 * size


def test_the_oracle_is_as_uncertain_as_it_says(ground: Ground) -> None:
    """In recordings with nothing but noise, estimates scatter about zero by their standard errors."""
    found = []
    for kind in ("spring", "cogging", "ripple", "asymmetric_viscous", "position_friction"):
        for joint in range(0, ground.robot.joint_count, 2):
            concealment = KINDS[kind](ground, joint, np.random.default_rng(joint))
            if concealment is not None:
                found += estimate_sizes(ground, [concealment]) or []
    assert np.sqrt(np.mean([(each.size / each.std) ** 2 for each in found])) == pytest.approx(1.0, abs=0.35)


def test_the_oracle_finds_two_sizes_together(ground: Ground) -> None:
    laws = [draw(ground, "spring"), draw(ground, "cogging", joint=2)]
    sizes = [size_for(ground, law, 1.5) or 0.0 for law in laws]
    trial = changed(changed(ground, laws[0], sizes[0]), laws[1], sizes[1])
    before, after = (estimate_sizes(each, laws) or [] for each in (ground, trial))
    for there, found, size in zip(before, after, sizes, strict=True):
        assert abs(found.size - there.size - size) <= 2.0 * found.std


def test_a_wrong_sign_feeds_the_motion(ground: Ground) -> None:
    for kind in ("sign_joint", "sign_all"):
        law = draw(ground, kind)
        (before,), (after,) = (estimate_sizes(each, [law]) or [] for each in (ground, changed(ground, law, -2.0)))
        assert (before.size, after.size) == (0.0, -2.0)
