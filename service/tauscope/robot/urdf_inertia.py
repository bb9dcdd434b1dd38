"""Inertials of a URDF: each `<inertial>` checked, and bodies that move as one added up."""

from collections.abc import Iterable

import numpy as np

from tauscope.robot.finding import Finding, Severity
from tauscope.robot.messages import one_line, shown
from tauscope.robot.physical import find_defect
from tauscope.robot.placement import compose
from tauscope.robot.robot import LinkInertia, Placement
from tauscope.robot.urdf_element import Element, bounded_number, only_child, origin, urdf_error, where

ENTRIES = ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")


def inertia_about_frame(mass: float, centre: Placement, inertia: np.ndarray) -> LinkInertia:
    """Inertial parameters about a link frame, equation (5): I' = R I Rᵀ + m (sᵀs 1 - s sᵀ).

    Parameters
    ----------
    mass : float
        m [kg]
    centre : Placement
        the centre-of-mass frame seen from the link frame: R and s [m]
    inertia : (3, 3) float64
        I about the centre of mass, in the centre-of-mass frame [kg m²]
    """
    s, rotation = centre.translation, centre.rotation
    shifted = rotation @ inertia @ rotation.T + mass * (s @ s * np.eye(3) - np.outer(s, s))
    return LinkInertia(mass, mass * s, 0.5 * (shifted + shifted.T))


def lumped_inertia(
    label: str, bodies: Iterable[tuple[Element, Placement]], findings: list[Finding]
) -> LinkInertia | None:
    """Sum of the inertials of the bodies that move with one link, or None where none of them has an `<inertial>`.

    Parameters
    ----------
    bodies : iterable of (Element, Placement)
        link elements, with the placement of each in the frame of the link that they move with

    Raises
    ------
    RobotFileError
        if an `<inertial>` is incomplete or not made of numbers
    """
    vectors = [
        inertial.to_vector()
        for body, placement in bodies
        if (inertial := _body_inertia(label, body, placement, findings)) is not None
    ]
    return LinkInertia.from_vector(np.sum(vectors, axis=0)) if vectors else None


def _body_inertia(label: str, body: Element, placement: Placement, findings: list[Finding]) -> LinkInertia | None:
    """The `<inertial>` of one link element, about the frame at the far end of `placement`."""
    element = only_child(label, body, "inertial", findings)
    if element is None:
        return None
    parts = {kind: only_child(label, element, kind, findings) for kind in ("mass", "inertia")}
    for kind, part in parts.items():
        if part is None:
            raise urdf_error(label, element, f"of link {shown(body.get('name'))} has no <{kind}>; add it")
    mass = bounded_number(label, parts["mass"], "value")
    xx, xy, xz, yy, yz, zz = (bounded_number(label, parts["inertia"], key) for key in ENTRIES)
    inertia = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    _remark(label, body, element, LinkInertia(mass, np.zeros(3), inertia), findings)
    return inertia_about_frame(mass, compose(placement, origin(label, element, findings)), inertia)


def _remark(label: str, body: Element, element: Element, about_centre: LinkInertia, findings: list[Finding]) -> None:
    """Add what is wrong or doubtful about one body."""
    place = one_line(f"{where(label, element)} of link {shown(body.get('name'))}")
    defect = find_defect(about_centre)
    if defect is not None:
        findings.append(Finding(defect.severity, place, f"{defect.text}; correct the <inertial>"))
    elif about_centre.mass == 0.0 and np.any(about_centre.inertia):
        findings.append(Finding(Severity.WARNING, place, "has inertia but no mass, as no body has; add the mass"))
    elif about_centre.mass > 0.0 and not np.any(about_centre.inertia):
        text = f"has mass {about_centre.mass:g} kg but no inertia, a point mass; some simulators refuse that"
        findings.append(Finding(Severity.INFO, place, text))
