"""Physical quantities of a link or a joint that a simulation states wrong."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

# Quantities that no body and no friction has below zero; what is printed is possible.
NEVER_NEGATIVE = frozenset({"mass", "inertia_xx", "inertia_yy", "inertia_zz", "stiction", "viscous"})


@dataclass(frozen=True)
class WrongQuantity:
    """One number of a link or a joint."""

    name: str
    simulation: float | None  # stated value [SI]; None where only a difference is known
    value: float  # value on the arm, or the difference [SI]
    std: float
    unit: str

    @property
    def is_possible(self) -> bool:
        """Whether a body or a joint can have the value."""
        return self.value >= 0.0 or self.name not in NEVER_NEGATIVE

    @property
    def words(self) -> str:
        """Value and stated value."""
        unit = f" {self.unit}"
        digits = 1 - int(np.floor(np.log10(max(self.std, np.finfo(float).tiny))))
        size = f"{round(self.value, digits):.6g} ± {self.std:.2g}{unit}"
        return f"is {size}" if self.simulation is None else f"is {size}, not {self.simulation:.3g}{unit}"


@dataclass(frozen=True)
class WrongValue:
    """Numbers of one link or one joint that explain differences of parameters."""

    link: int | None  # index, from 0; None where it is a joint's
    joint: int | None  # index, from 0; None where it is a link's
    quantities: tuple[WrongQuantity, ...]
    explains: int = 0  # differences that it explains, alone or with others
    among: int = 0  # all differences
    equivalent: tuple[str, ...] = ()  # other quantities that explain as much

    def statement(self, joints: Sequence[str]) -> str:
        """One sentence. `joints`: names of the joints."""
        place = f"link {self.link + 1}" if self.link is not None else joints[self.joint or 0]
        first, *others = self.quantities
        text = f"{_title(first.name)} of {place} {first.words}"
        text += "".join(f"; its {_title(each.name).lower()} {each.words}" for each in others)
        if self.explains > 1 or self.explains == self.among:
            text += f": that explains {_count(self.explains, self.among)}"
        if self.equivalent:
            text += f"; these data cannot tell it from {', '.join(self.equivalent)}"
        return text


TITLES = {
    "stiction": "Coulomb friction",
    "stribeck": "Stribeck friction",
    "viscous": "Viscous friction",
    "offset": "Constant torque",
    **{f"inertia_{pair}": f"Inertia {pair}" for pair in ("xx", "yy", "zz", "xy", "xz", "yz")},
    **{
        f"{name}_{axis}": f"{name} {axis}".replace("_", " ").capitalize()
        for name in ("first_moment", "centre_of_mass")
        for axis in "xyz"
    },
}


def _title(name: str) -> str:
    """A quantity as a noun."""
    if name.startswith("added_"):
        return f"Added {_title(name.removeprefix('added_')).lower()}"
    return TITLES.get(name, name.capitalize())


def _count(explains: int, among: int) -> str:
    """How many differences in words."""
    if explains < among:
        return f"{explains} of {among} differences"
    return {1: "the only difference", 2: "both differences"}.get(among, f"all {among} differences")
