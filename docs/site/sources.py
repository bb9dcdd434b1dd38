"""The sources of the site: the repository's pages with links between their new places, and the navigation."""

import re
import shutil
from collections.abc import Sequence
from pathlib import Path

from docs.site.navigation import GENERATED, HOME, LINK, NAVIGATION, REPOSITORY, list_children, list_pages

PLACES = {
    HOME: "index.md",
    "docs/README.md": "all-pages.md",
    "deploy/README.md": "deploy.md",
    "CONTRIBUTING.md": "contributing.md",
    "CHANGELOG.md": "changelog.md",
}
"""Pages whose place on the site does not follow from their path."""


def find_place(path: str) -> str:
    """Where a file of the repository stands on the site; the `README.md` of a folder is its index."""
    if path in PLACES:
        return PLACES[path]
    if not path.startswith("docs/"):
        return f"files/{path}"
    return re.sub(r"(?<=/)README\.md$", "index.md", path.removeprefix("docs/"))


def write_sources(folder: Path) -> None:
    """Write every page, and every file that a page links to."""
    for page in dict.fromkeys(list_pages()):
        if page in GENERATED:
            continue
        text = relink((REPOSITORY / page).read_text(encoding="utf-8"), page, folder)
        if page == HOME:
            text += "".join(format_toctree(pages, page, caption) for caption, pages in NAVIGATION.items())
        else:
            text += format_toctree(list_children(page), page)
        write_text(folder / find_place(page), text)


def relink(text: str, page: str, folder: Path) -> str:
    """A page with links between places on the site. A linked file that is no page is copied beside them."""
    place = Path(find_place(page)).parent

    def replace(match: re.Match[str]) -> str:
        path, mark, anchor = match[1].partition("#")
        file = (REPOSITORY / page).parent / path
        if not path or re.match(r"\w+:", path) or not file.exists():
            return match[0]
        target = file.resolve().relative_to(REPOSITORY.resolve())
        target /= "README.md" if file.is_dir() else ""
        moved = find_place(target.as_posix())
        if target.suffix != ".md":
            (folder / moved).parent.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(file, folder / moved)
        up = "../" * len(place.parts)
        return f"]({up}{moved}{mark}{anchor})"

    return LINK.sub(replace, text)


def format_toctree(pages: Sequence[str], page: str, caption: str = "") -> str:
    """The sidebar's entries below a page; nothing where there are none."""
    if not pages:
        return ""
    options = f":caption: {caption}\n" if caption else ""
    entries = "".join(f"/{find_place(each).removesuffix('.md')}\n" for each in pages)
    return f"\n```{{toctree}}\n:hidden:\n:maxdepth: 1\n{options}\n{entries}```\n"


def write_text(file: Path, text: str) -> None:
    """Write a file and the folders that it needs."""
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_text(text, encoding="utf-8")
