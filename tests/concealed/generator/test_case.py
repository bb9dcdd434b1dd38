"""What is drawn becomes the trial that was drawn."""

from typing import Any

import pytest

from concealed.generator import case as cases
from concealed.generator.case import COARSE, SENSORS, Case
from concealed.generator.concealment import Concealed


@pytest.mark.parametrize("places", [(), (("cogging", 1),), (("cogging", 1), ("backlash", 2))])
@pytest.mark.parametrize("sensors", [*SENSORS, *COARSE])
def test_whatever_is_wrong_with_the_sensors_comes_beside_whatever_is_concealed(
    places: tuple[tuple[str, int], ...], sensors: dict[str, Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(cases, "recorded_trial", lambda arm, concealed, **drawn: (arm, concealed, drawn))
    case, concealed = Case("strong-sensing", 3, "paper", places, 40.0, sensors=sensors), Concealed()
    assert case.recorded(concealed) == ("paper", concealed, {"motion_seed": 0, "seed": 3, "motion": "rich", **sensors})
