"""What is shown on a terminal: names as they are, tables that do not wrap in a pipe, progress where it is watched."""

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from rich import box
from rich.console import Console
from rich.progress import BarColumn, Progress, SpinnerColumn, TaskProgressColumn, TextColumn, TimeElapsedColumn
from rich.table import Table as RichTable
from rich.text import Text

from tauscope.errors import one_line
from tauscope.report.tables import Table

PIPE_WIDTH = 240  # columns where nobody looks: wide enough for every table


def output() -> Console:
    if sys.stdout.isatty():
        return Console(highlight=False, emoji=False)
    return Console(highlight=False, emoji=False, width=PIPE_WIDTH)


def plain(text: str) -> Text:
    """Text of a user's file: one line, and none of it taken for markup or for a terminal's command."""
    return Text(one_line(text))


def say(text: str, console: Console | None = None) -> None:
    """Print text of a user's file in one line, however long."""
    (console or output()).print(plain(text), soft_wrap=True)


def table(title: str, view: Table) -> RichTable:
    """A table of plain text, numbers to the right."""
    made = RichTable(title=plain(title), title_justify="left", title_style="bold", box=box.SIMPLE_HEAD, pad_edge=False)
    for place, column in enumerate(view.columns):
        is_word = place < view.words
        made.add_column(plain(column), justify="left" if is_word else "right", no_wrap=not is_word)
    for row in view.rows:
        made.add_row(*(plain(cell) for cell in row))
    return made


# Told the step that goes on, and how much of it is done in percent, or None where that is not known.
Told = Callable[..., None]


@contextmanager
def show_progress() -> Iterator[Told]:
    """A bar on standard error, where that is a terminal."""
    if not sys.stderr.isatty():
        yield lambda *_: None
        return
    columns = (
        SpinnerColumn(),
        TextColumn("{task.description}", markup=False),
        BarColumn(),
        TaskProgressColumn(),
        TimeElapsedColumn(),
    )
    with Progress(*columns, console=Console(stderr=True), transient=True) as progress:
        task = progress.add_task("", total=None)

        def show(step: str, percent: float | None = None, _figures: object = None) -> None:
            total = None if percent is None else 100.0
            progress.update(task, description=one_line(step), total=total, completed=percent or 0.0)

        yield show
