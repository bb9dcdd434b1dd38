"""How likely recordings are under a model that is known only as well as others have made it.

Whitened, what a model leaves of new rows is r ~ N(0, 1 + J Σ Jᵀ), with J its columns there and Σ the covariance of its
parameters: what they are uncertain by is no fault of the model's form. With M = 1 + Lᵀ Jᵀ J L and Σ = L Lᵀ

    log p = -½ (‖r‖² - ‖M^(-1/2) Lᵀ Jᵀ r‖² + log det M) + constant
"""

import numpy as np

from tauscope.diagnosis.fitting.fit import Fitter
from tauscope.diagnosis.model.extended import ExtendedModel
from tauscope.recording.recording import Array


def log_likelihood(model: ExtendedModel, covariance: Array, new: Fitter) -> float:
    """Logarithm of the predictive density of new rows, but for a constant that all models share.

    Parameters
    ----------
    covariance : (p, p) float64
        of its parameters there
    """
    energy, along, gram = 0.0, np.zeros(model.size), np.zeros((model.size, model.size))
    for residual, columns in zip(new.white_residual(model), new.columns(model), strict=True):
        energy += float(residual @ residual)
        along[columns.index] += columns.rows @ residual
        gram[np.ix_(columns.index, columns.index)] += columns.rows @ columns.rows.T
    variance, axes = np.linalg.eigh(covariance)
    root = axes * np.sqrt(np.maximum(variance, 0.0))
    spread = np.eye(model.size) + root.T @ gram @ root
    explained = root.T @ along
    _, log_volume = np.linalg.slogdet(spread)
    return -0.5 * (energy - float(explained @ np.linalg.solve(spread, explained)) + float(log_volume))
