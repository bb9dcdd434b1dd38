"""The catalogue of effects that a model may have left out: one small file an effect."""

from tauscope.effects.effect import Effect
from tauscope.effects.parameters import Coefficient, Quantity, Shape
from tauscope.effects.registry import catalogue, farther_effects, possible_effects
from tauscope.effects.setting import Setting
from tauscope.effects.signals import Signals
from tauscope.effects.time_local import TimeLocalEffect

__all__ = [
    "Coefficient",
    "Effect",
    "Quantity",
    "Setting",
    "Shape",
    "Signals",
    "TimeLocalEffect",
    "catalogue",
    "farther_effects",
    "possible_effects",
]
