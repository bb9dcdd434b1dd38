"""When held-out recordings confirm a finding."""

import numpy as np
import pytest
from scipy import stats

from tauscope.diagnosis.fitting.prediction import log_likelihood
from tauscope.diagnosis.fitting.projection import JointColumns
from tauscope.diagnosis.selection.confirmation import Confirmation, likeness
from tauscope.recording.recording import Array


@pytest.mark.parametrize(
    ("gain", "gain_z", "expected_z", "seen_z", "favour", "confirmed"),
    [
        (60.0, 3.0, 8.0, 7.0, 25.0, True),  # predicts better, and is there again
        (200.0, 3.4, 3.6, 1.2, -1.0, True),  # predicts so well that too little to estimate it anew does not matter
        (-6.0, -0.7, 2.9, 2.1, -1.0, False),  # expected there, and less likely with it
        (5.0, 1.0, 6.0, 0.3, -12.0, False),  # should be there, and is not
        (-2.0, -0.5, 0.5, -0.2, -0.3, True),  # nothing to be seen: no find_objection
        (-9.0, -4.0, 0.5, -0.2, 1.0, False),  # nothing to be seen, and yet it spoils the prediction
        (-80.8, -1.7, 0.5, -0.5, -7.5, False),  # nothing of it to be seen, and much else less likely
        (-4.0, -1.0, 20.0, 19.0, -2.0, True),  # there beyond doubt: its size is off
        (-39.5, -2.0, 3.8, 2.7, 2.2, True),  # the point predicts worse, and by no more than it is uncertain
        (-2.3, -0.1, 4.6, 3.4, 1.0, True),  # seen as large as it should be; that the point is no better is chance
        (2.8, 0.2, 2.9, -1.1, 0.5, False),  # a little likelier, and seen with the wrong sign
        (-121.0, -1.5, 4.3, 1.4, 10.6, False),  # much likelier by way of other parameters, and not its own size
        (-90.0, -5.0, 20.0, 19.0, 1.0, False),  # …but not where it clearly spoils the prediction
    ],
)
def test_what_is_confirmed(
    gain: float, gain_z: float, expected_z: float, seen_z: float, favour: float, confirmed: bool
) -> None:
    assert Confirmation(gain, gain_z, expected_z, seen_z, favour).confirmed(cautious=False) is confirmed


@pytest.mark.parametrize(("chance", "favour", "confirmed"), [
    (0.5, -1.0, False),  # training hardly asks for it
    (1e-2, -1.0, True),  # training does: that held-out motion is a little less likely with it is chance
    (1e-2, -3.5, False),  # much less likely
    (0.0, -3.5, False),  # whatever training says
    (0.0, -2.5, True),
])  # fmt: skip
def test_the_more_training_says_the_clearer_held_out_motion_has_to_speak(
    chance: float, favour: float, confirmed: bool
) -> None:
    seen = Confirmation(gain=-6.0, gain_z=-0.7, expected_z=2.9, seen_z=1.0, favour=favour)
    assert seen.confirmed(cautious=False, chance=chance) is confirmed


def test_where_noise_is_a_guess_more_is_asked() -> None:
    weak = Confirmation(gain=3.0, gain_z=0.5, expected_z=2.0, seen_z=1.2, favour=0.1)
    assert weak.confirmed(cautious=False)
    assert not weak.confirmed(cautious=True)


class _Linear:
    """Stands in for a fitter and a model: rows whose residual and columns are given."""

    def __init__(self, residual: Array, columns: Array) -> None:
        self.size = len(columns)
        self._residual, self._columns = residual, columns

    def white_residual(self, model: "_Linear") -> list[Array]:
        return [self._residual]

    def columns(self, model: "_Linear") -> list[JointColumns]:
        return [JointColumns(np.arange(self.size), self._columns)]


def test_the_predictive_density_is_that_of_noise_and_uncertain_parameters() -> None:
    """Against the normal density with covariance 1 + J Σ Jᵀ; the constant by a model without parameters."""
    rng = np.random.default_rng(5)
    columns, residual, root = rng.normal(size=(3, 40)), rng.normal(size=40), rng.normal(size=(3, 3))
    covariance = root @ root.T
    covariance[:, 2] = covariance[2] = 0.0  # known exactly
    rows = _Linear(residual, columns)
    found = log_likelihood(rows, covariance, rows)  # pyright: ignore[reportArgumentType]
    whole = stats.multivariate_normal.logpdf(residual, cov=np.eye(40) + columns.T @ covariance @ columns)
    assert found == pytest.approx(whole + 20.0 * np.log(2.0 * np.pi), rel=1e-9)


def test_likeness_is_the_logarithm_of_a_likelihood_ratio() -> None:
    """An estimate z of unit variance, E[z] if it is there and 0 if not: log φ(z - E) - log φ(z)."""
    assert likeness(3.0, 2.2) == pytest.approx(stats.norm.logpdf(2.2, loc=3.0) - stats.norm.logpdf(2.2))
