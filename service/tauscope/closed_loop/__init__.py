"""The loop closed in MuJoCo: real motion against simulated motion with the same commands."""

from tauscope.closed_loop.result import RolloutDocument
from tauscope.closed_loop.rollout import Rollout, roll_out

__all__ = ["Rollout", "RolloutDocument", "roll_out"]
