"""The reference page of the catalogue: `python tests/effects/write_catalogue.py` writes it anew from the classes."""

import re
import sys
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).parents[2]
PAGE = ROOT / "docs" / "reference" / "effects.md"

HEAD = """# Effects that a diagnosis looks for

Written by `tests/effects/write_catalogue.py` from the classes in `service/tauscope/effects`; a test holds the two
together. Torques are signed as what the drive has to overcome in addition: measured = rigid bodies + friction + effect.
`sgn` is smoothed, (2/π) atan(K_v q̇). `{tau}` and `{q}` are the joint's own units: Nm and rad, or N and m.

*How found*: **searched** beside the identified model; **compared**: only against a given model (`--against`), or where
the robot file declares friction and no constant (`torque_offset`).

| id | meaning | torque | parameters | how found | revealed by | what to do |
|---|---|---|---|---|---|---|
"""

TAIL = """
`unknown` is no effect but a verdict on one joint: significant, located (`mismatch`), and explained by nothing above.

Where recordings hold `qlink`, `joint_elasticity` and `backlash` are measured from `q - qlink`, and are not searched in
the torque of those joints. Where they hold `temp`, `friction_drift` follows it:
`tau = (f sgn(qd) + w qd) (1 - exp(-r (T - T_0))) / r`.

A plugin adds an effect: a subclass of `tauscope.effects.Effect`, entry point group `tauscope.effects`.
"""


def page_text() -> str:
    """The page of the present code."""
    return HEAD + "".join(_rows()) + TAIL


def _rows() -> Iterator[str]:
    from tauscope.effects import catalogue

    for effect in sorted(catalogue(), key=lambda each: each.id):
        found = "searched" if effect.screened else "compared"
        shapes = [shape for shape in effect.shapes if shape.reported]
        sizes = ", ".join(f"`{each.name}` [{each.unit}]" for each in (*effect.coefficients, *shapes))
        equation = re.sub(r"\|([^|]+)\|", r"abs(\1)", effect.equation)  # a bar would end the table's cell
        cells = (
            f"`{effect.id}`",
            effect.meaning,
            f"`{equation}`",
            sizes,
            found,
            effect.revealing_motion,
            effect.remedy,
        )
        yield f"| {' | '.join(cells)} |\n"


if __name__ == "__main__":
    sys.path.insert(0, str(ROOT))
    PAGE.write_text(page_text(), encoding="utf-8")
