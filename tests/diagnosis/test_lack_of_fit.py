"""What counts as a mismatch: a test alone, or an excess that can be measured as well."""

import numpy as np

from service.diagnosis.lack_of_fit import LackOfFit


def test_a_test_that_fires_without_any_excess_is_no_mismatch() -> None:
    unlikely, likely = np.array([1e-9, 1e-9, 1e-9, 0.5]), np.ones(4)
    found = LackOfFit(unlikely, likely, np.array([0.0, 40.0, 90.0, 90.0]), np.array([0.0, 60.0, 60.0, 60.0]))
    assert found.significant == [True, True, True, False]
    assert found.mismatch == [False, False, True, False]
