"""XML of a user's file to elements: any encoding, nothing fetched, no entities expanded.

Prefixes that are not declared, as in ``<sensor:camera>`` inside ``<gazebo>``, are kept: ROS' own parser knows no
namespaces. Any other fault of the text is refused by line.
"""

import codecs
import re
from typing import Any

from lxml import etree

from tauscope.errors import RobotFileError, one_line
from tauscope.robot.messages import Finding, Severity
from tauscope.robot.urdf_element import Element

LARGEST_XML = 16 * 1024 * 1024
LONGEST_REASON = 300  # characters of a parser's message, which quotes names of any length from the file

_DECLARATION = re.compile(rb"""^\s*<\?xml[^>]*encoding\s*=\s*["']([A-Za-z0-9._-]{1,40})["']""")
# Byte order marks; that of UTF-32 begins with that of UTF-16.
_MARKS = (
    (codecs.BOM_UTF32_LE, "utf-32"),
    (codecs.BOM_UTF32_BE, "utf-32"),
    (codecs.BOM_UTF16_LE, "utf-16"),
    (codecs.BOM_UTF16_BE, "utf-16"),
)


def is_xml(data: bytes) -> bool:
    """Whether a file's first character is that of XML."""
    encoding = _marked_encoding(data) or "utf-8"
    return data[:256].decode(encoding, errors="replace").lstrip("\ufeff \t\r\n").startswith("<")


def parse_xml(data: bytes, label: str, findings: list[Finding]) -> Element:
    """The root element. Raises RobotFileError where it is not well-formed, or holds a DOCTYPE with its entities."""
    text = decode_xml(data, label, findings)
    doctype = text.find("<!DOCTYPE")
    if doctype >= 0:
        line = text.count("\n", 0, doctype) + 1
        raise RobotFileError(f"{label}:{line}: a DOCTYPE is not accepted in a robot description; remove it")
    closed: dict[str, Any] = {"resolve_entities": False, "no_network": True, "load_dtd": False, "huge_tree": False}
    parser = etree.XMLParser(encoding="utf-8", remove_comments=True, remove_pis=True, recover=True, **closed)
    try:
        root = etree.fromstring(text.encode("utf-8"), parser)
    except etree.XMLSyntaxError as error:
        raise RobotFileError(f"{label}:{error.lineno or 1}: not valid XML: {error.msg[:LONGEST_REASON]}") from None
    except (ValueError, MemoryError) as error:
        raise RobotFileError(f"{label}: not valid XML: {error}") from error
    for fault in parser.error_log:
        if fault.domain != etree.ErrorDomains.NAMESPACE:
            raise RobotFileError(f"{label}:{fault.line or 1}: not valid XML: {fault.message[:LONGEST_REASON]}")
    if root is None:
        raise RobotFileError(f"{label}: not valid XML: it has no elements")
    return root


def decode_xml(data: bytes, label: str, findings: list[Finding]) -> str:
    """Text by byte order mark, as UTF-8, by its declaration, or as Latin-1 with a finding. Raises RobotFileError."""
    declared = _DECLARATION.match(data[:200])
    marked = _marked_encoding(data)
    stated = None if declared is None else declared[1].decode("ascii")
    text = None
    for encoding in (marked,) if marked else ("utf-8", stated, "latin-1"):
        try:
            text = None if encoding is None else data.decode(encoding)
        except (UnicodeError, LookupError):
            continue
        if text is not None:
            break
    text = None if text is None else text.rstrip("\0")  # as C ends a string, and as ROS reads it
    if text is None or "\0" in text:
        raise RobotFileError(f"{label}: is not text; is it the right file?")
    if encoding == "latin-1" and (stated or "").lower() not in ("latin-1", "iso-8859-1"):
        line = data.count(b"\n", 0, next(i for i, byte in enumerate(data) if byte > 127)) + 1
        text_of = "holds bytes that are not UTF-8; the file is read as Latin-1"
        findings.append(Finding(Severity.INFO, one_line(f"{label}:{line}"), text_of))
    # The declaration's encoding no longer holds.
    return re.sub(
        r"^\s*<\?xml[^>]*\?>", lambda found: "\n" * found[0].count("\n"), text.removeprefix("\ufeff"), count=1
    )


def _marked_encoding(data: bytes) -> str | None:
    """Encoding that a byte order mark of UTF-16 or UTF-32 states."""
    return next((encoding for mark, encoding in _MARKS if data.startswith(mark)), None)
