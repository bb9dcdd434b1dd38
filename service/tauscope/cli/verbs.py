"""Registering functions as commands: help from the docstring, options also from dataclasses that group them."""

import inspect
from collections.abc import Callable, Collection, Sequence
from dataclasses import MISSING, fields, is_dataclass
from functools import wraps
from typing import Any, get_type_hints

import typer
from typer.core import TyperCommand, TyperOption

SEVERAL = "..."
"""A metavar that ends so marks an option that takes several values: what --help shows is what is parsed."""


def spread_values(words: Sequence[str], options: Collection[str]) -> list[str]:
    """Write an option again before each of its values: ``--held-out a b`` becomes ``--held-out a --held-out b``.

    An option's values end at the next option or at ``--``; ``--held-out=a`` takes this one value.
    """
    spread: list[str] = []
    option: str | None = None
    for index, word in enumerate(words):
        if word == "--":
            return [*spread, *words[index:]]
        if word.startswith("-") and word != "-":
            option = word if word in options else None
            spread.append(word)
        elif option is None or spread[-1] == option:
            spread.append(word)
        else:
            spread += [option, word]
    return spread


class SeveralValuesCommand(TyperCommand):
    """A command of which some options take several values: those whose metavar ends in ``...``."""

    def parse_args(self, ctx: typer.Context, args: list[str]) -> list[str]:
        """Parse the command line after its options were repeated before each value."""
        several = [p for p in self.params if isinstance(p, TyperOption) and (p.metavar or "").endswith(SEVERAL)]
        return super().parse_args(ctx, spread_values(args, {name for option in several for name in option.opts}))


def add_verb(
    app: typer.Typer, function: Callable[..., None], cls: type[TyperCommand] = TyperCommand, name: str | None = None
) -> None:
    """Make a function a command of the same name; its docstring is the help."""
    app.command(name, cls=cls, help=inspect.getdoc(function))(expand_groups(function))


def expand_groups(function: Callable[..., None]) -> Callable[..., None]:
    """A command in which each parameter of a dataclass type becomes one option per field of that class."""
    signature = inspect.signature(function, eval_str=True)
    groups: dict[str, Any] = {
        name: parameter.annotation
        for name, parameter in signature.parameters.items()
        if is_dataclass(parameter.annotation)
    }
    if not groups:
        return function
    parameters: list[inspect.Parameter] = []
    for name, parameter in signature.parameters.items():
        parameters += _list_options(groups[name]) if name in groups else [parameter]

    @wraps(function)
    def command(**values: Any) -> None:
        made = {
            name: group(**{field.name: values.pop(field.name) for field in fields(group)})
            for name, group in groups.items()
        }
        function(**values, **made)

    vars(command)["__signature__"] = signature.replace(parameters=parameters)
    return command


def _list_options(group: Any) -> list[inspect.Parameter]:
    """The fields of a group as keyword parameters."""
    hints = get_type_hints(group, include_extras=True)
    return [
        inspect.Parameter(
            field.name,
            inspect.Parameter.KEYWORD_ONLY,
            default=inspect.Parameter.empty if field.default is MISSING else field.default,
            annotation=hints[field.name],
        )
        for field in fields(group)
    ]
