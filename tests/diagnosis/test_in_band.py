"""Whether findings predict better than the plain model of a possible body."""

from typing import Any

import numpy as np
import pytest

from tauscope.diagnosis.in_band import _predicts_better


class _HeldOut:
    """Held-out recordings on which a model's gains over another are given."""

    def __init__(self, joint_gains_z: list[float], whole: float) -> None:
        self._gains_z, self._whole = np.array(joint_gains_z), whole

    def joint_gains_z(self, before: Any, after: Any) -> Any:
        return self._gains_z

    def block_gains(self, before: Any, after: Any) -> Any:
        return np.array([self._whole])


MODEL: Any = None


@pytest.mark.parametrize(("joint_gains_z", "whole", "better"), [
    ([2.6, -0.6, 3.4, 4.1, 1.9, -3.1, 5.1], 900.0, True),  # two effects that were there: one joint lost a little
    ([5.7, -1.7, 2.5, -1.7, -9.7, 3.6, 3.7], 30000.0, False),  # an arm excited poorly, its free model wrong elsewhere
    ([2.5, -3.1], 90.0, False),  # what one joint loses is more than the other gains
    ([1.0, -2.9], 5.0, True),  # worse by chance, and all in all better
    ([1.0, -2.9], -5.0, False),
    ([2.1, -2.9], -5.0, True),  # one joint is clearly better
])  # fmt: skip
def test_findings_stay_where_some_joint_gains_more_than_any_loses(
    joint_gains_z: list[float], whole: float, better: bool
) -> None:
    held_out: Any = _HeldOut(joint_gains_z, whole)
    assert _predicts_better(MODEL, MODEL, held_out) is better


def test_findings_stay_where_nothing_was_held_out() -> None:
    assert _predicts_better(MODEL, MODEL, None)
