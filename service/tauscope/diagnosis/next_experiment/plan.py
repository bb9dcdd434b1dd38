"""Choose the motion that separates what a diagnosis cannot tell apart, or shows what the recordings hid."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from tauscope.diagnosis.findings.diagnosed import Diagnosis
from tauscope.diagnosis.findings.verdict import OPEN
from tauscope.diagnosis.model.extended import ExtendedModel, with_terms
from tauscope.diagnosis.next_experiment.bank import KINDS, Bank, Primitive
from tauscope.diagnosis.next_experiment.separation import equations, log_variances, played, separations
from tauscope.errors import ExcitationError
from tauscope.recording.recording import Array
from tauscope.trajectory import Trajectory

FIRST_LOOK = 4  # Fourier series of every kind at the first look
SECOND_LOOK = 8  # …and further ones of the best kind
# Separation λ that is aimed at, in variances of what is left. With 27, the difference of two scores, which varies by 2
# √λ, exceeds with a chance of 95 % the 10 (`EQUIVALENT`) within which explanations are not told apart; noise of the
# velocities takes some of it.
SETTLING = 40.0
LONGEST_S = 300.0  # no motion is repeated beyond this [s]
MOST_OPTIONS = 4  # explanations that are told apart, the likeliest ones


@dataclass(frozen=True, eq=False)
class PlannedExperiment:
    """The next motion."""

    trajectory: Trajectory
    kind: str
    # effects and places that it tells apart; empty where it is to show more of everything
    separates: tuple[tuple[str, int | None], ...]
    before: float
    after: float

    @property
    def words(self) -> str:
        """What it is and what it does."""
        if self.separates:
            return f"{self.kind}: explanations {self.before:.3g} standard errors apart come {self.after:.3g} apart"
        return f"{self.kind}: standard errors fall by a factor of {np.exp(self.before - self.after):.3g} on average"


def is_wanted(diagnosis: Diagnosis) -> bool:
    """Whether anything is open that a motion decides."""
    return diagnosis.verdict in OPEN or any(finding.alternatives for finding in diagnosis.findings)


def plan_experiment(diagnosis: Diagnosis, progress: Callable[[str], None] = lambda step: None) -> PlannedExperiment:
    """Plan the recording to make next. Raises ExcitationError where the arm's limits allow no motion."""
    progress("plan the next experiment")
    judge = _judge(diagnosis)
    bank = Bank(diagnosis.identification, np.random.default_rng(0))
    nominal = with_terms(diagnosis.selection.fit.model, ())

    def judged(primitive: Primitive) -> _Judged:
        rows = played(primitive.trajectory, diagnosis.fitter.observations, nominal, diagnosis.cutoff_hz)
        added = tuple(equations(each.model, rows, each.others, each.absent) for each in judge.tasks)
        return _Judged(primitive, added, judge.value(added))

    # What no explanation is known of may be anywhere that the recordings have not been.
    offered = bank.first_look(FIRST_LOOK) if judge.separates else bank.everywhere(FIRST_LOOK)
    seen = [judged(primitive) for primitive in offered]
    if not seen:
        raise ExcitationError("no motion keeps the arm's limits; widen them in the robot file")
    best = max(seen, key=lambda each: each.value)
    if judge.separates and best.primitive.kind in KINDS:
        seen += [judged(primitive) for primitive in bank.fourier(best.primitive.kind, SECOND_LOOK)]
    best = max(seen, key=lambda each: each.value)
    chosen = best.primitive.trajectory
    times = judge.times_wanted(best, max(1, int(LONGEST_S / chosen.duration_s)))
    trajectory = replace(chosen, segments=chosen.segments * times)  # all end where they begin
    before, after = judge.value(None), judge.value(best.added, times)
    kind = best.primitive.kind if times == 1 else f"{best.primitive.kind}, {times} times"
    return PlannedExperiment(trajectory, kind, judge.separates, judge.readable(before), judge.readable(after))


def planned_experiment(
    diagnosis: Diagnosis, progress: Callable[[str], None] = lambda step: None, *, asked: bool = False
) -> PlannedExperiment | None:
    """The recording to make next, if any. Raises ExcitationError if one is `asked` for and the limits allow none."""
    if not asked and not is_wanted(diagnosis):
        return None
    try:
        return plan_experiment(diagnosis, progress)
    except ExcitationError:
        if asked:
            raise
        return None


@dataclass(frozen=True, eq=False)
class _Judged:
    """A motion, what it adds to the tasks of the judge, and its worth when it is played once."""

    primitive: Primitive
    added: tuple[Array, ...]
    value: float


@dataclass(frozen=True, eq=False)
class _Task:
    """A model whose columns are asked for, others beside it, and the nominal parameter that it does not have."""

    model: ExtendedModel
    others: tuple[ExtendedModel, ...] = ()
    absent: int | None = None


@dataclass(frozen=True, eq=False)
class _Judge:
    """What a motion is worth beside the recordings that there are."""

    separates: tuple[tuple[str, int | None], ...]  # what is told apart
    tasks: tuple[_Task, ...]
    known: tuple[Array, ...]  # tuple of (r, p + o), the same of the recordings
    wanted: Array  # (k,), parameters that are to be known better
    inflation: float

    def value(self, added: Sequence[Array] | None, times: int = 1) -> float:
        """Larger is better: the smallest λ, or the information about what is wanted, with a motion played so often."""
        stacked = list(self.known)
        if added is not None:
            repeated = [np.sqrt(times) * rows for rows in added]  # as many equal rows count as one, so much larger
            stacked = [np.concatenate(pair) for pair in zip(self.known, repeated, strict=True)]
        if self.separates:
            pairs = zip(self.tasks, stacked, strict=True)
            return min(float(separations(each.model, rows).min()) for each, rows in pairs)
        return -float(log_variances(self.tasks[0].model, stacked[0])[self.wanted.astype(int)].mean())

    def times_wanted(self, motion: _Judged, most: int) -> int:
        """How often a motion is played: λ grows with its rows, and `SETTLING` of it is wanted."""
        if not self.separates or motion.value <= self.value(None):
            return 1
        settling = (each for each in range(1, most) if self.value(motion.added, each) >= SETTLING * self.inflation)
        return next(settling, most)

    def readable(self, value: float) -> float:
        """Standard errors, or the logarithm of one."""
        return float(np.sqrt(value)) if self.separates else -0.5 * value


def _judge(diagnosis: Diagnosis) -> _Judge:
    """Separation where a finding has equivalents; else information about what moved, or about everything."""
    final = diagnosis.selection.fit.model
    for finding in diagnosis.findings:
        if finding.alternatives:
            options = finding.alternatives[: MOST_OPTIONS - 1]
            places = (finding.place, *((each.term.effect.id, each.term.effect.joint) for each in options))
            models = ((final, None), *((each.model, each.absent) for each in options))
            tasks = tuple(
                _Task(model, tuple(other for other, _ in models if other is not model), absent)
                for model, absent in models
            )
            known = tuple(equations(each.model, diagnosis.fitter, each.others, each.absent) for each in tasks)
            return _Judge(places, tasks, known, np.zeros(0), diagnosis.inflation)
    moved = sorted({move.parameter for move in diagnosis.constancy.moves})
    wanted = np.array(moved or range(final.structure.size), dtype=float)
    return _Judge((), (_Task(final),), (equations(final, diagnosis.fitter),), wanted, diagnosis.inflation)
