"""The parts of a page, and how they become HTML."""

import shlex
from collections.abc import Sequence
from dataclasses import dataclass

from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup

from tauscope.report.provenance import Provenance
from tauscope.report.tables import Table, input_table


@dataclass(frozen=True)
class Drawing:
    """A figure on the page."""

    svg: Markup
    label: str
    caption: str


@dataclass(frozen=True)
class Numbers:
    """What a figure was drawn from, folded away: a table to read, or comma-separated text to copy."""

    title: str
    table: Table | None = None
    text: str | None = None


@dataclass(frozen=True)
class Card:
    """One thing of several that are ranked."""

    rank: int  # from 1
    title: str
    place: str
    probability: float  # from 0 to 1
    chance: str
    statement: str
    facts: Sequence[tuple[str, str]]  # sequence of (str, str), what is known about it


@dataclass(frozen=True)
class Fold:
    """Cards that are folded away."""

    title: str
    cards: Sequence[Card]


@dataclass(frozen=True)
class Part:
    """A piece of a section; what is None is left out."""

    title: str | None = None
    card: Card | None = None
    fold: Fold | None = None
    figure: Drawing | None = None
    table: Table | None = None
    numbers: Numbers | None = None
    command: str | None = None
    note: str | None = None


@dataclass(frozen=True)
class Section:
    """A section of the page."""

    anchor: str
    title: str
    parts: Sequence[Part]
    sentences: Sequence[str] = ()


@dataclass(frozen=True)
class KeyFigure:
    """A number that stands large at the top."""

    title: str
    value: str
    remark: str


@dataclass(frozen=True)
class Page:
    """Everything on the page."""

    kind: str
    robot: str
    facts: Sequence[str]  # that stand below the title, beside the date
    key_figures: Sequence[KeyFigure]
    sentences: Sequence[str]
    cautions: Sequence[str]
    story: Sequence[Section]
    provenance: Provenance
    headline: str | None = None

    @property
    def subtitle(self) -> str:
        """The facts and the date."""
        return " · ".join([*self.facts, self.provenance.created.strftime("%Y-%m-%d %H:%M %Z").strip()])

    @property
    def sections(self) -> list[Section]:
        """The story, and how to get it again."""
        parts = [Part(table=input_table(self.provenance))]
        if self.provenance.command:
            parts.append(Part(command=shlex.join(self.provenance.command)))
        return [*self.story, Section("reproduce", "To make it again", parts)]

    @property
    def footer(self) -> str:
        """What computed it."""
        return ", ".join(f"{name} {version}" for name, version in self.provenance.versions)


def render(page: Page) -> str:
    """The page as one HTML file without scripts or requests, its text escaped, control characters spelled out."""
    environment = Environment(
        loader=PackageLoader("tauscope.report"), autoescape=True, undefined=StrictUndefined, finalize=_printable
    )
    return environment.get_template("report.html").render(page=page) + "\n"


def _printable(value: object) -> object:
    if not isinstance(value, str) or isinstance(value, Markup):
        return value
    return "".join(c if c.isprintable() or c == "\n" else c.encode("unicode_escape").decode("ascii") for c in value)
