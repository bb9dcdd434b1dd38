"""Which inertial parameters a rigid body can have, and the body nearest to those that none can have.

A body of positive density has mass m > 0, and the second moments Σ_c = ½ tr(I_c) 1 - I_c of its mass about its centre
are positive semidefinite. In principal moments: none is negative, none exceeds the sum of the other two. The same in
one matrix (Wensing, Kim, Slotine 2018): the pseudo-inertia [[Σ, h], [hᵀ, m]] about any origin is positive semidefinite.
Its limit, inertia without mass, counts as a body: some robot files state motors so.
"""

import numpy as np

from tauscope.result_warning import ResultWarning
from tauscope.robot.document_fields import LARGEST_NUMBER
from tauscope.robot.robot import Array, JointType, LinkInertia, Robot

# Violation, relative to the moments of inertia, that rounding to four digits can cause: repaired without a word.
ROUNDING = 1e-3
ROUND_OFF = 1e-9  # violation that is float64 arithmetic on numbers of full length: left as it is
# Below this float64 loses digits, and so does any comparison of moments [kg m²].
SMALLEST = float(np.finfo(np.float64).tiny)


def pseudo_inertia(link: LinkInertia) -> Array:
    """The pseudo-inertia [[Σ, h], [hᵀ, m]] with Σ = ½ tr(I) 1 - I, shape (4, 4) [kg m², kg m, kg]."""
    matrix = np.empty((4, 4))
    matrix[:3, :3] = 0.5 * np.trace(link.inertia) * np.eye(3) - link.inertia
    matrix[:3, 3] = matrix[3, :3] = link.first_moment
    matrix[3, 3] = link.mass
    return matrix


def find_defect(link: LinkInertia, tolerance: float = ROUNDING) -> str | None:
    """Why no rigid body has these parameters, by more than a share of its largest inertia; None where one can."""
    offset = float(np.linalg.norm(link.first_moment))
    if link.mass < 0.0:
        return f"mass {link.mass:g} kg is negative"
    if link.mass == 0.0 and offset > 0.0:
        return f"mass is zero but the first moment is {_list(link.first_moment)} kg m"
    scale = float(np.max(np.abs(link.inertia)))
    allowed = tolerance * scale + SMALLEST
    if offset == 0.0:
        return _principal_defect(link.inertia, allowed, "about the centre of mass")
    about_origin = _principal_defect(link.inertia, allowed, "about the frame's origin")
    if about_origin is None and offset * (offset / link.mass) > 2.0 * scale:
        # A point mass m at distance d has the moment m d² = h²/m; far beyond the entries given, it might overflow.
        return (
            f"inertia is not positive semidefinite about the centre of mass: mass {link.mass:g} kg with first moment "
            f"{_list(link.first_moment)} kg m alone makes {offset / link.mass * offset:g} kg m² "
            f"about the frame's origin, where the largest entry is {scale:g} kg m²"
        )
    return about_origin or _principal_defect(about_centre(link), allowed, "about the centre of mass")


def nearest_body(link: LinkInertia) -> LinkInertia:
    """The nearest body; the link itself where a body can have its parameters.

    min ‖A⁻¹ (J - J₀) A⁻ᵀ‖_F over J ⪰ 0, A Aᵀ the pseudo-inertia of a compact body about the same centre of mass, or
    without a mass at the origin: negative eigenvalues of A⁻¹ J₀ A⁻ᵀ become zero (Higham 1988), mass and centre stay.
    """
    if find_defect(link, ROUND_OFF) is None:
        return link
    offset = float(np.linalg.norm(link.first_moment))
    if offset > 0.0 and not offset * offset <= LARGEST_NUMBER * abs(link.mass):
        return _nearest_without_centre(link, offset)
    inertia = about_centre(link)
    values, axes = np.linalg.eigh(0.5 * np.trace(inertia) * np.eye(3) - inertia)
    added = (axes * np.maximum(-values, 0.0)) @ axes.T
    added_inertia = np.trace(added) * np.eye(3) - added
    if link.mass < 0.0:
        return LinkInertia(0.0, np.zeros(3), inertia + added_inertia)
    return LinkInertia(link.mass, link.first_moment, link.inertia + added_inertia)


def repair_text(stated: LinkInertia, body: LinkInertia) -> str | None:
    """Why no body has the stated parameters, and the numbers before and after; None where rounding explains it."""
    defect = find_defect(stated)
    if defect is None:
        return None
    changes = [] if stated.mass == body.mass else [f"mass {stated.mass:g} → {body.mass:g} kg"]
    if np.array_equal(stated.first_moment, body.first_moment):
        about, inertias = "centre of mass", [about_centre(stated), about_centre(body)]
    else:
        changes.append(f"first moment {_list(stated.first_moment)} → {_list(body.first_moment)} kg m")
        about, inertias = "frame's origin", [stated.inertia, body.inertia]
    before, after = (_list(_principal_moments(inertia)) for inertia in inertias)
    if before != after:
        changes.append(f"principal moments {before} → {after} kg m² about the {about}")
    return f"{defect}; the nearest body is used: {', '.join(changes)}"


def about_centre(link: LinkInertia) -> Array:
    """Inertia about the centre of mass, (3, 3): I_c = I - (hᵀh 1 - h hᵀ)/m, (5) reversed; I without mass."""
    if link.mass == 0.0:
        return link.inertia
    moment = link.first_moment
    centre = moment / link.mass  # before the product, which underflows where the mass is tiny
    return link.inertia - (moment @ centre * np.eye(3) - np.outer(moment, centre))


def _nearest_without_centre(link: LinkInertia, offset: float) -> LinkInertia:
    """The nearest body of the size that second and first moments make together; no such size: no first moment."""
    pseudo = pseudo_inertia(link)
    size = float(np.linalg.norm(pseudo[:3, :3])) / offset
    if not SMALLEST < size * size < LARGEST_NUMBER:
        return nearest_body(LinkInertia(0.0, np.zeros(3), link.inertia))
    unit = np.array([size] * 3 + [1.0])
    values, axes = np.linalg.eigh(pseudo / np.outer(unit, unit))
    nearest = (axes * np.maximum(values, 0.0)) @ axes.T * np.outer(unit, unit)
    second = nearest[:3, :3]
    return LinkInertia(float(nearest[3, 3]), nearest[:3, 3], np.trace(second) * np.eye(3) - second)


def _principal_defect(inertia: Array, allowed: float, about: str) -> str | None:
    """Principal moments that no body has, beyond what is allowed [kg m²]."""
    smallest, middle, largest = _principal_moments(inertia)
    if -smallest > allowed:
        moments = f"{smallest:.6g}, {middle:.6g}, {largest:.6g}"
        return f"inertia is not positive semidefinite: principal moments {about} are {moments} kg m²"
    if largest - middle - smallest > allowed:
        sums = f"{smallest:.6g} + {middle:.6g} < {largest:.6g}"
        return f"inertia breaks the triangle inequality: {sums} kg m², the principal moments {about}"
    return None


def _principal_moments(inertia: Array) -> Array:
    """Principal moments in ascending order, round-off as zero [kg m²]."""
    moments = np.linalg.eigvalsh(inertia)
    return np.where(np.abs(moments) > ROUND_OFF * np.max(np.abs(moments)), moments, 0.0)


def _list(vector: Array) -> str:
    return "[" + ", ".join(f"{value:g}" for value in vector) + "]"


MOST_TURNS, LONGEST_CHAIN = 4.0, 20.0  # of a limited revolute joint, either way, and of an arm [m]
DENSEST, SHORTEST = 5000.0, 0.3  # mass by the cube of the reach [kg/m³], of an arm of this length at least [m]


def doubt_units(robot: Robot, label: str) -> tuple[ResultWarning, ...]:
    """Limits in degrees, lengths in mm and masses in g, as drawing programs write them."""
    parts = [part.translation for each in robot.segments for part in (each.before, each.after)]
    reach = float(np.linalg.norm(parts, axis=1).sum())
    size = max(reach, SHORTEST)
    limits = [joint.limits.position or (0.0, 0.0) for joint in robot.joints if joint.type is JointType.REVOLUTE]
    turns = max((max(map(abs, limit)) / (2.0 * np.pi) for limit in limits), default=0.0)
    mass = sum(link.mass for link in robot.model.links or ())
    doubts = (
        (turns > MOST_TURNS, f"a revolute joint is limited to {turns:.4g} turns", "limits in rad"),
        (reach > LONGEST_CHAIN, f"the chain is {reach:.4g} m long", "lengths in m"),
        (mass > DENSEST * size**3, f"an arm of {reach:.3g} m weighs {mass:.4g} kg", "masses in kg"),
    )
    return tuple(
        ResultWarning(
            code="doubtful-units", text=f"{label}: {text}", remedy=f"state {remedy} in the robot's description"
        )
        for is_doubtful, text, remedy in doubts
        if is_doubtful
    )
