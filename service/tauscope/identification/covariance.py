"""Standard errors that stay right when the residual is autocorrelated, and the torque that they leave uncertain.

cov Θ̂ = B M B,  B = (Σ_j w_j² A_jᵀ A_j + P⁻¹)⁻¹,  M = Σ_j w_j⁴ A_jᵀ Ω_j A_j + D P⁻¹ D,

with Ω_j the covariance of joint j's residual by its autoregressive model, w_j = 1/σ_j (WLS) or 1 (LS), P⁻¹ the prior's
precision, zero for the free estimate, and D the deviation from the prior that the data show. For white residuals this
is (LᵀΣ⁻¹L + P⁻¹)⁻¹ where D = 1. Torque that is made of commands has a scale of relative standard error s_j, which adds
s_j² v_j v_jᵀ, v_j = w_j² A_jᵀ y_j, to M. Estimated shape constants of the friction enter as columns of their own, so
that what they leave uncertain shows in the coefficients.
"""

from collections.abc import Iterable, Sequence

import numpy as np

from tauscope.identification.autocorrelation import Autoregression
from tauscope.identification.dataset import PreparedMotion
from tauscope.identification.least_squares import JointFactor
from tauscope.identification.posterior import Posterior
from tauscope.identification.shape_sensitivity import ShapeParameter, columns_with_shapes, pseudo_inverse
from tauscope.identification.structure import ModelStructure
from tauscope.recording.recording import Array

# The covariance is enlarged by no more than the inverse of this for the degrees of freedom that parameters took.
MOST_FREEDOM_LOST = 0.25


def parameter_covariance(
    motions: Iterable[PreparedMotion],
    structure: ModelStructure,
    parameters: Array,
    factors: Sequence[JointFactor],
    weight: Array,
    autoregressions: Sequence[Autoregression],
    shapes: Sequence[ShapeParameter] = (),
    posterior: Posterior | None = None,
    *,
    scale_std: Sequence[float] = (),
) -> Array:
    """Covariance (p + s, p + s) of Θ, `parameters`, (p,), and log shape constants; `weight`: w_j, (n,)."""
    size = structure.size + len(shapes)
    bread, meat = np.zeros((size, size)), np.zeros((size, size))
    if posterior is not None:
        own = np.s_[: structure.size, : structure.size]
        bread[own] = posterior.precision
        meat[own] = posterior.precision * np.outer(posterior.doubt, posterior.doubt)
    extended = {joint for joint, _ in shapes}
    passed = [joint for joint, model in enumerate(autoregressions) if model.order > 0 or joint in extended]
    for joint, (factor, model) in enumerate(zip(factors, autoregressions, strict=True)):
        if joint not in passed:
            columns = factor.triangle[:, :-1]
            square = columns.T @ columns
            place = np.ix_(factor.columns, factor.columns)
            bread[place] += weight[joint] ** 2 * square
            meat[place] += weight[joint] ** 4 * model.variance * square
    for prepared in motions if passed else ():
        for joint in passed:
            columns, index = columns_with_shapes(prepared, structure, joint, parameters, shapes)
            columns = prepared.whiten(joint, columns)
            coloured = autoregressions[joint].colour(columns)
            place = np.ix_(index, index)
            bread[place] += weight[joint] ** 2 * (columns @ columns.T)
            meat[place] += weight[joint] ** 4 * (coloured @ coloured.T)
    for joint, (factor, std) in enumerate(zip(factors, scale_std, strict=False)):  # none where torque was measured
        along = weight[joint] ** 2 * (factor.triangle[:, :-1].T @ factor.triangle[:, -1])
        meat[np.ix_(factor.columns, factor.columns)] += std**2 * np.outer(along, along)
    # The parameters took their degrees of freedom out of the residual where it is strongest; coloured rows count less.
    rows = sum(f.rows / model.long_run_ratio for f, model in zip(factors, autoregressions, strict=True))
    taken = size if posterior is None else posterior.freedom + len(shapes)
    inverse = pseudo_inverse(bread)
    return rows / max(rows - taken, MOST_FREEDOM_LOST * rows) * inverse @ meat @ inverse


def uncertain_torque(
    motions: Iterable[PreparedMotion],
    structure: ModelStructure,
    parameters: Array,
    shapes: Sequence[ShapeParameter],
    covariance: Array,
    noise_std: Array,
) -> Array:
    """Rms of torque that parameters and friction at rest leave uncertain, √(mean of a S aᵀ + v σ²), (n,).

    a: rows of a joint; v: of rest, as `PreparedMotion` says; `parameters`: (p,); `covariance`: (p + s, p + s), S, of
    these and log shape constants; `noise_std`: (n,), σ [Nm or N].
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
