"""From raw samples to motion that a regressor can be evaluated on, and to one band for torque and regressor."""

from tauscope.recording.conditioning.common_band import AllPass
from tauscope.recording.conditioning.conditioner import Conditioner, ConditioningEntry
from tauscope.recording.conditioning.motion import Motion
from tauscope.recording.conditioning.motion_source import Source
from tauscope.recording.conditioning.periods import split_periods
from tauscope.recording.conditioning.uniform import Mask, Stretch

__all__ = ["AllPass", "Conditioner", "ConditioningEntry", "Mask", "Motion", "Source", "Stretch", "split_periods"]
