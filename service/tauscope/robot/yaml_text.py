"""YAML text to plain data, with the line of every entry; nothing that YAML can hide is accepted.

Aliases are expanded up to a bound, duplicate keys, merge keys, tags and keys that are not text are refused.
"""

from dataclasses import dataclass
from typing import Any

from ruamel.yaml import YAML
from ruamel.yaml.composer import Composer
from ruamel.yaml.error import MarkedYAMLError, YAMLError
from ruamel.yaml.nodes import MappingNode, ScalarNode, SequenceNode

from tauscope.errors import RobotFileError
from tauscope.robot.messages import shown

DEEPEST = 24
MOST_ENTRIES = 10_000
TAG = "tag:yaml.org,2002:"
TRUE = frozenset({"true", "yes", "on", "y"})
FALSE = frozenset({"false", "no", "off", "n"})

Place = tuple[str | int, ...]  # keys and indices that lead from the document's root to an entry


@dataclass(frozen=True)
class YamlContent:
    """Plain data of a YAML document."""

    data: Any
    lines: dict[Place, int]  # for each entry's place the line, from 1, on which it stands


class _TooMuchError(Exception):
    """The document is too large or too deep; `args` holds the reason and the line."""


class _BoundedComposer(Composer):
    """ruamel's composer, giving up at the bounds instead of after minutes."""

    def __init__(self, loader: Any = None) -> None:
        super().__init__(loader=loader)
        self.warn_double_anchors = False
        self.entries = 0
        self.open_nodes = 0

    def compose_node(self, parent: Any, index: Any) -> Any:
        line = self.parser.peek_event().start_mark.line + 1
        self.entries += 1
        if self.entries > MOST_ENTRIES:
            raise _TooMuchError(f"more than {MOST_ENTRIES} entries", line)
        if self.open_nodes >= DEEPEST:
            raise _TooMuchError(f"nested deeper than {DEEPEST} levels", line)
        self.open_nodes += 1
        try:
            return super().compose_node(parent, index)
        finally:
            self.open_nodes -= 1


def read_yaml(text: str, label: str) -> YamlContent:
    """Plain data of one YAML document. Raises RobotFileError where it is not one, well-formed."""
    root = _compose(text, label)
    if root is None:
        raise RobotFileError(f"{label}: the file holds no entries")
    builder = _PlainBuilder(label)
    data = builder.value(root, (), root.start_mark.line + 1)
    return YamlContent(data, builder.lines)


def _compose(text: str, label: str) -> Any:
    yaml = YAML(typ="safe", pure=True)
    yaml.Composer = _BoundedComposer
    try:
        return yaml.compose(text)
    except _TooMuchError as error:
        reason, line = error.args
        raise RobotFileError(f"{label}:{line}: {reason}; this is no robot file") from None
    except MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        where = f"{label}:{mark.line + 1}" if mark is not None else label
        reason = error.problem or error.context or "malformed"
        raise RobotFileError(f"{where}: not valid YAML: {reason}") from None
    except (YAMLError, RecursionError) as error:
        raise RobotFileError(f"{label}: not valid YAML: {error}") from None
    except Exception as error:
        # ruamel lets builtins escape on malformed text: OverflowError for "\UFFFFFFFF", AttributeError, AssertionError.
        raise RobotFileError(f"{label}: not valid YAML: {error or type(error).__name__}") from error


class _PlainBuilder:
    """Nodes to plain data; aliases count each time that they are used."""

    def __init__(self, label: str) -> None:
        self.label = label
        self.lines: dict[Place, int] = {}
        self.entries = 0

    def value(self, node: Any, place: Place, line: int) -> Any:
        self.entries += 1
        if self.entries > MOST_ENTRIES or len(place) > DEEPEST:
            raise self._error(line, "aliases (*name) expand without end; write the entries out")
        self.lines[place] = line
        if isinstance(node, MappingNode) and node.tag == TAG + "map":
            return self._mapping(node, place)
        if isinstance(node, SequenceNode) and node.tag == TAG + "seq":
            return [self.value(item, (*place, i), item.start_mark.line + 1) for i, item in enumerate(node.value)]
        if isinstance(node, ScalarNode):
            return self._scalar(node, line)
        raise self._error(line, f"the tag {shown(str(node.tag))} is not accepted; write plain data")

    def _mapping(self, node: MappingNode, place: Place) -> dict[str, Any]:
        result: dict[str, Any] = {}
        for key_node, value_node in node.value:
            line = key_node.start_mark.line + 1
            if key_node.tag == TAG + "merge":
                raise self._error(line, "merge keys (<<) are not accepted; write the entries out")
            key = self._scalar(key_node, line) if isinstance(key_node, ScalarNode) else None
            if not isinstance(key, str):
                raise self._error(line, "a key must be text; put it in quotes")
            if key in result:
                first = self.lines[(*place, key)]
                raise self._error(line, f"the key {shown(key)} stands twice, first on line {first}; remove one")
            result[key] = self.value(value_node, (*place, key), line)
        return result

    def _scalar(self, node: ScalarNode, line: int) -> Any:
        kind, text = str(node.tag).removeprefix(TAG), str(node.value)
        if kind in {"str", "timestamp", "value"}:
            return text
        if kind == "null":
            return None
        if kind == "bool" and text.lower() in TRUE | FALSE:
            return text.lower() in TRUE
        try:
            if kind == "int":
                return int(text.replace("_", ""), 0)  # what YAML 1.1 and 1.2 read differently is refused: 010, 1:30
            if kind == "float":
                return float(text.replace("_", "").lower().replace(".inf", "inf").replace(".nan", "nan"))
        except ValueError:
            raise self._error(line, f"{shown(text)} cannot be read as a number; write it plainly, as 12.5") from None
        raise self._error(line, f"the tag {shown(str(node.tag))} is not accepted; write plain data")

    def _error(self, line: int, text: str) -> RobotFileError:
        return RobotFileError(f"{self.label}:{line}: {text}")
