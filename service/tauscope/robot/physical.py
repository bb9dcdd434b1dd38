"""Which inertial parameters a rigid body can have, and which it cannot.

A body of positive density has mass m > 0, and the second moments Σ_c = ½ tr(I_c) 1 - I_c of its mass about its centre
are positive semidefinite. In principal moments: none is negative, none exceeds the sum of the other two. The same in
one matrix (Wensing, Kim, Slotine 2018): the pseudo-inertia [[Σ, h], [hᵀ, m]] about any origin is positive semidefinite.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tauscope.robot.finding import Severity
from tauscope.robot.robot import LinkInertia

Array = NDArray[np.float64]

ROUNDING = 1e-3
"""Violation, relative to the moments of inertia, that rounding to four digits can cause: warned of, not refused."""
ROUND_OFF = 1e-9
"""Violation that is float64 arithmetic on numbers of full length: nothing to speak of."""
SMALLEST = float(np.finfo(np.float64).tiny)
"""Below this float64 loses digits, and so does any comparison of moments [kg m²]."""


@dataclass(frozen=True)
class Defect:
    """Why no rigid body has these parameters."""

    severity: Severity
    text: str


def pseudo_inertia(link: LinkInertia) -> Array:
    """The pseudo-inertia [[Σ, h], [hᵀ, m]] with Σ = ½ tr(I) 1 - I, shape (4, 4) [kg m², kg m, kg]."""
    matrix = np.empty((4, 4))
    matrix[:3, :3] = 0.5 * np.trace(link.inertia) * np.eye(3) - link.inertia
    matrix[:3, 3] = matrix[3, :3] = link.first_moment
    matrix[3, 3] = link.mass
    return matrix


def find_defect(link: LinkInertia) -> Defect | None:
    """What makes the parameters impossible for a rigid body, or None where a body can have them."""
    offset = float(np.linalg.norm(link.first_moment))
    if link.mass < 0.0:
        return Defect(Severity.ERROR, f"mass {link.mass:g} kg is negative")
    if link.mass == 0.0 and offset > 0.0:
        return Defect(Severity.ERROR, f"mass is zero but the first moment is {_listed(link.first_moment)} kg m")
    scale = float(np.max(np.abs(link.inertia)))
    if offset == 0.0:
        return _worst(_principal_defects(link.inertia, scale, "about the centre of mass"))
    about_origin = _principal_defects(link.inertia, scale, "about the frame's origin")
    if offset * (offset / link.mass) > 2.0 * scale:
        # A point mass m at distance d has the moment m d² = h²/m; far beyond the entries given, it might overflow.
        text = (
            f"inertia is not positive semidefinite about the centre of mass: mass {link.mass:g} kg with first moment "
            f"{_listed(link.first_moment)} kg m alone makes {offset / link.mass * offset:g} kg m² "
            f"about the frame's origin, where the largest entry is {scale:g} kg m²"
        )
        return _worst([*about_origin, Defect(Severity.ERROR, text)])
    about_centre = _principal_defects(_about_centre(link), scale, "about the centre of mass")
    return _worst([*about_origin, *about_centre])


def _about_centre(link: LinkInertia) -> Array:
    """Inertia about the centre of mass: I_c = I - (hᵀh 1 - h hᵀ)/m, equation (5) reversed."""
    moment = link.first_moment
    centre = moment / link.mass  # before the product, which underflows where the mass is tiny
    return link.inertia - (moment @ centre * np.eye(3) - np.outer(moment, centre))


def _principal_defects(inertia: Array, scale: float, about: str) -> list[Defect]:
    """Principal moments that no body has; `scale` is the size that digits were rounded at [kg m²]."""
    smallest, middle, largest = (float(moment) for moment in np.linalg.eigvalsh(inertia))
    principal = f"principal moments {about} are {smallest:.6g}, {middle:.6g}, {largest:.6g} kg m²"
    sums = f"{smallest:.6g} + {middle:.6g} < {largest:.6g}"
    defects: list[Defect] = []
    for shortfall, text in (
        (-smallest, f"inertia is not positive semidefinite: {principal}"),
        (largest - middle - smallest, f"inertia breaks the triangle inequality: {principal}, and {sums}"),
    ):
        if shortfall > ROUNDING * scale + SMALLEST:
            defects.append(Defect(Severity.ERROR, text))
        elif shortfall > ROUND_OFF * scale + SMALLEST:
            defects.append(Defect(Severity.WARNING, f"{text}, by so little that rounded digits explain it"))
    return defects


def _worst(defects: list[Defect]) -> Defect | None:
    """The first error, or else the first warning."""
    errors = [defect for defect in defects if defect.severity is Severity.ERROR]
    return next(iter([*errors, *defects]), None)


def _listed(vector: Array) -> str:
    """A vector as text."""
    return "[" + ", ".join(f"{value:g}" for value in vector) + "]"
