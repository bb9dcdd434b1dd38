"""The catalogue of effects that a model may have left out: one small file an effect."""

from service.diagnosis.catalogue.effect import Effect
from service.diagnosis.catalogue.parameters import Coefficient, Quantity, Shape
from service.diagnosis.catalogue.registry import catalogue, farther_effects, possible_effects
from service.diagnosis.catalogue.setting import Setting
from service.diagnosis.catalogue.signals import Signals
from service.diagnosis.catalogue.time_local import TimeLocalEffect

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
