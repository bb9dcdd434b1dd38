"""Compliance and play of every transmission with an encoder on its link.

    q - q_link = c τ_rb + b/2 sgn(τ_rb) + n

with c the compliance, b the play, and n what mounting and wiring of two encoders add: an offset, eccentricity
e_1 sin q + e_2 cos q, a delay between the two, Δt q̇, friction behind the transmission that winds it up, f sgn(q̇), and
a rotor that the fit counts among the link, -c J q̈. By Huber's regression with c and b not below zero; standard errors
by stretches of motion, as errors of neighbouring rows are alike.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tauscope.diagnosis.deflection.link_side import LinkRows, link_rows
from tauscope.diagnosis.model.extended import ExtendedModel
from tauscope.diagnosis.model.term import Term
from tauscope.effects import ArmContext
from tauscope.effects.measured_deflection import MeasuredElasticity, MeasuredPlay, MeasuredTeeth
from tauscope.identification import Identification
from tauscope.recording import Recording
from tauscope.recording.samples import Array
from tauscope.robot import JointType

# Believed spread of an encoder's error over a turn [rad], or over a metre [m]: 0.05 mm off centre at a radius of 50 mm.
ECCENTRICITY = 1e-3
DELAY_S = 5e-3  # believed spread of the delay between two encoders of a joint [s]: some cycles of a bus
# Believed spread of the rotor's part in the inertia that a fit gives the link: motion alone cannot tell the two.
ROTOR_SHARE = 0.3
# What the load errs by, relative to its size, beyond its parameters' covariance: the fit takes the transmission for
# rigid. On simulated arms compliance and play are 0.2 to 4 % off.
LOAD_ERROR = 0.03
# Length of a stretch over which errors are alike [s]: friction, ripple and load errors keep their sign in it.
STRETCH_S = 1.0
FEWEST_STRETCHES = 8  # stretches from which a standard error means anything
# Mean side within the filter's kernel from which the teeth touch on one side: else the link may be in flight.
SETTLED = 0.9
FEWEST_REVERSALS = 3  # stretches on either side of the teeth from which play is told from the encoders' offset
HUBER = 1.5  # residual from which a row counts less [standard deviations]: 96 % efficient under Gaussian noise
MAD = 1.4826  # standard deviation over the median of magnitudes, of Gaussian noise
ROUNDS = 12  # rounds of reweighting: they converge by a factor of two or more each
CERTAIN = 5.0  # standard errors from which a deflection is there: one of a million joints shows so much by chance
# Deflection over the encoders' resolution from which it is no error of theirs: motion averages within a count, but not
# what repeats with the angle.
RESOLVED = 0.3


@dataclass(frozen=True)
class MeasuredDeflection:
    """What the encoder on a link says of its transmission."""

    joint: int
    compliance: float  # c [rad/Nm or m/N]
    compliance_std: float  # of c
    # standard error of c as far as it decides whether there is any: what scales with c does not
    compliance_noise: float
    play: float  # b [rad or m]
    play_std: float  # of b; infinite where the load does not change its side often enough
    largest_load: float  # largest torque that was transmitted [Nm or N]
    resolution: float  # step or noise of the encoders: less is theirs and not the transmission's [rad or m]

    @property
    def least_compliance(self) -> float:
        """Compliance above which the transmission certainly gives way [rad/Nm or m/N]."""
        return max(CERTAIN * self.compliance_noise, RESOLVED * self.resolution / self.largest_load)

    @property
    def least_play(self) -> float:
        """Play above which there certainly is lost motion [rad or m]."""
        return max(CERTAIN * self.play_std, RESOLVED * self.resolution)

    @property
    def is_open(self) -> bool:
        """Whether the encoders show a deflection that may be their own error."""
        by_load = self.compliance > CERTAIN * self.compliance_noise and not self.is_compliant
        return by_load or (self.play > CERTAIN * self.play_std and not self.has_play)

    @property
    def largest_wind_up(self) -> float:
        """Deflection by compliance under the largest load [rad or m]."""
        return self.compliance * self.largest_load

    @property
    def is_compliant(self) -> bool:
        """Whether the transmission certainly gives way."""
        return self.compliance > self.least_compliance

    @property
    def has_play(self) -> bool:
        """Whether there certainly is lost motion."""
        return self.play > self.least_play


def measure_deflection(
    recordings: Sequence[Recording], identification: Identification, model: ExtendedModel, cutoff_hz: float | None
) -> tuple[MeasuredDeflection, ...]:
    """Compliance and play of every joint that has an encoder on its link; the nominal model tells the load."""
    rows: dict[int, list[LinkRows]] = {}
    for number, recording in enumerate(recordings):
        for joint, found in link_rows(recording, number, model, cutoff_hz):
            rows.setdefault(joint, []).append(found)
    count = model.structure.base_count
    covariance = identification.covariance[:count, :count]
    found = [_measure_joint(joint, own, model, covariance) for joint, own in sorted(rows.items())]
    return tuple(each for each in found if each is not None)


def _measure_joint(
    joint: int, pieces: Sequence[LinkRows], model: ExtendedModel, covariance: Array
) -> MeasuredDeflection | None:
    """What the rows of one joint say; None where they are too few, or where nothing loads the joint."""
    structure = model.structure
    is_revolute = structure.robot.joints[joint].type is JointType.REVOLUTE
    columns, spreads = _columns(pieces, is_revolute=is_revolute)
    stretch = _number_stretches(pieces)
    clear = np.abs(np.concatenate([piece.side for piece in pieces])) > SETTLED
    _, stretch = np.unique(stretch[clear], return_inverse=True)
    load = np.concatenate([piece.load for piece in pieces])
    if not stretch.size or stretch.max() + 1 < FEWEST_STRETCHES or not load.any():
        return None
    columns, deflection = columns[clear], np.concatenate([piece.deflection for piece in pieces])[clear]
    reverses = _reverses(pieces)
    if not reverses:  # then the teeth's side is part of the encoders' offset
        columns[:, 1], spreads[1] = 0.0, 1.0
    first = _regress(columns, deflection, spreads, stretch)
    impossible = first.values[:2] < 0.0
    columns[:, :2] *= ~impossible
    spreads[:2][impossible] = 1.0
    acceleration = np.concatenate([piece.acceleration for piece in pieces])[clear]
    deflection -= 0.5 * float(first.values[2]) ** 2 * acceleration  # the delay's second order looks like a load
    noise = float(np.sqrt(first.covariance[0, 0]))
    spread = ROTOR_SHARE * max(float(first.values[0]), noise)
    columns = np.column_stack([columns, pieces[0].inertia * acceleration])
    found = _regress(columns, deflection, np.append(spreads, spread), stretch)
    rigid = np.concatenate([piece.rigid for piece in pieces], axis=1)[:, clear]
    places = structure.joint_columns(joint)[: len(rigid)]
    compliance, play = np.where(impossible, 0.0, found.values[:2]).tolist()
    by_load = compliance * (found.solver[:2] @ rigid.T)
    variances = np.diag(found.covariance[:2, :2] + by_load @ covariance[np.ix_(places, places)] @ by_load.T)
    variances = np.where(impossible, np.diag(first.covariance)[:2], variances)
    wind_up = compliance * float(np.sqrt(np.mean(load**2)))
    return MeasuredDeflection(
        joint=joint,
        compliance=compliance,
        compliance_std=float(np.hypot(np.sqrt(variances[0]), LOAD_ERROR * compliance)),
        compliance_noise=noise,
        play=play,
        play_std=float(np.sqrt(variances[1] + LOAD_ERROR**2 * (play**2 + wind_up**2))) if reverses else np.inf,
        largest_load=float(np.abs(load).max()),
        resolution=max(piece.resolution for piece in pieces),
    )


def _number_stretches(pieces: Sequence[LinkRows]) -> NDArray[np.intp]:
    """Number of the stretch that each row of all pieces belongs to, (M,)."""
    numbers, count = [], 0
    for piece in pieces:
        numbers.append(count + piece.stretches(STRETCH_S))
        count = int(numbers[-1].max(initial=count)) + 1
    return np.concatenate(numbers)


def _reverses(pieces: Sequence[LinkRows]) -> bool:
    """Whether the load presses on both sides of the teeth for some stretches of one recording."""
    count: dict[tuple[int, bool], int] = {}
    for piece in pieces:
        for is_ahead in (True, False):
            pressed = piece.side > SETTLED if is_ahead else piece.side < -SETTLED
            key = piece.recording, is_ahead
            count[key] = count.get(key, 0) + len(np.unique(piece.stretches(STRETCH_S)[pressed]))
    return any(min(count[number, True], count[number, False]) >= FEWEST_REVERSALS for number, _ in count)


def _columns(pieces: Sequence[LinkRows], *, is_revolute: bool) -> tuple[Array, Array]:
    """Columns of the regression (M, k), load, side and velocity first, and what is believed of their spread, (k,)."""
    recordings = sorted({piece.recording for piece in pieces})
    parts = []
    for piece in pieces:
        offsets = np.tile([float(piece.recording == each) for each in recordings], (len(piece.load), 1))
        turn = [np.sin(piece.position), np.cos(piece.position)] if is_revolute else [piece.position]
        parts.append(np.column_stack([piece.load, 0.5 * piece.side, piece.velocity, piece.direction, offsets, *turn]))
    free = np.full(1 + len(recordings), np.inf)
    turns = np.full(2 if is_revolute else 1, ECCENTRICITY)
    return np.concatenate(parts), np.concatenate([[np.inf, np.inf, DELAY_S], free, turns])


@dataclass(frozen=True, eq=False)
class _Regression:
    """A robust fit."""

    values: Array  # (k,), coefficients
    covariance: Array  # (k, k), of the coefficients, from the scores of stretches
    solver: Array  # (k, M), change of the coefficients for a change of each row


def _regress(columns: Array, rows: Array, spreads: Array, stretch: NDArray[np.intp]) -> _Regression:
    """Huber's regression.

    `columns`: (M, k), of the regression; `rows`: (M,), what they explain; `spreads`: (k,), standard deviations believed
    of the coefficients; `stretch`: (M,), number of the stretch that each row belongs to.
    """
    prior, tiny = np.diag(spreads**-2.0), np.finfo(float).tiny
    weights, variance = np.ones(len(rows)), max(float(rows.var()), tiny)
    for _ in range(ROUNDS):
        weighted = (weights / variance)[:, None] * columns
        gram = columns.T @ weighted + prior
        unit = np.sqrt(np.maximum(np.diag(gram), tiny))
        inverse = np.linalg.pinv(gram / np.outer(unit, unit), hermitian=True) / np.outer(unit, unit)
        values = inverse @ (weighted.T @ rows)
        left = np.abs(rows - columns @ values)
        weights = np.minimum(1.0, HUBER * MAD * float(np.median(left)) / np.maximum(left, tiny))
        variance = max(float(np.average(left**2, weights=weights)), tiny)
    scores = np.zeros((stretch.max() + 1, columns.shape[1]))
    np.add.at(scores, stretch, weighted * (rows - columns @ values)[:, None])
    spread = scores.T @ scores * len(scores) / (len(scores) - 1) + prior
    return _Regression(values, inverse @ spread @ inverse, inverse @ weighted.T)


@dataclass(frozen=True, eq=False)
class DirectTerm:
    """A deflection that is certain."""

    term: Term
    value: float  # of its coefficient [rad/Nm, rad, m/N or m]
    std: float

    @property
    def joint(self) -> int:
        """Index, from 0."""
        return self.term.effect.joint or 0


def direct_terms(measured: Sequence[MeasuredDeflection], setting: ArmContext) -> list[DirectTerm]:
    """Terms of all that is certain; compliance beside play where it moves the link by more than that."""
    found = []
    for each in measured:
        compliance, play = np.array([each.compliance, each.compliance_std]), np.array([each.play, each.play_std])
        if each.has_play:
            can_swing = each.is_compliant and setting.inertia[each.joint] > 0.0
            teeth = MeasuredTeeth.of(setting, each.joint, play, compliance) if can_swing else None
            effect = teeth or MeasuredPlay.of(setting, each.joint, *play.tolist())
            found.append((effect, play))
        if each.is_compliant and not (each.has_play and each.play > each.largest_wind_up):
            found.append((MeasuredElasticity.of(setting, each.joint, *compliance.tolist()), compliance))
    return [DirectTerm(Term(effect, effect.grid[0], size[:1]), *size.tolist()) for effect, size in found]
