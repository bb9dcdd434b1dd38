"""What is wished of an excitation."""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from tauscope.errors import ExcitationError
from tauscope.excitation.information import ColumnScaling, Criterion
from tauscope.excitation.optimiser import STARTS
from tauscope.excitation.workspace import Workspace

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class ExcitationOptions:
    """What is wished of an excitation.

    `period_s`: duration of one period [s].
    `noise_std`: (n,), expected torque noise of each joint, which weights its equations [Nm or N]; equal weights where
        None.
    `torque_offset`: torque kept free besides [Nm or N].
    """

    period_s: float = 10.0
    harmonics: int = 5
    periods: int = 5
    criterion: Criterion = Criterion.COND_F
    information_weight: float = 0.5
    scaling: ColumnScaling = ColumnScaling.NONE
    noise_std: Array | None = None
    limit_fraction: float = 0.95
    torque_margin: float = 0.2
    torque_offset: float = 0.0
    workspace: Workspace = field(default_factory=Workspace)
    slow_postures: int = 3
    closing_period: bool = True
    starts: int = STARTS
    seed: int = 0

    def __post_init__(self) -> None:
        """Refuse wishes that mean nothing."""
        wrong = {
            "period_s": not (np.isfinite(self.period_s) and self.period_s > 0.0) and "give a positive duration [s]",
            "harmonics": not 2 <= self.harmonics <= 100 and "give 2 to 100",
            "periods": not 1 <= self.periods <= 10_000 and "give 1 or more",
            "information_weight": not 0.0 <= self.information_weight < np.inf and "give a number of 0 or more",
            "limit_fraction": not 0.0 < self.limit_fraction <= 1.0 and "give a number above 0 and up to 1",
            "torque_margin": not 0.0 <= self.torque_margin < 1.0 and "give a number from 0 to below 1",
            "torque_offset": not 0.0 <= self.torque_offset < np.inf and "give a torque of 0 or more",
            "slow_postures": not 0 <= self.slow_postures <= 60 and "give 0 to 60",
            "starts": not 1 <= self.starts <= 64 and "give 1 to 64",
            "seed": self.seed < 0 and "give 0 or more",
        }
        for name, hint in wrong.items():
            if hint:
                raise ExcitationError(f"{name} is {getattr(self, name)}; {hint}")
