"""Ways in which the stated inertial parameters of one link can be wrong, each as few numbers.

A change x(β) of a link's ten standard parameters is a number by itself, as in a robot file with a wrong digit; a mass
whose centre of mass and central inertia are right (URDF), or whose inertia scales with it; another centre of mass, all
first moments, all moments of inertia; a point mass at any place of the link; or all ten.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import numpy as np

from tauscope.effects.carried_body import unit_body
from tauscope.recording.recording import Array
from tauscope.robot import LinkInertia
from tauscope.robot.robot import STANDARD_PARAMETERS

SIZE = len(STANDARD_PARAMETERS)
MASS = STANDARD_PARAMETERS.index("m")
MOMENTS = slice(MASS + 1, SIZE)
INERTIAS = slice(0, MASS)
AXES = ("x", "y", "z")
# Names of the ten standard parameters, in their order.
QUANTITIES = (
    *(f"inertia_{name[1:]}" for name in STANDARD_PARAMETERS[INERTIAS]),
    "mass",
    *(f"first_moment_{axis}" for axis in AXES),
)
UNITS = (*["kg m²"] * 6, "kg", *["kg m"] * 3)
# Distance from a link's origin at which things are fixed to it, as a weak prior where torque does not show it [m].
USUAL_M = 0.3


@dataclass(frozen=True, eq=False)
class LinkChange:
    """One way in which the parameters of a link can be wrong."""

    link: int
    quantities: tuple[str, ...]  # names of the changed quantities
    spread: Array  # (k,), standard deviations believed of β
    change: Callable[[Array], Array]  # x, the change (10,) of the standard parameters, from β (k,)
    is_linear: bool = True  # whether x is linear in β
    is_point_mass: bool = False
    stated_mass: float | None = None  # mass of the link before the change [kg]; None where it is not known

    @property
    def is_whole(self) -> bool:
        """Whether all ten numbers may be wrong."""
        return self.quantities == QUANTITIES

    def is_possible(self, values: Array) -> bool:
        """Whether the link keeps a positive mass; ten free numbers do not all mean what they say. `values`: (k,), β."""
        return self.is_whole or self.stated_mass is None or self.stated_mass + self.change(values)[MASS] >= 0.0

    def slope(self, values: Array) -> Array:
        """∂x/∂β, (10, k), exact for polynomials of second degree. `values`: (k,), β."""
        steps = 1e-3 * np.diag(self.spread)
        pairs = [self.change(values + step) - self.change(values - step) for step in steps]
        return np.stack(pairs, axis=1) / (2e-3 * self.spread)

    @property
    def title(self) -> str:
        """Its quantities and its link in words."""
        kinds = dict.fromkeys(name.rsplit("_", 1)[0].replace("_", " ") for name in self.quantities)
        return f"{' and '.join(kinds)} of link {self.link + 1}"


def link_changes(link: int, stated: Array | None, spread: Array) -> Iterator[LinkChange]:
    """All ways in which one link of `stated`, (10,), believed within `spread`, (10, 10), can be wrong."""
    mass = None if stated is None else float(stated[MASS])
    return (replace(each, stated_mass=mass) for each in _changes(link, stated, spread))


def _changes(link: int, stated: Array | None, spread: Array) -> Iterator[LinkChange]:
    """The same without the stated mass."""
    std = np.sqrt(np.diag(spread))
    unit = np.eye(SIZE)
    for place, name in enumerate(QUANTITIES):
        yield LinkChange(link, (name,), std[[place]], _along(unit[:, [place]]))
    yield LinkChange(link, QUANTITIES[MOMENTS], std[MOMENTS], _along(unit[:, MOMENTS]))
    yield LinkChange(link, QUANTITIES[INERTIAS], std[INERTIAS], _along(unit[:, INERTIAS]))
    yield LinkChange(link, QUANTITIES, std, _along(unit))
    reach = np.maximum(std[MOMENTS] / std[MASS], USUAL_M)
    body = ("mass", *(f"centre_of_mass_{axis}" for axis in AXES))
    spreads = np.append(std[MASS], reach)
    yield LinkChange(link, body, spreads, lambda at: at[0] * unit_body(at[1:]), is_linear=False, is_point_mass=True)
    if stated is None or stated[MASS] <= 0.0:
        return
    mass, centre = float(stated[MASS]), stated[MOMENTS] / stated[MASS]
    scale, at_centre = stated / stated[MASS], unit_body(centre)
    yield LinkChange(link, ("mass",), std[[MASS]], _along(scale[:, None]))
    yield LinkChange(link, ("mass",), std[[MASS]], _along(at_centre[:, None]))
    yield LinkChange(link, body[1:], reach, lambda by: mass * (unit_body(centre + by) - at_centre), is_linear=False)


def _along(columns: Array) -> Callable[[Array], Array]:
    return lambda values: columns @ values


def stated_links(links: tuple[LinkInertia, ...]) -> Array:
    """Standard parameters of all links, (10 n,)."""
    return np.concatenate([link.to_vector() for link in links])
