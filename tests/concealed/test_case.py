"""What is drawn becomes the trial that was drawn."""

from typing import Any

import pytest

from concealed import trial
from concealed.case import COARSE, SENSORS, Case
from concealed.trial import Concealed


@pytest.mark.parametrize("places", [(), (("cogging", 1),), (("cogging", 1), ("backlash", 2))])
@pytest.mark.parametrize("sensors", [*SENSORS, *COARSE])
def test_whatever_is_wrong_with_the_sensors_comes_beside_whatever_is_concealed(
    places: tuple[tuple[str, int], ...], sensors: dict[str, Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(trial, "_effects", lambda *_: Concealed())
    monkeypatch.setattr(trial, "_recorded", lambda arm, seed, motion, concealed, drawn, states, noise: (motion, noise))
    case = Case("strong-sensing", 3, "paper", places, 40.0, sensors=sensors)
    assert case.made() == ("rich", sensors)
