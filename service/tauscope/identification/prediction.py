"""How well a model may be expected to predict a motion: noise, and what the covariance of its parameters adds."""

from collections.abc import Iterable, Sequence

import numpy as np

from tauscope.identification.dataset import PreparedMotion
from tauscope.identification.shape_sensitivity import ShapeParameter, columns_with_shapes
from tauscope.identification.structure import ModelStructure
from tauscope.recording.recording import Array


def uncertain_torque(
    motions: Iterable[PreparedMotion],
    structure: ModelStructure,
    parameters: Array,
    shapes: Sequence[ShapeParameter],
    covariance: Array,
    noise_std: Array,
) -> Array:
    """Root mean square of the torque that parameters and friction at rest leave uncertain, √(mean of a S aᵀ + v σ²).

    a are the rows of a joint, v is what `PreparedMotion` says of friction at rest.

    `parameters`: (p,), the coefficients, for the amplitudes of the shape constants.
    `covariance`: (p + s, p + s), S, of the parameters and of the logarithms of the estimated shape constants.
    `noise_std`: (n,), σ of a row [Nm or N].
    Returns (n,), in the common band [Nm or N].
    """
    squares, resting, count = np.zeros((3, structure.robot.joint_count))
    for prepared in motions:
        for joint, used in enumerate(prepared.used):
            columns, index = columns_with_shapes(prepared, structure, joint, parameters, shapes)
            columns = columns if used.all() else columns[:, used]
            squares[joint] += np.sum((covariance[np.ix_(index, index)] @ columns) * columns)
            resting[joint] += prepared.rest_variance[joint] * prepared.at_rest[joint][used].sum()
            count[joint] += columns.shape[1]
    rows = np.maximum(count, 1)
    return np.hypot(np.sqrt(np.maximum(squares, 0.0) / rows), noise_std * np.sqrt(resting / rows))
