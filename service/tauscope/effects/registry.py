"""All effects that are looked for: those of this package, and those that plugins add.

Every module of this package is read for its effects. A plugin names an `Effect` class under the entry point group
``tauscope.effects``.
"""

from collections.abc import Iterator, Sequence
from functools import cache
from importlib import import_module
from importlib.metadata import entry_points
from inspect import isabstract
from pathlib import Path
from pkgutil import iter_modules

from tauscope.effects.context import ArmContext
from tauscope.effects.effect import Effect
from tauscope.errors import IdentificationError

ENTRY_POINT_GROUP = "tauscope.effects"


@cache
def catalogue() -> tuple[type[Effect], ...]:
    """All effects' classes by rank, built-in ones first. Raises IdentificationError for a faulty plugin."""
    parts = [sorted(part, key=lambda each: (each.rank, each.id)) for part in (_built_in(), _plugins())]
    found: dict[str, type[Effect]] = {}
    for effect in (each for part in parts for each in part):
        if found.setdefault(effect.id, effect) is not effect:
            raise IdentificationError(f"two effects have the id {effect.id}: rename the one of {effect.__module__}")
    return tuple(found.values())


def effect_class(effect_id: str) -> type[Effect]:
    """The class of an id of the catalogue."""
    return next(effect for effect in catalogue() if effect.id == effect_id)


def possible_effects(context: ArmContext) -> Sequence[Effect]:
    """Every form of every effect worth looking at beside the nominal model."""
    return [form for effect in catalogue() if effect.screened for form in effect.forms(context)]


def farther_effects(context: ArmContext) -> Sequence[Effect]:
    """Every form that is worth a look only where something is left."""
    return [form for effect in catalogue() if effect.screened for form in effect.farther_forms(context)]


def _built_in() -> Iterator[type[Effect]]:
    for module in iter_modules([str(Path(__file__).parent)]):
        for each in vars(import_module(f"{__package__}.{module.name}")).values():
            is_own = isinstance(each, type) and each.__module__ == f"{__package__}.{module.name}"
            if is_own and issubclass(each, Effect) and not isabstract(each) and not each.is_variant:
                yield each


def _plugins() -> Iterator[type[Effect]]:
    for entry in entry_points(group=ENTRY_POINT_GROUP):
        try:
            effect = entry.load()
        except Exception as error:
            raise IdentificationError(f"effect {entry.name} ({entry.value}) cannot be loaded: {error}") from error
        if not (isinstance(effect, type) and issubclass(effect, Effect)):
            raise IdentificationError(
                f"effect {entry.name} ({entry.value}) is no subclass of Effect: correct the plugin"
            )
        yield effect
