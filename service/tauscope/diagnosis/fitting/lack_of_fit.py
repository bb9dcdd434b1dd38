"""Whether anything but noise is left at a joint, without asking what.

Two tests. *Omnibus*: a basis of smooth functions of the joint's state and of time, projected off the model, holds no
more of the residual's energy per direction than the rest does (F test: an error of the noise's size does not matter).
*Pure error*: the mean over repetitions differs from the model by no more than repetitions differ among themselves.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy import stats

from tauscope.diagnosis.fitting.fit import Fit, Fitter
from tauscope.diagnosis.observations.observations import Observations, Piece
from tauscope.effects.computation import side_by_side
from tauscope.recording.recording import Array

FEATURES = 60
HATS = 12  # hat functions of time in every recording
MEASURABLE = 1.0  # standard errors of the noise's power, as repetitions tell it, that a mismatch exceeds it by
# Singular value of the features beside a model, of unit length each, below which there is no direction of its own,
# relative to the largest.
DIRECTION = 1e-3
LEVEL = 1e-3  # chance, over all joints and both tests, at which a mismatch is called significant


@dataclass(frozen=True, eq=False)
class LackOfFit:
    """What is left."""

    omnibus: Array  # (n,), p-value; 1 where the test could not be made
    pure_error: Array  # (n,), the same
    excess: Array  # (n,), Σ r² beyond the noise's, in noise variances, never negative
    # (n,), the excess from which it exceeds what the noise's own power is uncertain by [noise variances]
    measurable: Array

    @property
    def significant(self) -> list[bool]:
        """Per joint, whether more than noise is left."""
        level = _level(len(self.omnibus))
        return [bool(min(a, b) < level) for a, b in zip(self.omnibus, self.pure_error, strict=True)]

    @property
    def mismatch(self) -> list[bool]:
        """Per joint, whether it is significant and an excess that can be measured: less is nothing to look for."""
        pairs = zip(self.significant, self.excess, self.measurable, strict=True)
        return [significant and bool(excess > least) for significant, excess, least in pairs]


def lack_of_fit(
    fit: Fit, observations: Observations, dependence: Sequence[float] | None = None, *, pure_error: bool
) -> LackOfFit:
    """Test what a model leaves. `dependence`: number of rows of each joint that count as one; None where each does."""
    joints = observations.robot.joint_count
    pure = np.ones(joints)
    excess, measurable = np.zeros(joints), np.zeros(joints)
    rows = sum(own.share * len(row) for own, row in zip(observations.noise, fit.projection.residual, strict=True))
    share = fit.projection.spread.shape[1] / max(rows, 1.0)
    repeated = pure_error_rows(observations)
    freedoms = [
        observations.independent_rows(joint, residual) * (1.0 - share)
        for joint, residual in enumerate(fit.projection.residual)
    ]
    independent = [freedom / rows for freedom, rows in zip(freedoms, dependence or [1.0] * joints, strict=True)]
    omnibus = side_by_side(lambda joint: _omnibus(fit, observations, joint, independent[joint]), range(joints))
    for joint, residual in enumerate(fit.projection.residual):
        freedom = freedoms[joint]
        energy = float(residual @ residual)
        excess[joint] = max(energy - freedom, 0.0)
        if pure_error and repeated[joint] > 0:  # else the same rows say what noise is: any excess
            measurable[joint] = MEASURABLE * np.sqrt(2.0 * freedom * (1.0 + freedom / repeated[joint]))
        means = freedom - repeated[joint]
        if pure_error and repeated[joint] > 0 and means > 1.0:
            ratio = max(energy - repeated[joint], 0.0) / means
            pure[joint] = float(stats.f.sf(ratio, means, repeated[joint]))
    return LackOfFit(np.array(omnibus), pure, excess, measurable)


def pure_error_rows(observations: Observations) -> Array:
    """Degrees of freedom of what differs between repetitions, (n,)."""
    found = np.zeros(observations.robot.joint_count)
    for piece in observations:
        number, motion = piece.prepared.recording, piece.prepared.motion
        runs = observations.repetitions[number] if 0 <= number < len(observations.repetitions) else ()
        end = float(piece.time[0, -1])
        for run in runs:
            first = max(run.start_s, float(piece.time[0, 0]))
            last = min(run.start_s + run.count * run.length_s, end) - run.length_s
            found += max(last - first, 0.0) * motion.band.rate_hz
    return found * np.array([noise.share for noise in observations.noise])


def _level(joints: int) -> float:
    """Chance at which one test at one joint is called significant."""
    return LEVEL / (2 * joints)


def _omnibus(fit: Fit, observations: Observations, joint: int, freedom: float) -> float:
    """p-value of the omnibus test of one joint."""
    rows = [_reduced_features(piece, joint, observations) for piece in observations]
    white = observations.white(joint, rows)
    basis = fit.projection.basis[joint]
    return _f_test(white - (white @ basis.T) @ basis, fit.projection.residual[joint], freedom)


def _f_test(columns: Array, residual: Array, freedom: float) -> float:
    """p-value of the residual's energy in the columns' span against the rest."""
    scale = np.linalg.norm(columns, axis=1)
    columns = columns[scale > 1e-9 * max(float(scale.max(initial=0.0)), 1e-300)]
    if not len(columns):
        return 1.0
    unit = columns / np.linalg.norm(columns, axis=1)[:, None]
    energies, axes = np.linalg.eigh(unit @ unit.T)
    known = energies > DIRECTION**2 * energies[-1]
    count = int(known.sum())
    inside = float(np.sum((axes[:, known].T @ (unit @ residual)) ** 2 / energies[known]))
    rest = float(residual @ residual) - inside
    freedom -= count
    if freedom < count or rest <= 0.0:
        return 1.0
    return float(stats.f.sf(inside / count / (rest / freedom), count, freedom))


def _reduced_features(piece: Piece, joint: int, observations: Observations) -> Array:
    """The features in the common band, (k, P M): the same whatever the model and the noise, and made once."""
    key = f"features of joint {joint}"
    if key not in piece.memory:
        piece.memory[key] = piece.reduced(_features(piece, joint, observations))
    return piece.memory[key]


def _features(piece: Piece, joint: int, observations: Observations) -> Array:
    """Smooth functions of state and time at the recorded rate, (k, P, N)."""
    motion = piece.prepared.motion
    rng = np.random.default_rng([0, joint])
    states = np.concatenate([motion.position, motion.velocity], axis=1)
    reach = np.maximum(_reach(observations), 1e-12)
    count = observations.robot.joint_count
    weight = 0.5 * rng.standard_normal((FEATURES, 2 * count)) * (rng.random((FEATURES, 2 * count)) < 1.5 / count)
    own = (joint, count + joint)
    weight[:, own] = 1.5 * rng.standard_normal((FEATURES, 2))
    phase = rng.uniform(0.0, 2.0 * np.pi, FEATURES)
    waves = np.cos((weight / reach) @ states.T + phase[:, None])
    of_state = np.repeat(waves[:, None], piece.repetitions, axis=1)
    ends = [float(each.time.max()) for each in observations if each.prepared.recording == piece.prepared.recording]
    recordings = sorted({each.prepared.recording for each in observations})
    hats = np.zeros((HATS * len(recordings), *piece.time.shape))
    place = recordings.index(piece.prepared.recording) * HATS
    at = piece.time / max(1e-9, *ends) * (HATS - 1)
    for number in range(HATS):
        hats[place + number] = np.maximum(1.0 - np.abs(at - number), 0.0)
    return np.concatenate([of_state, hats])


def _reach(observations: Observations) -> Array:
    """Standard deviation of every joint's position and velocity, (2 n,)."""
    motions = [piece.prepared.motion for piece in observations]
    position = np.concatenate([motion.position for motion in motions]).std(axis=0)
    velocity = np.concatenate([motion.velocity for motion in motions]).std(axis=0)
    return np.concatenate([position, velocity])


def without_spilled(misfit: LackOfFit, fit: Fit, fitter: Fitter, *, pure_error: bool) -> LackOfFit:
    """A lack of fit whose joints answer for their own misfit only: they share the links, whose parameters it bends.

    A least-squares fit spreads what is wrong at one joint over every torque that the same masses make. The joint at
    which most is left is believed to be wrong itself. Fitted without its rows, nothing bends the links for it; what is
    then still left at another joint is that one's own, and the largest of these is left out next, until no more than
    noise is left at those that remain.
    """
    apart, suspects, wrong = misfit, _significant(misfit), set[int]()
    if len(suspects) < 2:
        return misfit
    while suspects:
        wrong.add(max(suspects, key=lambda joint: apart.excess[joint]))
        rows = fitter.observations.without_joints(wrong)
        apart = lack_of_fit(Fitter(rows).projected(fit.model), rows, pure_error=pure_error)
        suspects = (_significant(apart) & _significant(misfit)) - wrong
    spilled = np.isin(np.arange(len(misfit.excess)), list(_significant(misfit) - wrong))
    tests = ("omnibus", "pure_error", "excess")
    own = {name: np.where(spilled, getattr(apart, name), getattr(misfit, name)) for name in tests}
    return replace(misfit, **own)


def _significant(misfit: LackOfFit) -> set[int]:
    """Joints at which more than noise is left."""
    return {joint for joint, told in enumerate(misfit.significant) if told}
