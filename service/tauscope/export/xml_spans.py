"""XML as bytes and spans: find an element, change an attribute, and leave every other byte alone."""

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from xml.parsers import expat

from tauscope.errors import ExportError

_ATTRIBUTE = re.compile(rb"""([^\s=<>/"']+)\s*=\s*("[^"]*"|'[^']*')""")
_TAG_END = re.compile(rb"""(?:[^>"']|"[^"]*"|'[^']*')*>""")


@dataclass(eq=False)
class Element:
    """An element and where it stands in the file, in bytes."""

    name: str
    attributes: Mapping[str, str]
    start: int
    open_end: int
    close_start: int = -1
    end: int = -1
    children: list["Element"] = field(default_factory=list)
    comments: list[tuple[int, int]] = field(default_factory=list)  # spans of those directly inside

    @property
    def prefix(self) -> str:
        """Namespace prefix with its colon, or nothing."""
        return self.name[: self.name.rfind(":") + 1]

    def named(self, kind: str) -> Iterator["Element"]:
        """Children of one kind, whatever their prefix."""
        return (child for child in self.children if child.name.rpartition(":")[2] == kind)


@dataclass(frozen=True)
class Edit:
    """Replace bytes start:stop by text; an insertion where start equals stop."""

    start: int
    stop: int
    text: bytes


class XmlText:
    """The bytes of an XML file, and edits to be made. Raises ExportError unless it is sound UTF-8 without DOCTYPE."""

    def __init__(self, data: bytes, label: str) -> None:
        self.data = data
        self.newline = b"\r\n" if b"\r\n" in data else b"\n"
        self.root = _parse(data, label)
        self._edits: list[Edit] = []

    def set_attributes(self, element: Element, values: Mapping[str, str]) -> None:
        """Change attributes of an element in place; those that are missing are added after the last one."""
        missing = dict(values)
        last = element.start + 1 + len(element.name.encode())
        for match in _ATTRIBUTE.finditer(self.data, last, element.open_end):
            last = match.end()
            name = match.group(1).decode()
            if name in missing:
                start, stop = match.span(2)
                quote = self.data[start : start + 1]
                self._edits.append(Edit(start, stop, quote + _attribute_text(missing.pop(name)) + quote))
        added = b"".join(b' %s="%s"' % (name.encode(), _attribute_text(value)) for name, value in missing.items())
        if added:
            self._edits.append(Edit(last, last, added))

    def replace_element(self, element: Element, line: str) -> None:
        """Write a line of XML in place of an element and all that it holds."""
        self._edits.append(Edit(element.start, element.end, line.encode()))

    def append_child(self, parent: Element, lines: list[str]) -> None:
        """Add lines of XML as the last child of an element, indented as its other children are."""
        inner = self._indent(parent.children[0]) if parent.children else self._indent(parent) + b"  "
        text = b"".join(self.newline + inner + line.encode() for line in lines)
        if parent.close_start == parent.open_end == parent.end:
            slash = self.data.rindex(b"/", parent.start, parent.open_end)
            closing = self.newline + self._indent(parent) + b"</%s>" % parent.name.encode()
            self._edits.append(Edit(slash, parent.open_end, b">" + text + closing))
            return
        place = parent.children[-1].end if parent.children else parent.open_end
        closing = b"" if parent.children else self.newline + self._indent(parent)
        tail = self.data[place : parent.close_start]
        stop = parent.close_start if not parent.children and not tail.strip() else place
        self._edits.append(Edit(place, stop, text + closing))

    def set_comment(self, parent: Element, marker: str, text: str) -> None:
        """Write a comment after an element's start tag, or over an earlier one that begins with the same marker."""
        body = f"{marker}{text}".replace("--", "- -").replace("--", "- -")
        comment = f"<!-- {body} -->".encode("ascii", "backslashreplace").replace(b"\n", self.newline)
        for start, stop in parent.comments:
            if self.data[start:stop].startswith(f"<!-- {marker}".encode()):
                self._edits.append(Edit(start, stop, comment))
                return
        indent = self._indent(parent.children[0]) if parent.children else self._indent(parent) + b"  "
        self._edits.append(Edit(parent.open_end, parent.open_end, self.newline + indent + comment))

    def edited(self) -> bytes:
        """The file with all edits made; every byte outside of them is as it was."""
        pieces, position = [], 0
        for edit in sorted(self._edits, key=lambda edit: edit.start):
            pieces += [self.data[position : edit.start], edit.text]
            position = edit.stop
        return b"".join([*pieces, self.data[position:]])

    def _indent(self, element: Element) -> bytes:
        line_start = self.data.rfind(b"\n", 0, element.start) + 1
        before = self.data[line_start : element.start]
        return before if not before.strip() else b""


def _attribute_text(value: str) -> bytes:
    from xml.sax.saxutils import escape  # loads urllib and ssl

    return escape(value, {'"': "&quot;", "'": "&apos;"}).encode()


def _require_utf8(data: bytes, label: str) -> None:
    """Refuse other encodings: expat would read UTF-16 by itself, and count in other bytes than the file's."""
    start = data.find(b"\0")
    if start < 0:
        try:
            data.decode("utf-8")
        except UnicodeDecodeError as error:
            start = error.start
    if start >= 0:
        line = data.count(b"\n", 0, start) + 1
        raise ExportError(f"{label}:{line}: not UTF-8 text; save the file as UTF-8")


def _parse(data: bytes, label: str) -> Element:
    _require_utf8(data, label)
    parser = expat.ParserCreate("utf-8")
    parser.buffer_text = True
    stack = [Element("", {}, 0, 0)]

    def start_element(name: str, attributes: dict[str, str]) -> None:
        start = parser.CurrentByteIndex
        match = _TAG_END.match(data, start)
        element = Element(name, attributes, start, match.end() if match else start)
        stack[-1].children.append(element)
        stack.append(element)

    def end_element(_name: str) -> None:
        element = stack.pop()
        empty = data[element.open_end - 2 : element.open_end] == b"/>"
        element.close_start = element.open_end if empty else parser.CurrentByteIndex
        element.end = element.open_end if empty else data.index(b">", element.close_start) + 1

    def comment(_text: str) -> None:
        start = parser.CurrentByteIndex
        stack[-1].comments.append((start, data.index(b"-->", start) + 3))

    def doctype(*_declaration: object) -> None:
        raise ExportError(f"{label}: a DOCTYPE is not accepted in a robot description; remove it")

    parser.StartElementHandler = start_element
    parser.EndElementHandler = end_element
    parser.CommentHandler = comment
    parser.StartDoctypeDeclHandler = doctype
    try:
        parser.Parse(data, True)
    except expat.ExpatError as error:
        reason = expat.errors.messages.get(error.code, "unreadable")
        raise ExportError(f"{label}:{error.lineno}: not valid XML: {reason}; correct the file") from None
    return stack[0].children[0]
