"""The catalogue of effects that a model may have left out: one small file an effect."""

from tauscope.effects.context import ArmContext, Signals
from tauscope.effects.effect import Coefficient, Effect, Quantity, Shape
from tauscope.effects.registry import catalogue, farther_effects, possible_effects
from tauscope.effects.time_local import TimeLocalEffect

__all__ = [
    "ArmContext",
    "Coefficient",
    "Effect",
    "Quantity",
    "Shape",
    "Signals",
    "TimeLocalEffect",
    "catalogue",
    "farther_effects",
    "possible_effects",
]
