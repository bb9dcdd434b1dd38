"""Where a document came from, so that an error can name its file, line, place and joint."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, TypeVar

from pydantic import ValidationError
from pydantic_core import ErrorDetails

from tauscope.errors import RobotFileError
from tauscope.robot.document_fields import Document
from tauscope.robot.messages import one_line, shown
from tauscope.robot.yaml_text import Place

DocumentType = TypeVar("DocumentType", bound=Document)

# Our words for pydantic's kinds of error.
WORDING: Mapping[str, Callable[[ErrorDetails], str]] = {
    "refused": lambda e: e.get("ctx", {})["text"],
    "missing": lambda e: f"the key {shown(e['loc'][-1])} is missing; add it",
    "model_type": lambda e: f"must be a mapping, but is {shown(e['input'])}",
    "list_type": lambda e: f"must be a list, but is {shown(e['input'])}",
    "too_short": lambda e: "must not be an empty list; leave the key out instead",
    "too_long": lambda e: f"holds more than {e.get('ctx', {})['max_length']} entries",
}


@dataclass(frozen=True)
class DocumentOrigin:
    """The label of a document (its path), its data as read, and the line of every entry where it has lines."""

    label: str
    data: Any
    lines: Mapping[Place, int] = field(default_factory=dict)

    def where(self, place: Place) -> str:
        """Where an entry stands, as ``arm.yaml:12: joints[2].limits.position (joint 3, 'wrist')``."""
        line = self._line(place)
        path = "".join(f"[{step}]" if isinstance(step, int) else f".{step}" for step in place).lstrip(".")
        parts = [self.label if line is None else f"{self.label}:{line}"]
        if path:
            parts.append(path + self._joint(place))
        return ": ".join(parts)

    def error(self, place: Place, text: str) -> RobotFileError:
        """The error of an entry."""
        return RobotFileError(one_line(f"{self.where(place)}: {text}"))

    def validated(self, kind: type[DocumentType]) -> DocumentType:
        """The data as a validated document. Raises RobotFileError naming the first entry that is not valid."""
        if not isinstance(self.data, Mapping):
            raise self.error((), f"must be a mapping with name and kinematics, but is {shown(self.data)}")
        try:
            return kind.model_validate(self.data)
        except ValidationError as error:
            details = error.errors(include_url=False)
        place, text = self._word(details[0])
        more = f" (the first of {len(details)} errors)" if len(details) > 1 else ""
        raise self.error(place, text + more)

    def _word(self, detail: ErrorDetails) -> tuple[Place, str]:
        """Place and words of one of pydantic's errors."""
        place: Place = tuple(detail["loc"])
        key = detail.get("ctx", {}).get("key")
        if key is not None:
            place = (*place, key)
        word = WORDING.get(detail["type"])
        return place, word(detail) if word else detail["msg"]

    def _line(self, place: Place) -> int | None:
        """Line of an entry, or of the nearest mapping that should hold it."""
        for length in range(len(place), -1, -1):
            if place[:length] in self.lines:
                return self.lines[place[:length]]
        return None

    def _joint(self, place: Place) -> str:
        """The joint or link that an entry is about, numbered from 1, with its name where the document gives one."""
        for index, step in enumerate(place):
            if isinstance(step, int) and place[index - 1] in ("joints", "dh", "mdh", "friction", "segments", "links"):
                number, noun = step + 1, "link" if place[index - 1] == "links" else "joint"
                name = self._joint_name(step)
                return f" ({noun} {number})" if name is None else f" ({noun} {number}, {shown(name)})"
        return ""

    def _joint_name(self, index: int) -> str | None:
        """Name of a joint in the data, as far as the data have the right form."""
        joints = self.data.get("joints") if isinstance(self.data, Mapping) else None
        if not isinstance(joints, list) or index >= len(joints) or not isinstance(joints[index], Mapping):
            return None
        name = joints[index].get("name")
        return name if isinstance(name, str) else None
