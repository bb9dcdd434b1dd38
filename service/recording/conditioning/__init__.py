"""From raw samples to motion that a regressor can be evaluated on, and to one band for torque and regressor."""

from service.recording.conditioning.common_band import AllPass, BandFilter, Decimator, HarmonicBand
from service.recording.conditioning.conditioner import Conditioner
from service.recording.conditioning.motion import Motion
from service.recording.conditioning.motion_source import MotionSource, Source
from service.recording.conditioning.periods import Periods, split_periods
from service.recording.conditioning.summary import ConditioningSummary
from service.recording.conditioning.uniform import Mask, Stretch

__all__ = [
    "AllPass",
    "BandFilter",
    "Conditioner",
    "ConditioningSummary",
    "Decimator",
    "HarmonicBand",
    "Mask",
    "Motion",
    "MotionSource",
    "Periods",
    "Source",
    "Stretch",
    "split_periods",
]
