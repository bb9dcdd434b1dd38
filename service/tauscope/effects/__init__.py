"""The catalogue of effects that a model may have left out: one small file an effect, found by itself."""

from tauscope.effects.context import ArmContext, Signals
from tauscope.effects.effect import Coefficient, Effect, Entry, Quantity, Shape
from tauscope.effects.registry import catalogue, effect_class, farther_effects, possible_effects
from tauscope.effects.time_local import TimeLocalEffect

__all__ = [
    "ArmContext",
    "Coefficient",
    "Effect",
    "Entry",
    "Quantity",
    "Shape",
    "Signals",
    "TimeLocalEffect",
    "catalogue",
    "effect_class",
    "farther_effects",
    "possible_effects",
]
