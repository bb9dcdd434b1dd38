"""The friction's shape constants as parameters: how torque answers to them, and their last refinement.

∂τ/∂log K = c · K · ∂A(K q̇)/∂K, with c the coefficient that the constant shapes. With these columns beside the linear
ones, a Gauss–Newton step improves all constants of all joints at once, and the covariance tells what they leave
uncertain.
"""

from collections.abc import Iterable, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from tauscope.dynamics.friction import smooth_sign_slope
from tauscope.identification.dataset import PreparedMotion
from tauscope.identification.friction_shape import gentle_range
from tauscope.identification.structure import ModelStructure
from tauscope.recording.recording import Array

# Joint index and ``k_v`` or ``delta``: a shape constant that was estimated, as its logarithm.
ShapeParameter = tuple[int, str]
LARGEST_STEP = 0.3  # change of a constant's logarithm in one step, about half the way to the next grid point and a bit
# A K_v whose logarithm wants to move further than this from where its profile peaked is left there. A δ may go wherever
# it stands for a term of its own: its profile was taken beside a K_v of the grid, which displaces its peak.
LARGEST_CHANGE = 0.7
SETTLED = 1e-3
STEPS = 10


def columns_with_shapes(
    prepared: PreparedMotion, structure: ModelStructure, joint: int, parameters: Array, shapes: Sequence[ShapeParameter]
) -> tuple[Array, NDArray[np.intp]]:
    """A joint's columns (k, M), those of its estimated shape constants last, and their global places (k,).

    `parameters`: (p,), the coefficients, for the amplitudes c.
    """
    columns = prepared.joint_columns(structure, joint)
    index = structure.joint_columns(joint)
    own = [(place, name) for place, (owner, name) in enumerate(shapes) if owner == joint]
    if not own:
        return columns, index
    velocity = prepared.motion.velocity[:, joint]
    rows = []
    for _, name in own:
        value = _constant(structure, joint, name)
        coefficient = structure.coefficient(joint, "stiction" if name == "k_v" else "stribeck")
        amplitude = 0.0 if coefficient is None else parameters[coefficient]
        rows.append(amplitude * value * smooth_sign_slope(velocity, value))
    sensitivity = prepared.motion.band.reduce(np.stack(rows))
    places = structure.size + np.array([place for place, _ in own])
    return np.concatenate([columns, sensitivity]), np.concatenate([index, places])


def refine_structure(
    motions: Iterable[PreparedMotion],
    structure: ModelStructure,
    parameters: Array,
    weight: Array,
    shapes: Sequence[ShapeParameter],
    speed: Array,
) -> ModelStructure:
    """The structure at its joint optimum by Gauss–Newton; `parameters`: (p,); `weight`, 1/σ_j, and `speed`: (n,)."""
    start = structure
    for _ in range(STEPS):
        gram, target = _normal_equations(motions, structure, parameters, weight, shapes)
        solved = pseudo_inverse(gram) @ target
        parameters, change = solved[: structure.size], solved[structure.size :]
        change = np.clip(change, -LARGEST_STEP, LARGEST_STEP)
        for (joint, name), step in zip(shapes, change, strict=True):
            moved = _constant(structure, joint, name) * np.exp(step)
            if name == "delta":
                moved = np.clip(moved, *gentle_range(structure.terms[joint].k_v, float(speed[joint])))
            elif abs(np.log(moved / _constant(start, joint, name))) > LARGEST_CHANGE:
                moved = _constant(start, joint, name)
            terms = [*structure.terms]
            terms[joint] = replace(terms[joint], **{name: float(moved)})
            structure = structure.with_terms(tuple(terms))
        if np.abs(change).max() < SETTLED:
            break
    return structure


def pseudo_inverse(matrix: Array) -> Array:
    """Inverse (p, p) of a symmetric normal matrix in scaled columns, directions without information left out."""
    scale = np.sqrt(np.diag(matrix))
    scale[scale == 0.0] = 1.0
    values, vectors = np.linalg.eigh(matrix / np.outer(scale, scale))
    known = values > 1e-14 * values[-1]
    half = vectors[:, known] / np.sqrt(values[known]) / scale[:, None]
    return half @ half.T


def _normal_equations(
    motions: Iterable[PreparedMotion],
    structure: ModelStructure,
    parameters: Array,
    weight: Array,
    shapes: Sequence[ShapeParameter],
) -> tuple[Array, Array]:
    size = structure.size + len(shapes)
    gram, target = np.zeros((size, size)), np.zeros(size)
    for prepared in motions:
        for joint in range(structure.robot.joint_count):
            columns, index = columns_with_shapes(prepared, structure, joint, parameters, shapes)
            columns = weight[joint] * prepared.whiten(joint, columns)
            torque = weight[joint] * prepared.whiten(joint, prepared.reduced_torque[None, joint])[0]
            gram[np.ix_(index, index)] += columns @ columns.T
            target[index] += columns @ torque
    return gram, target


def _constant(structure: ModelStructure, joint: int, name: str) -> float:
    terms = structure.terms[joint]
    return terms.k_v if name == "k_v" else terms.delta or 0.0
