"""Names of robots and joints inside source code: whatever they hold, the code stays code."""

import re
import unicodedata

_PLAIN = frozenset("ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789 ._,:;()+=@#%/-")
"""Characters that end no comment and no string, and start no trigraph, in C, C++ or Python."""


def identifier(name: str) -> str:
    """A name as a lower-case identifier that C, C++ and Python accept as the beginning of a longer one."""
    ascii_name = unicodedata.normalize("NFKD", name).encode("ascii", "ignore").decode("ascii").lower()
    words = re.sub(r"[^a-z0-9]+", "_", ascii_name).strip("_")[:60].strip("_")
    if not words:
        return "robot"
    return words if words[0].isalpha() else f"robot_{words}"


def comment_text(text: str) -> str:
    """Text as it may stand in a comment of any of the languages: one line of plain ASCII."""
    return "".join(c if c in _PLAIN else f"<U+{ord(c):04X}>" for c in text)


def c_string(text: str) -> str:
    """Text as a C string literal in UTF-8, all but letters, digits and a few signs as three-digit octal escapes."""
    data = text.replace("\0", "\ufffd").encode("utf-8", "replace")
    return '"' + "".join(chr(b) if chr(b) in _PLAIN else f"\\{b:03o}" for b in data) + '"'
