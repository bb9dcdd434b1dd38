"""Functions as commands: help from the docstring, and options from the fields of a model."""

import inspect
import math
import re
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import wraps
from types import NoneType, UnionType
from typing import Annotated, Any, Literal, TypeVar, Union, get_args, get_origin

import typer
from pydantic import BaseModel, ValidationError
from pydantic.fields import FieldInfo
from typer import Option
from typer.core import TyperCommand, TyperOption

SEVERAL = "..."  # A metavar that ends so marks an option that takes several values: what --help shows is what is parsed
Model = TypeVar("Model", bound=BaseModel)
_UNIT = re.compile(r"_(s|ms|m|hz|c|rad_s)$")


def spread_values(words: Sequence[str], options: Collection[str]) -> list[str]:
    """Write ``--held-out a b`` as ``--held-out a --held-out b``: values end at the next option or at ``--``."""
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
        several = [p for p in self.params if isinstance(p, TyperOption) and (p.metavar or "").endswith(SEVERAL)]
        return super().parse_args(ctx, spread_values(args, {name for option in several for name in option.opts}))


def add_verb(
    app: typer.Typer,
    function: Callable[..., None],
    cls: type[TyperCommand] = SeveralValuesCommand,
    name: str | None = None,
) -> None:
    """Make a function a command of the same name; its docstring is the help."""
    app.command(name, cls=cls, help=inspect.getdoc(function))(expand_groups(function))


def make_group(**verbs: Callable[..., None]) -> typer.Typer:
    """A group of commands; its help is its line in `VERBS`."""
    group = typer.Typer(no_args_is_help=True, rich_markup_mode=None)
    for name, function in verbs.items():
        add_verb(group, function, name=name)
    return group


@dataclass(frozen=True)
class OptionsOf:
    """A parameter that takes fields of a model as options: `only` these, or all `without` some."""

    model: type[BaseModel]
    only: tuple[str, ...] = ()
    without: tuple[str, ...] = ()

    @property
    def fields(self) -> dict[str, FieldInfo]:
        known = self.model.model_fields
        return {name: known[name] for name in self.only or known if name not in self.without}


def make_request(kind: type[Model], **fields: Any) -> Model:
    """A request or its options. Raises typer.BadParameter naming the field."""
    try:
        return kind(**fields)
    except ValidationError as error:
        fault = error.errors(include_url=False, include_context=False)[0]
        option = f"--{fault['loc'][0]}".replace("_", "-") if fault["loc"] else kind.__name__
        raise typer.BadParameter(f"{fault['msg']}", param_hint=f"'{option}'") from None


def expand_groups(function: Callable[..., None]) -> Callable[..., None]:
    """A command in which each parameter marked by `OptionsOf` becomes one option per field."""
    signature = inspect.signature(function, eval_str=True)
    groups: dict[str, OptionsOf] = {
        name: mark
        for name, parameter in signature.parameters.items()
        for mark in getattr(parameter.annotation, "__metadata__", ())
        if isinstance(mark, OptionsOf)
    }
    if not groups:
        return function
    parameters: list[inspect.Parameter] = []
    for name, parameter in signature.parameters.items():
        parameters += _list_options(groups[name]) if name in groups else [parameter]

    @wraps(function)
    def command(**values: Any) -> None:
        taken = {name: _take_fields(group, values) for name, group in groups.items()}
        function(**values, **taken)

    vars(command)["__signature__"] = signature.replace(parameters=parameters)
    return command


def _take_fields(group: OptionsOf, values: dict[str, Any]) -> dict[str, Any]:
    fields = {name: values.pop(name) for name in group.fields}
    for name, text in fields.items():
        if isinstance(text, str) and tuple in _list_types(group.model.model_fields[name].annotation):
            fields[name] = parse_numbers(text, f"--{_UNIT.sub('', name).replace('_', '-')}")
    return fields


def _list_options(group: OptionsOf) -> Iterator[inspect.Parameter]:
    for name, field in group.fields.items():
        kind, choices = _option_type(field)
        short = _UNIT.sub("", name)
        flags = [f"--{each.replace('_', '-')}" for each in dict.fromkeys((short, name))]
        default = field.get_default(call_default_factory=True)
        if kind is bool:
            flags = [f"{flag}/--no-{flag[2:]}" for flag in flags] if default else flags
        elif isinstance(default, tuple):
            default = ",".join(f"{value:g}" for value in default)
        bounds = {edge: getattr(mark, name) for mark in field.metadata for edge, name in _EDGES if hasattr(mark, name)}
        option = Option(
            *flags,
            help=describe_field(field),
            metavar="|".join(choices) or None,
            show_default=default is not None,
            **(bounds if kind in (int, float) else {}),
        )
        annotation = Annotated[kind if default is not None else kind | None, option]
        yield inspect.Parameter(name, inspect.Parameter.KEYWORD_ONLY, default=default, annotation=annotation)


_EDGES = (("min", "ge"), ("max", "le"))


def describe_field(field: FieldInfo) -> str:
    words = re.sub(r"[;,] null(?: for|:)? (.*)", r" (by default \1)", field.description or "")
    return f"{words[:1].upper()}{words[1:]}."


def _list_types(annotation: Any) -> list[Any]:
    origin = get_origin(annotation)
    if origin is Annotated:
        return _list_types(get_args(annotation)[0])
    if origin in (Union, UnionType):
        return [kind for each in get_args(annotation) for kind in _list_types(each)]
    return [annotation if origin in (None, Literal) else origin]


def _option_type(field: FieldInfo) -> tuple[Any, list[str]]:
    """The type of an option, and the choices that its metavar shows where the type does not."""
    kinds = [kind for kind in _list_types(field.annotation) if kind is not NoneType]
    if len(kinds) == 1 and not isinstance(kinds[0], type):
        return kinds[0], []
    if len(kinds) == 1 and not issubclass(kinds[0], tuple | Mapping):
        return kinds[0], []
    choices = [str(choice) for kind in kinds for choice in get_args(kind) or getattr(kind, "__members__", {}).values()]
    return str, choices or (["N,..."] if tuple in kinds else [])


def parse_numbers(text: str, option: str, count: int | None = None) -> tuple[float, ...]:
    """Numbers separated by commas, as many as `count` says. Raises typer.BadParameter for anything else."""
    try:
        numbers = tuple(float(part) for part in text.split(","))
    except ValueError:
        numbers = ()
    if not numbers or not all(map(math.isfinite, numbers)) or (count is not None and len(numbers) != count):
        wanted = "numbers" if count is None else f"{count} numbers"
        raise typer.BadParameter(f"{text!r} is not {wanted} separated by commas", param_hint=f"'{option}'")
    return numbers
