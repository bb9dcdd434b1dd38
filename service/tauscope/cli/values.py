"""Options that take several values, as in ``--held-out a.csv b.csv``; Typer's parser knows one value an option."""

from collections.abc import Collection, Sequence

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
