"""The check of a built site: every link leads to a file and an anchor of it, and nothing comes from elsewhere."""

import re
from collections.abc import Iterator
from html import unescape
from pathlib import Path
from urllib.parse import unquote, urlsplit

TAG = re.compile(r"<(\w+)(\s[^>]*)>")
ATTRIBUTE = re.compile(r"""\s(href|src|id)="([^"]*)\"""")


class Page:
    """Links, loaded files and anchors of an HTML page."""

    def __init__(self, text: str) -> None:
        self.links: set[str] = set()
        self.loaded: set[str] = set()
        self.anchors = {"", "top"}
        for tag, attributes in TAG.findall(text):
            for name, value in ATTRIBUTE.findall(attributes):
                if name == "id":
                    self.anchors.add(unescape(value))
                else:
                    (self.links if tag == "a" else self.loaded).add(unescape(value))


def find_faults(site: Path) -> Iterator[str]:
    """Links that lead nowhere, and files that another server would have to send."""
    pages = {file.resolve(): Page(file.read_text(encoding="utf-8")) for file in sorted(site.rglob("*.html"))}
    for file, page in pages.items():
        name = file.relative_to(site.resolve())
        for address in sorted(page.links | page.loaded):
            parts = urlsplit(address)
            if parts.scheme or parts.netloc:
                if address in page.loaded and parts.scheme != "data":
                    yield f"{name}: loads {address}"
                continue
            target = (file.parent / unquote(parts.path)).resolve() if parts.path else file
            if not target.is_file():
                yield f"{name}: {address} leads nowhere"
            elif target in pages and unquote(parts.fragment) not in pages[target].anchors:
                yield f"{name}: {address} has no such anchor"
