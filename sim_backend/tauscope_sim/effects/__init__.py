"""Concealed physics: every effect id of the catalogue that forward physics or sensors can have."""

from collections.abc import Iterator, Mapping
from importlib import import_module
from pkgutil import iter_modules
from types import MappingProxyType

from tauscope_sim.effects.effect import Effect, ScenarioEntry
from tauscope_sim.effects.sensor_effects import SensorEffect


def _entries() -> Iterator[type[ScenarioEntry]]:
    """The classes of this package that state an id of their own."""
    for module in iter_modules(__path__, f"{__name__}."):
        for each in vars(import_module(module.name)).values():
            is_own = isinstance(each, type) and each.__module__ == module.name
            if is_own and issubclass(each, ScenarioEntry) and vars(each).get("effect_id"):
                yield each


# class of each effect, by its id
EFFECTS: Mapping[str, type[ScenarioEntry]] = MappingProxyType({entry.effect_id: entry for entry in _entries()})
__all__ = ["EFFECTS", "Effect", "ScenarioEntry", "SensorEffect"]
