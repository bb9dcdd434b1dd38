"""The order of the site: captions of its sidebar, and the pages below each.

The `README.md` of a folder stands for the folder: its links, in their order, are the pages below it. A page is
therefore in the navigation when the list that a reader sees names it.
"""

import re
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

REPOSITORY = Path(__file__).parents[2]

HOME = "README.md"
GENERATED = ("docs/reference/python.md", "docs/reference/cli.md", "docs/reference/rest.md", "docs/reference/schemas.md")
"""Pages that the build writes from the code."""

NAVIGATION: Mapping[str, Sequence[str]] = {
    "Tutorial": ("docs/tutorial.md", "docs/examples/README.md"),
    "How-to guides": ("docs/how-to/README.md", "deploy/README.md"),
    "Reference": (
        *GENERATED,
        "docs/reference/effects.md",
        "docs/errors/README.md",
        "docs/warnings/README.md",
        "docs/reference/drivers.md",
        "docs/reference/dynamixel.md",
        "docs/reference/dynamixel-faults.md",
        "docs/reference/feetech.md",
        "docs/reference/canopen-faults.md",
        "docs/reference/measured.md",
        "docs/reference/verdicts.md",
        "docs/reference/headroom.md",
        "docs/reference/speed.md",
        "docs/glossary.md",
    ),
    "Explanation": ("docs/method.md", "docs/proof.md", "docs/reliability.md", "docs/hardware-limits.md"),
    "Decisions": ("docs/decisions/README.md",),
    "Project": ("docs/README.md", "CONTRIBUTING.md", "CHANGELOG.md"),
}

LINK = re.compile(r"\]\(([^)\s]+)\)")


def list_children(page: str) -> list[str]:
    """Pages below the `README.md` of a folder, in the order of its links; none below any other page."""
    folder = Path(page).parent
    if Path(page).name != "README.md" or folder.as_posix() in (".", "docs"):
        return []
    targets = LINK.findall((REPOSITORY / page).read_text(encoding="utf-8"))
    names = (target.partition("#")[0] for target in targets)
    kept = dict.fromkeys(name for name in names if name.endswith(".md") and "/" not in name)
    return [(folder / name).as_posix() for name in kept]


def list_pages() -> Iterator[str]:
    """Every page of the navigation, the home page first."""
    yield HOME
    for pages in NAVIGATION.values():
        for page in pages:
            yield page
            yield from list_children(page)
