"""The parts of a page, and how they become HTML."""

from collections.abc import Sequence
from dataclasses import dataclass

from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup

from tauscope.report.tables import Table


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
    """One thing of several that are ranked.

    `rank`: from 1.
    `probability`: from 0 to 1.
    `facts`: sequence of (str, str), what is known about it.
    """

    rank: int
    title: str
    place: str
    probability: float
    chance: str
    statement: str
    facts: Sequence[tuple[str, str]]


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

    robot: str
    subtitle: str
    key_figures: Sequence[KeyFigure]
    sentences: Sequence[str]
    cautions: Sequence[str]
    sections: Sequence[Section]
    footer: str
    kind: str = "identification"
    headline: str | None = None

    @property
    def contents(self) -> list[tuple[str, str]]:
        """Anchor and title of every section."""
        return [(section.anchor, section.title) for section in self.sections]


def render(page: Page) -> str:
    """The page as one HTML file that asks nothing of any network and runs no script.

    All text is escaped; what no file could hold (control characters, broken Unicode of a file name) is spelled out.
    """
    environment = Environment(
        loader=PackageLoader("tauscope.report"), autoescape=True, undefined=StrictUndefined, finalize=_printable
    )
    return environment.get_template("report.html").render(page=page) + "\n"


def _printable(value: object) -> object:
    if not isinstance(value, str) or isinstance(value, Markup):
        return value
    return "".join(c if c.isprintable() or c == "\n" else c.encode("unicode_escape").decode("ascii") for c in value)
