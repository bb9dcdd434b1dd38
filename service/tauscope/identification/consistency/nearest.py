"""The nearest physically consistent parameters, by one convex conic program.

    minimise    ‖R x - z‖² + ‖W (x - μ)‖²
    subject to  pseudo-inertia of every link ⪰ ε (tiny, relative to the link's mass and size),   G x ≤ h

‖R x - z‖² is the weighted least-squares criterion in units of the noise: a step of 1 is one standard deviation. The
prior decides only where the data do not: of a combination known to σ and believed to s, it takes (σ / s)² of the way
to μ. Both terms are quadratic in x, so the program is convex.
"""

from dataclasses import dataclass

import numpy as np

from tauscope.errors import IdentificationError
from tauscope.identification.consistency.inequalities import LinearInequalities
from tauscope.identification.consistency.prior import Prior
from tauscope.identification.consistency.program import assemble, solve
from tauscope.robot import LinkInertia
from tauscope.robot.robot import Array

MARGIN = 1e-8  # ε: smallest eigenvalue of a scaled pseudo-inertia. A link of 0.3 m keeps 0.03 mm of thickness.
_ACTIVE = 100.0  # a constraint counts as active where less than this many margins are left


@dataclass(frozen=True, eq=False)
class ConsistentParameters:
    """A full parameter set of a robot that can exist."""

    links: tuple[LinkInertia, ...]
    parameters: Array  # (p,), x: standard parameters of all links, then friction coefficients
    objective: float
    squared_residual: float  # ‖R x - z‖² [noise variances]
    free_squared_residual: float  # the least that any x, consistent or not, reaches [noise variances]
    status: str
    duality_gap: float
    active_links: tuple[bool, ...]
    active_inequalities: tuple[str, ...]

    @property
    def friction(self) -> Array:
        """Friction coefficients, the tail of `parameters`, shape (p - 10 n,)."""
        return self.parameters[10 * len(self.links) :]

    @property
    def residual_increase(self) -> float:
        """What consistency costs: ‖R x - z‖² above the unconstrained least squares [noise variances]."""
        return self.squared_residual - self.free_squared_residual


def nearest_consistent_parameters(
    factor: Array, target: Array, prior: Prior, inequalities: LinearInequalities | None = None
) -> ConsistentParameters:
    """Nearest x to a weighted least-squares estimate such that every link can exist and G x ≤ h.

    min ‖R x - z‖² + ‖W (x - μ)‖², pseudo-inertia ⪰ ε, G x ≤ h: convex, the answer certified by `duality_gap`. Raises
    IdentificationError where inequalities contradict each other, or the solver is not accurate. `factor`: (r, p), R,
    whitened: ten parameters a link, then friction coefficients; `target`: (r,), z.
    """
    inequalities = inequalities or LinearInequalities.none(prior.mean.size)
    _check_input(factor, target, prior, inequalities)
    program = assemble(factor, target, prior, inequalities, margin=MARGIN)
    scaled, status, gap = solve(program)
    parameters = scaled * prior.scale
    squared_residual = float(np.sum((factor @ parameters - target) ** 2))
    distance = prior.squared_distance(parameters)
    felt = program.slacks(scaled) <= _ACTIVE * MARGIN
    least = program.smallest_eigenvalues(scaled)
    return ConsistentParameters(
        links=tuple(LinkInertia.from_vector(parameters[10 * j : 10 * j + 10]) for j in range(program.link_count)),
        parameters=parameters,
        objective=squared_residual + distance,
        squared_residual=squared_residual,
        free_squared_residual=_free_squared_residual(factor * prior.scale, target),
        status=status,
        duality_gap=gap,
        active_links=tuple(bool(value <= _ACTIVE * MARGIN) for value in least),
        active_inequalities=tuple(name for name, on in zip(inequalities.names, felt, strict=True) if on),
    )


def _check_input(factor: Array, target: Array, prior: Prior, inequalities: LinearInequalities) -> None:
    size = prior.mean.size
    if factor.shape != (target.size, size) or inequalities.matrix.shape[1] != size:
        raise IdentificationError(
            f"the information has shape {factor.shape} and the inequalities {inequalities.matrix.shape}, but the "
            f"parameter vector has {size} entries; pass all three for the same parameters"
        )
    unusable = ~np.isfinite(factor).all(axis=0)
    if unusable.any() or not np.isfinite(target).all():
        where = f"parameter {int(np.argmax(unusable)) + 1}" if unusable.any() else "the torque"
        raise IdentificationError(
            f"the information of {where} is not finite; check the recording's gaps and the noise variances"
        )


def _free_squared_residual(scaled_factor: Array, target: Array) -> float:
    """The least ‖R x - z‖² over all x, rank-deficient R included."""
    free = np.linalg.lstsq(scaled_factor, target, rcond=1e-12)[0]
    return float(np.sum((scaled_factor @ free - target) ** 2))
