"""Full parameters of a model: ten of every link, then the joints' coefficients; and how they make its columns."""

from dataclasses import dataclass

import numpy as np

from tauscope.identification.consistency.inequalities import FrictionColumns
from tauscope.identification.structure import ModelStructure
from tauscope.recording.recording import Array


@dataclass(frozen=True, eq=False)
class FullParameters:
    """Θ* = M x, M (p, q): base parameters Θ_L + B Θ_K of the links, then the joints' coefficients as they are."""

    map: Array
    friction: FrictionColumns
    base_count: int

    @staticmethod
    def of(structure: ModelStructure) -> "FullParameters":
        """Those of a model."""
        base, standard = structure.base, 10 * structure.robot.link_count
        own = structure.size - structure.base_count
        full = np.zeros((structure.size, standard + own))
        full[np.arange(structure.base_count), base.independent_columns] = 1.0
        full[: structure.base_count, base.dependent_columns] = base.combination
        full[structure.base_count :, standard:] = np.eye(own)
        shift = standard - structure.base_count

        def places(name: str) -> tuple[int | None, ...]:
            columns = structure.coefficients(name)
            joints = range(structure.robot.joint_count)
            return tuple(columns[joint] + shift if joint in columns else None for joint in joints)

        friction = FrictionColumns(places("stiction"), places("stribeck"), places("viscous"), places("rotor_inertia"))
        return FullParameters(full, friction, structure.base_count)
