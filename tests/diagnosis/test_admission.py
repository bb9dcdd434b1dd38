"""What is asked of an effect before it may enter a model."""

from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from tauscope.diagnosis.selection.admission import Admission


@pytest.mark.parametrize(("gain", "pure_error", "fitted"), [(0.9, False, False), (1.1, False, True), (0.9, True, True)])
def test_what_is_too_small_by_far_is_not_fitted_where_the_noise_is_only_guessed(
    gain: float, pure_error: bool, fitted: bool
) -> None:
    """A hundredth of the 300 that are left at its joints is needed, and a fit may treble what the grid explains."""
    fit = SimpleNamespace(projection=SimpleNamespace(residual=[np.ones(100), np.ones(200), np.ones(4000)]))
    candidate = SimpleNamespace(gain=gain, effect=SimpleNamespace(touched=lambda count: (0, 1)))
    admission = Admission(cast(Any, None), pure_error=pure_error)
    assert admission.may_be_large_enough(cast(Any, candidate), cast(Any, fit)) is fitted


@pytest.mark.parametrize(("std", "correlation", "expected"), [(0.2, 0.0, True), (0.4, 0.0, False), (0.4, -0.9, True)])
def test_a_coefficient_that_its_shape_leaves_open_is_not_determined(
    std: float, correlation: float, expected: bool
) -> None:
    """(1, 1) with a common standard error: z² = 2 / (s² (1 + ρ)); what other parameters add is not asked."""
    covariance = np.eye(4)
    covariance[1:3, 1:3] = std**2 * np.array([[1.0, correlation], [correlation, 1.0]])
    term = SimpleNamespace(coefficients=np.ones(2))
    model = SimpleNamespace(terms=(term,), term_places=lambda: [slice(1, 4)])
    fit = SimpleNamespace(model=model, inflation=lambda at_least: 1.0)
    # z is 7.1, 3.54 less a little, and 11.2
    fitter = SimpleNamespace(covariance=lambda _: covariance * (1.0 if expected else 1.1))
    admission = Admission(cast(Any, None), pure_error=True)
    assert admission.determined(cast(Any, fit), cast(Any, fitter)) is expected
