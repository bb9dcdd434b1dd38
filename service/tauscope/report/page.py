"""The parts of a page, and how they become HTML."""

from collections.abc import Sequence
from dataclasses import dataclass

from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup

from tauscope.report.table import Table


@dataclass(frozen=True)
class Drawing:
    """A figure on the page.

    svg : str
        inline SVG of our own making
    label : str
        what it shows, for those who do not see it
    caption : str
        how to read it
    """

    svg: Markup
    label: str
    caption: str


@dataclass(frozen=True)
class Numbers:
    """What a figure was drawn from, folded away: a table to read, or comma-separated text to copy.

    title : str
        what they are
    table : Table or None
        as cells
    text : str or None
        a heading line, then a line a sample
    """

    title: str
    table: Table | None = None
    text: str | None = None


@dataclass(frozen=True)
class Card:
    """One thing of several that are ranked.

    title, place : str
        what it is, and where
    probability : float
        from 0 to 1
    chance : str
        the same in words
    statement : str
        in plain words
    facts : sequence of (str, str)
        what is known about it
    """

    title: str
    place: str
    probability: float
    chance: str
    statement: str
    facts: Sequence[tuple[str, str]]


@dataclass(frozen=True)
class Part:
    """A piece of a section; what is None is left out.

    title : str or None
        heading
    card : Card or None
        one of several findings
    figure : Drawing or None
        drawing
    table : Table or None
        numbers
    numbers : Numbers or None
        what the figure was drawn from
    command : str or None
        what to type
    note : str or None
        small print
    """

    title: str | None = None
    card: Card | None = None
    figure: Drawing | None = None
    table: Table | None = None
    numbers: Numbers | None = None
    command: str | None = None
    note: str | None = None


@dataclass(frozen=True)
class Section:
    """A section of the page.

    anchor : str
        its name in links
    title : str
        heading
    parts : sequence of Part
        what it shows
    sentences : sequence of str
        what it says first
    """

    anchor: str
    title: str
    parts: Sequence[Part]
    sentences: Sequence[str] = ()


@dataclass(frozen=True)
class KeyFigure:
    """A number that stands large at the top.

    title : str
        what it is
    value : str
        the number
    remark : str
        how to read it
    """

    title: str
    value: str
    remark: str


@dataclass(frozen=True)
class Page:
    """Everything on the page.

    robot : str
        name of the robot
    subtitle : str
        date, estimator, recordings
    key_figures : sequence of KeyFigure
        at the top
    sentences, cautions : sequence of str
        what the result says, and what to know before using it
    sections : sequence of Section
        the rest
    footer : str
        what made it
    kind : str
        what the page is about, in a word
    headline : str or None
        the answer in a few words
    """

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

    Parameters
    ----------
    page : Page
        what to show
    """
    environment = Environment(
        loader=PackageLoader("tauscope.report"), autoescape=True, undefined=StrictUndefined, finalize=_printable
    )
    return environment.get_template("report.html").render(page=page) + "\n"


def _printable(value: object) -> object:
    """Text without characters that are no text."""
    if not isinstance(value, str) or isinstance(value, Markup):
        return value
    return "".join(c if c.isprintable() or c == "\n" else c.encode("unicode_escape").decode("ascii") for c in value)
