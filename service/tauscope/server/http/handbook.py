"""Pages of docs/ that the service shows itself: one for each error code, and the how-to pages. They need no network."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from types import MappingProxyType

from markdown_it import MarkdownIt
from markdown_it.token import Token

SECTIONS = ("errors", "how-to")

_ROOTS = (Path(__file__).parent / "handbook_pages", Path(__file__).parents[4] / "docs")
"""Where the pages lie: beside this file where the package was installed, in docs/ of a source tree."""

_markdown = MarkdownIt("commonmark", {"html": False}).enable("table")


@dataclass(frozen=True)
class Chapter:
    """A page as it is shown."""

    title: str
    html: str


@cache
def chapters() -> Mapping[str, Chapter]:
    """Every page, by its path below /docs: ``errors/recording``."""
    root = next((each for each in _ROOTS if (each / SECTIONS[0]).is_dir()), None)
    if root is None:
        return {}
    files = (file for section in SECTIONS for file in sorted((root / section).glob("*.md")) if file.stem != "README")
    texts = {f"{file.parent.name}/{file.stem}": file.read_text(encoding="utf-8") for file in files}
    return MappingProxyType({path: rendered(text, path, texts) for path, text in texts.items()})


def rendered(text: str, path: str, known: Mapping[str, object]) -> Chapter:
    """A page from its Markdown. Markup of HTML stays text, and a link that leads to no page becomes its words."""
    tokens = _markdown.parse(text)
    for token in tokens:
        if token.children is not None:
            token.children = _relinked(token.children, path, known)
    heading = next((token.content for token in tokens if token.type == "inline"), path)
    return Chapter(heading.replace("`", ""), _markdown.renderer.render(tokens, _markdown.options, {}))


def _relinked(tokens: Sequence[Token], path: str, known: Mapping[str, object]) -> list[Token]:
    """Inline tokens whose links lead to pages of the service; of other links the words stay, of pictures nothing."""
    kept, is_open = [], True
    for token in tokens:
        if token.type == "link_open":
            target = _target(str(token.attrs["href"]), path, known)
            is_open = target is not None
            token.attrs["href"] = target or ""
        if token.type == "image" or (token.type.startswith("link_") and not is_open):
            continue
        kept.append(token)
    return kept


def _target(link: str, path: str, known: Mapping[str, object]) -> str | None:
    """Where a relative link leads on the service; None where it has no such page."""
    match = re.fullmatch(r"(?:\.\./)?([\w./-]+)\.md(#[\w-]+)?", link)
    if match is None:
        return None
    place = match[1] if link.startswith("../") else f"{path.partition('/')[0]}/{match[1]}"
    return f"/docs/{place}{match[2] or ''}" if place in known else None
