"""What a hypothesis leaves, under the noise that it finds."""

from tauscope.diagnosis.evidence.rows import weigh_rows
from tauscope.diagnosis.fitting.fit import Fit, Fitter
from tauscope.diagnosis.fitting.lack_of_fit import LackOfFit, lack_of_fit
from tauscope.diagnosis.fitting.regressor_noise import shared_errors
from tauscope.diagnosis.observations.observations import Observations
from tauscope.diagnosis.observations.row_weighting import RowWeighting
from tauscope.diagnosis.search.hypothesis import Hypothesis


def is_left(at: Hypothesis, rows: Observations, *, pure_error: bool) -> bool:
    """Whether a hypothesis leaves more than noise at any joint."""
    rows = rows_under(at, rows, pure_error=pure_error)
    return any(measure_lack(Fitter(rows).projected(at.model), at, rows, pure_error=pure_error).significant)


def measure_lack(fit: Fit, at: Hypothesis, rows: Observations, *, pure_error: bool) -> LackOfFit:
    """Lack of fit at every joint; without repetitions, rows are as dependent as the hypothesis says."""
    return lack_of_fit(fit, rows, None if pure_error else at.dependence, pure_error=pure_error)


def rows_under(at: Hypothesis, rows: Observations, *, pure_error: bool) -> Observations:
    """Rows with the noise that a hypothesis finds, unless repetitions tell it, and as much as they tell."""
    if pure_error:
        return weigh(rows, at)
    pairs = zip(rows.noise, at.scales, strict=True)
    return weigh(rows.with_noise([own.times(scales.noise) for own, scales in pairs]), at)


def weigh(rows: Observations, at: Hypothesis) -> Observations:
    """Rows as much as they tell by a hypothesis' friction."""
    weightings = []
    for joint in range(len(rows.noise)):
        weights = weigh_rows(rows, at.model, joint)
        weightings.append(RowWeighting.of(weights, shared_errors(rows, at.model, joint, weights)))
    return rows.with_weightings(weightings)
