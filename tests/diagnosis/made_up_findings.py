"""Findings made by hand, and the little of a diagnosis that words are made of."""

from collections.abc import Sequence
from types import SimpleNamespace
from typing import Any, cast

import numpy as np

from effects.piece_of_motion import context
from tauscope.diagnosis import Diagnosis, Finding
from tauscope.diagnosis.findings.finding import FitSizes
from tauscope.diagnosis.fitting.lack_of_fit import LackOfFit
from tauscope.diagnosis.model.term import Term
from tauscope.effects import Effect

JOINTS = 6
NAMES = [joint.name for joint in context().robot.joints]
STRETCHES = 24


def form(kind: type[Effect], joint: int | None = 1, **settings: Any) -> Effect:
    """An effect without a grid."""
    count = len(kind.shapes)
    return kind(joint, np.zeros((1, count)), np.zeros(count), np.ones(count), **settings)


def sizes(rms: Sequence[float], rng: np.random.Generator | None = None) -> FitSizes:
    """Residuals, the same on training and held-out motion; no held-out motion without a generator."""
    train = np.array(rms, dtype=float)
    if rng is None:
        return FitSizes(train, None)
    spread = 1.0 + 0.01 * rng.standard_normal((len(rms), STRETCHES))
    return FitSizes(train, train, train[:, None] ** 2 * spread)


def finding(
    effect: Effect,
    coefficients: Sequence[float],
    shape: Sequence[float] = (),
    *,
    before: Sequence[float] = (2.0,) * JOINTS,
    after: Sequence[float] = (1.0,) * JOINTS,
    rng: np.random.Generator | None = None,
    **more: Any,
) -> Finding:
    """A finding whose parameters have standard errors of a hundredth."""
    count = len(coefficients) + len(shape)
    told: dict[str, Any] = {
        "terms": (Term(effect, np.array(shape, dtype=float), np.array(coefficients, dtype=float)),),
        "covariances": (1e-4 * np.eye(count),),
        "gain": 100.0,
        "probability": 0.58,
        "before": sizes(before, rng),
        "after": sizes(after, rng),
    }
    return Finding(**{**told, **more})


def rival(effect: Effect) -> Any:
    """What explains nearly as much."""
    return SimpleNamespace(term=Term(effect, np.zeros(len(effect.shapes)), np.zeros(len(effect.coefficients))))


def words_of(*findings: Finding) -> Diagnosis:
    """The parts of a diagnosis that statements are made of."""
    model = SimpleNamespace(terms=(), factor=lambda _: 1.0)
    observations = SimpleNamespace(names=("motion.csv",))
    parts: dict[str, Any] = {
        "robot": context().robot,
        "setting": context(),
        "fitter": SimpleNamespace(observations=observations),
        "selection": SimpleNamespace(fit=SimpleNamespace(model=model)),
        "findings": findings,
        "misfit_after": LackOfFit(np.ones(JOINTS), np.ones(JOINTS), np.zeros(JOINTS), np.ones(JOINTS)),
    }
    return cast("Diagnosis", SimpleNamespace(**parts))
