"""Elements of a URDF: their place for messages, and the numbers in their attributes."""

import math
import re
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tauscope.errors import RobotFileError, one_line
from tauscope.robot.document_fields import LARGEST_NUMBER
from tauscope.robot.kinematics import rotation_of_roll_pitch_yaw
from tauscope.robot.messages import Finding, Severity, shown
from tauscope.robot.robot import Placement

NUMBER = re.compile(r"[-+]?([0-9]+(?:\.[0-9]*)?|\.[0-9]+)([eE][-+]?[0-9]+)?")

# What to do with a file that xacro has not processed.
EXPAND = "expand the file first: pip install xacro; xacro FILE > arm.urdf"
Element = Any  # lxml's `_Element`, which carries no types


def local_name(element: Element) -> str:
    """Name of an element without its namespace; one whose prefix is not declared keeps the prefix."""
    return element.tag.rpartition("}")[2]


def where(label: str, element: Element) -> str:
    """File, line and name of an element, as one line."""
    name = element.get("name")
    return one_line(f"{label}:{element.sourceline}: {local_name(element)}" + (f" {shown(name)}" if name else ""))


def urdf_error(label: str, element: Element, text: str) -> RobotFileError:
    """The error of an element."""
    return RobotFileError(f"{where(label, element)}: {text}")


def children(element: Element, kind: str) -> list[Element]:
    """Child elements of one kind, whatever their namespace."""
    return [child for child in element if isinstance(child.tag, str) and local_name(child) == kind]


def only_child(label: str, element: Element, kind: str, findings: list[Finding]) -> Element | None:
    """The child of one kind, or None; of several the first counts, as in ROS' own parser, and a finding says so."""
    found = children(element, kind)
    if len(found) > 1:
        text = f"holds {len(found)} <{kind}> elements; the first counts, as in ROS' own parser: remove the others"
        findings.append(Finding(Severity.WARNING, where(label, element), text))
    return found[0] if found else None


def number(label: str, element: Element, key: str, default: float | None = None) -> float:
    """A finite number in an attribute, or `default` where it is absent. Raises RobotFileError."""
    text = element.get(key)
    if text is None:
        if default is None:
            raise urdf_error(label, element, f"the attribute {shown(key)} is missing; add it")
        return default
    return _real(label, element, key, text)


def bounded_number(label: str, element: Element, key: str) -> float:
    """A number in an attribute that must be there. Raises RobotFileError beyond 1e9, or where there is none."""
    return _require_bounded(label, element, key, number(label, element, key))


def vector(label: str, element: Element | None, key: str, default: tuple[float, float, float]) -> NDArray[np.float64]:
    """Three numbers in an attribute, shape (3,); `element` is None where it is absent. Raises RobotFileError."""
    text = None if element is None else element.get(key)
    if text is None:
        return np.array(default)
    words = text.split()
    if len(words) != 3:
        raise urdf_error(label, element, f"{key}={shown(text)} must hold three numbers, but holds {len(words)}")
    return np.array([_require_bounded(label, element, key, _real(label, element, key, word)) for word in words])


def origin(label: str, element: Element, findings: list[Finding]) -> Placement:
    """The placement of an element's ``<origin>``, the identity where it has none."""
    node = only_child(label, element, "origin", findings)
    roll, pitch, yaw = (float(angle) for angle in vector(label, node, "rpy", (0.0, 0.0, 0.0)))
    return Placement(rotation_of_roll_pitch_yaw(roll, pitch, yaw), vector(label, node, "xyz", (0.0, 0.0, 0.0)))


def _real(label: str, element: Element, key: str, text: str) -> float:
    """A finite number; Python's own extras (1_0, other digits than 0-9) are refused."""
    value = float(text.strip()) if NUMBER.fullmatch(text.strip()) else math.nan
    if "${" in text or "$(" in text:
        raise urdf_error(label, element, f"{key}={shown(text)} is an expression of xacro; {EXPAND}")
    if not math.isfinite(value):
        raise urdf_error(label, element, f"{key}={shown(text)} is not a finite number; write it plainly, as 0.125")
    return value


def _require_bounded(label: str, element: Element, key: str, value: float) -> float:
    if abs(value) > LARGEST_NUMBER:
        raise urdf_error(label, element, f"{key}={value:g} is beyond {LARGEST_NUMBER:g}; check the unit (SI)")
    return value
