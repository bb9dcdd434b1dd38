"""Links that bodies can have, nearest to what the final model says of them."""

import numpy as np

from tauscope.diagnosis.findings.diagnosed import Diagnosis
from tauscope.identification.consistency import plausible_prior
from tauscope.identification.full_parameters import FullParameters
from tauscope.identification.physical_estimate import consistent_estimate
from tauscope.identification.posterior import WIDE
from tauscope.robot import LinkInertia

SMALLEST = 1e-12
"""Eigenvalues of the scaled covariance below this share of the largest are no direction."""


def consistent_links(diagnosis: Diagnosis) -> tuple[LinkInertia, ...]:
    """The nearest physically consistent links to the final model, in the metric of its covariance."""
    fit = diagnosis.selection.fit
    structure, size = fit.model.structure, fit.model.structure.size
    covariance = fit.covariance[:size, :size] * diagnosis.inflation
    scale = np.sqrt(np.maximum(np.diag(covariance), np.finfo(float).tiny))
    values, vectors = np.linalg.eigh(covariance / np.outer(scale, scale))
    known = values > SMALLEST * values[-1]
    factor = (vectors[:, known] / np.sqrt(values[known])).T / scale
    target = factor @ fit.model.parameters
    full = FullParameters.of(structure)
    prior = plausible_prior(structure.robot, factor @ full.map, target, full.friction).widen(WIDE)
    return consistent_estimate(structure, factor, target, prior).links
