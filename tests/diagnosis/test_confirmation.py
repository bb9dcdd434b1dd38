"""When held-out recordings confirm a finding."""

import pytest
from scipy import stats

from service.diagnosis.confirmation import Confirmation


@pytest.mark.parametrize(
    ("gain", "gain_z", "expected_z", "seen_z", "confirmed"),
    [
        (60.0, 3.0, 8.0, 7.0, True),  # predicts better, and is there again
        (200.0, 3.4, 3.6, 1.2, True),  # predicts so well that too little to estimate it anew does not matter
        (-6.0, -0.7, 2.9, 2.1, False),  # expected there, and predicts worse
        (5.0, 1.0, 6.0, 0.3, False),  # should be there, and is not
        (3.0, 0.5, 2.0, 0.3, True),  # little to be seen, a little better
        (-2.0, -0.5, 0.5, -0.2, True),  # nothing to be seen: no objection
        (-9.0, -4.0, 0.5, -0.2, False),  # nothing to be seen, and yet it spoils the prediction
        (-4.0, -1.0, 20.0, 19.0, True),  # there beyond doubt: its size is off
        (-2.3, -0.1, 4.6, 3.4, True),  # seen as large as it should be; that it predicts nothing better is chance
        (2.8, 0.2, 2.9, -1.1, False),  # a little better, and seen with the wrong sign
        (-90.0, -5.0, 20.0, 19.0, False),  # …but not where it clearly spoils the prediction
    ],
)
def test_what_is_confirmed(gain: float, gain_z: float, expected_z: float, seen_z: float, confirmed: bool) -> None:
    assert Confirmation(gain, gain_z, expected_z, seen_z).confirmed(cautious=False) is confirmed


def test_where_noise_is_a_guess_more_is_asked() -> None:
    weak = Confirmation(gain=3.0, gain_z=0.5, expected_z=2.0, seen_z=0.3)
    assert weak.confirmed(cautious=False)
    assert not weak.confirmed(cautious=True)


def test_what_favours_a_finding_is_the_logarithm_of_its_likelihood_ratio() -> None:
    """An estimate z of unit variance, E[z] if it is there and 0 if not: log φ(z - E) - log φ(z), and half the gain."""
    found = Confirmation(gain=5.0, gain_z=1.0, expected_z=3.0, seen_z=2.2)
    of_size = stats.norm.logpdf(2.2, loc=3.0) - stats.norm.logpdf(2.2)
    assert found.favour == pytest.approx(of_size + 2.5)
