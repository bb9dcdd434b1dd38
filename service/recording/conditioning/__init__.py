"""From raw samples to motion that a regressor can be evaluated on, and to one band for torque and regressor."""

from service.recording.conditioning.filters import AllPass, BandFilter, Decimator, HarmonicBand
from service.recording.conditioning.motion import Conditioner, ConditioningSummary, Motion
from service.recording.conditioning.periods import Periods, split_periods
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
    "Periods",
    "Stretch",
    "split_periods",
]
