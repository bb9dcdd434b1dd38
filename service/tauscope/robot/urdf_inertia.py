"""Inertials of a URDF: each `<inertial>` checked, and bodies that move as one added up."""

from collections.abc import Iterable

import numpy as np

from tauscope.robot.kinematics import compose
from tauscope.robot.messages import Finding, Severity, shown
from tauscope.robot.physical import nearest_body, repair_text
from tauscope.robot.robot import LinkInertia, Placement, Repair
from tauscope.robot.urdf_element import Element, bounded_number, number, only_child, origin, where
from tauscope.robot.urdf_xml import UrdfTree

ENTRIES = ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")


def inertia_about_frame(mass: float, centre: Placement, inertia: np.ndarray) -> LinkInertia:
    """Parameters about a link frame, (5): I' = R I Rᵀ + m (sᵀs 1 - s sᵀ); `inertia`: (3, 3) [kg m²]."""
    s, rotation = centre.translation, centre.rotation
    shifted = rotation @ inertia @ rotation.T + mass * (s @ s * np.eye(3) - np.outer(s, s))
    return LinkInertia(mass, mass * s, 0.5 * (shifted + shifted.T))


def lumped_inertia(
    label: str, link: int, bodies: Iterable[tuple[Element, Placement]], findings: list[Finding]
) -> tuple[LinkInertia | None, list[Repair]]:
    """Sum of the inertials of bodies that move with link `link`, each at its placement; None where none has any.

    Raises RobotFileError if an `<inertial>` is incomplete or not made of numbers.
    """
    vectors, repairs = [], []
    for body, placement in bodies:
        element = only_child(label, body, "inertial", findings)
        if element is None:
            continue
        stated = _read_inertia(label, body, element, findings)
        centre = compose(placement, origin(label, element, findings))
        used = nearest_body(stated)
        before, after = (inertia_about_frame(each.mass, centre, each.inertia) for each in (stated, used))
        place = f"{where(label, element)} of link {shown(body.get('name'))}"
        if text := repair_text(stated, used):
            repairs.append(Repair(link, place, text, "correct the <inertial>", before, after))
        else:
            _remark(place, stated, findings)
        vectors.append(after.to_vector())
    return LinkInertia.from_vector(np.sum(vectors, axis=0)) if vectors else None, repairs


def stated_mass(tree: UrdfTree, link: str) -> float:
    """Mass of a link and of everything that hangs on it [kg], as the file states it."""
    total, waiting = 0.0, [link]
    while waiting:
        name = waiting.pop()
        element = only_child(tree.label, tree.links[name], "inertial", [])
        mass = None if element is None else only_child(tree.label, element, "mass", [])
        total += 0.0 if mass is None else number(tree.label, mass, "value", 0.0)
        waiting += [joint.child for joint in tree.child_joints.get(name, ())]
    return total


def _read_inertia(label: str, body: Element, element: Element, findings: list[Finding]) -> LinkInertia:
    """An `<inertial>` as it stands, about the centre of mass."""
    parts = {kind: only_child(label, element, kind, findings) for kind in ("mass", "inertia")}
    place = f"{where(label, element)} of link {shown(body.get('name'))}"
    for kind, part in parts.items():
        if part is None:
            findings.append(Finding(Severity.WARNING, place, f"has no <{kind}>, which counts as zero; add it"))
    mass = 0.0 if parts["mass"] is None else bounded_number(label, parts["mass"], "value")
    if parts["inertia"] is None:
        return LinkInertia(mass, np.zeros(3), np.zeros((3, 3)))
    xx, xy, xz, yy, yz, zz = (bounded_number(label, parts["inertia"], key) for key in ENTRIES)
    return LinkInertia(mass, np.zeros(3), np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]))


def _remark(place: str, stated: LinkInertia, findings: list[Finding]) -> None:
    if stated.mass == 0.0 and np.any(stated.inertia):
        findings.append(Finding(Severity.WARNING, place, "has inertia but no mass, as no body has; add the mass"))
    elif stated.mass > 0.0 and not np.any(stated.inertia):
        text = f"has mass {stated.mass:g} kg but no inertia, a point mass; some simulators refuse that"
        findings.append(Finding(Severity.INFO, place, text))
