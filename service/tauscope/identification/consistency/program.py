"""The conic program behind the nearest consistent parameters: assembled in scaled parameters, solved in whitened ones.

With u = x / s the criterion is ‖T u - c‖² + constant, T triangular. The solver sees y = T u - c, so that the criterion
is ‖y‖² and perfectly conditioned: forming the normal matrix TᵀT instead would square the condition number (seen on
7 joints: the solver reports success at 1e-8, and the criterion is several times its minimum).
"""

from collections.abc import Iterator
from dataclasses import dataclass

import clarabel
import numpy as np
from scipy import sparse
from scipy.linalg import qr, solve_triangular

from tauscope.errors import IdentificationError
from tauscope.identification.consistency.inequalities import LinearInequalities
from tauscope.identification.consistency.prior import Prior
from tauscope.identification.consistency.triangle import identity_triangle, triangle_of_parameters
from tauscope.robot import LinkInertia, pseudo_inertia
from tauscope.robot.robot import Array

_TOLERANCE = 1e-10  # feasibility and duality gap asked of the solver
_ATTEMPTS = ((1.0, True), (1.0, False), (1e2, True), (1e4, True), (1e6, True), (1e2, False), (1e4, False), (1e6, False))
"""Unit of y in standard deviations, and whether the solver equilibrates, in the order tried.

A unit of 1 suits data that a consistent model fits. Where the arm is far from rigid and the recording long, the
consistent optimum may lie thousands of standard deviations from the free one, and the unit must follow. Equilibrated,
most programs take fewer iterations.
"""

_GAP = 1e-6  # largest duality gap, relative to the criterion or to 1, with which an inexact solution is accepted
# Largest violation of a scaled inequality that rounding in the solver may leave; it is removed afterwards.
_SLACK = 1e-7
_EXACT = 1e-9  # largest violation of a scaled constraint in a result


@dataclass(frozen=True, eq=False)
class ConicProgram:
    """Minimise ½ ‖T u - c‖² subject to A u + s = b, s in the non-negative orthant and one 4x4 PSD cone a link."""

    triangle: Array  # (p, p), T
    centre: Array  # (p,), c
    matrix: Array  # (k + 10 n, p), A, the k inequalities first, each of unit length
    bound: Array  # (k + 10 n,), b
    names: tuple[str, ...]
    margin: float
    link_count: int

    def slacks(self, scaled: Array) -> Array:
        """What is left of each inequality, (k,), at `scaled`, (p,); negative where it is violated."""
        count = len(self.names)
        return self.bound[:count] - self.matrix[:count] @ scaled

    def smallest_eigenvalues(self, scaled: Array) -> Array:
        """Least eigenvalue of each pseudo-inertia, (n,), at `scaled`, (p,); ε on the boundary."""
        links = (LinkInertia.from_vector(scaled[10 * j : 10 * j + 10]) for j in range(self.link_count))
        return np.array([np.linalg.eigvalsh(pseudo_inertia(link))[0] for link in links])

    def admits(self, scaled: Array) -> bool:
        """Whether u keeps every inequality, and every link half of its margin at least. `scaled`: (p,), u."""
        kept = np.all(self.slacks(scaled) >= -_EXACT)
        return bool(kept and np.all(self.smallest_eigenvalues(scaled) >= 0.5 * self.margin - _EXACT))


def assemble(
    factor: Array, target: Array, prior: Prior, inequalities: LinearInequalities, *, margin: float
) -> ConicProgram:
    """The program of a whitened `factor` (r, p) and `target` (r,), scaled by the prior's magnitudes."""
    size, link_count = prior.mean.size, prior.link_count
    information = np.column_stack([factor * prior.scale, target])
    belief = np.column_stack([prior.root * prior.scale, prior.root @ prior.mean])
    stacked = np.array(qr(np.vstack([information, belief]), mode="r")[0], dtype=np.float64)
    rows = inequalities.matrix * prior.scale
    norms: Array = np.sqrt(np.sum(rows**2, axis=1))
    norms[norms == 0.0] = 1.0
    cone = np.kron(np.eye(link_count), triangle_of_parameters())
    cone = np.hstack([-cone, np.zeros((len(cone), size - cone.shape[1]))])
    return ConicProgram(
        triangle=stacked[:size, :size],
        centre=stacked[:size, size],
        matrix=np.concatenate([rows / norms[:, None], cone], dtype=np.float64),
        bound=np.concatenate([inequalities.bound / norms, np.tile(-margin * identity_triangle(), link_count)]),
        names=inequalities.names,
        margin=margin,
        link_count=link_count,
    )


def solve(program: ConicProgram) -> tuple[Array, str, float]:
    """The optimum u, (p,), "interior" or the solver's word, and duality gap. Raises IdentificationError without one."""
    interior = solve_triangular(program.triangle, program.centre)
    if program.admits(interior):
        return interior, "interior", 0.0
    status = clarabel.SolverStatus.Unsolved
    for candidate, status, gap in _attempts(program, interior):
        settled = _settle(program, candidate)
        if gap <= _GAP and program.admits(settled):
            return settled, str(status), gap
    _require_feasible(program)
    raise IdentificationError(
        f"the conic program of the physically consistent model was not solved ({status}); "
        "check that torques, positions and noise variances are in SI units"
    )


def _attempts(program: ConicProgram, interior: Array) -> Iterator[tuple[Array, clarabel.SolverStatus, float]]:
    """Solution, status and duality gap in whitened coordinates, for each entry of `_ATTEMPTS`."""
    size = program.centre.size
    unwhiten = solve_triangular(program.triangle, np.eye(size))
    matrix = program.matrix @ unwhiten
    bound = program.bound - program.matrix @ interior
    for unit, equilibrate in _ATTEMPTS:
        solution = _clarabel(np.ones(size), np.zeros(size), unit * matrix, bound, program, equilibrate=equilibrate)
        if solution is None:
            continue
        criterion = abs(solution.obj_val) * unit**2
        gap = abs(solution.obj_val - solution.obj_val_dual) * unit**2 / max(1.0, criterion)
        candidate = interior + unwhiten @ (unit * np.array(solution.x))
        yield candidate, solution.status, gap if np.isfinite(gap) else np.inf


def _clarabel(
    quadratic: Array, linear: Array, matrix: Array, bound: Array, program: ConicProgram, *, equilibrate: bool
) -> clarabel.DefaultSolution | None:
    """Minimise ½ vᵀ diag(P) v + qᵀ v subject to A v + s = b with s in the program's cones; None where it broke down."""
    settings = clarabel.DefaultSettings()
    settings.verbose = False
    settings.max_threads = 1
    settings.equilibrate_enable = equilibrate
    settings.tol_gap_abs = settings.tol_gap_rel = settings.tol_feas = _TOLERANCE
    cones = [clarabel.NonnegativeConeT(len(program.names))] if program.names else []
    cones += [clarabel.PSDTriangleConeT(4)] * program.link_count
    weight = sparse.diags_array(quadratic, format="csc")
    solver = clarabel.DefaultSolver(weight, linear, sparse.csc_matrix(matrix), bound, cones, settings)
    try:
        return solver.solve()
    except BaseException as error:  # a Rust panic, which is no Exception: an iterate's eigenvalues were not found
        if type(error).__name__ != "PanicException":
            raise
        return None


def _require_feasible(program: ConicProgram) -> None:
    """Refuse, by name, inequalities that no link that can exist satisfies together.

    The smallest common violation t of all constraints, without the data: positive at the optimum if and only if they
    contradict each other, and the rows that carry a multiplier are the ones that do.
    """
    size, count = program.centre.size, len(program.names)
    relaxed = np.concatenate([np.ones(count), np.tile(identity_triangle(), program.link_count)])
    matrix = np.column_stack([program.matrix, -relaxed])
    # ½ t² + t has its minimum at t = -1: a point well inside needs no further room. The weight on u keeps it bounded.
    quadratic = np.append(np.full(size, 1e-8), 1.0)
    solution = _clarabel(quadratic, np.append(np.zeros(size), 1.0), matrix, program.bound, program, equilibrate=True)
    if solution is not None and solution.x[-1] > _SLACK:
        multipliers = np.array(solution.z[:count])
        felt = multipliers > 1e-3 * multipliers.max(initial=0.0)
        demands = ", ".join(name for name, on in zip(program.names, felt, strict=True) if on)
        raise IdentificationError(
            f"no link that can exist satisfies these bounds together: {demands}; widen or remove one of them"
        )


def _settle(program: ConicProgram, scaled: Array) -> Array:
    """Project onto the inequalities that the solver's rounding missed, so that a viscous friction of -1e-12 reads 0."""
    settled = scaled.copy()
    for row, bound in zip(program.matrix, program.bound[: len(program.names)], strict=False):
        excess = float(row @ settled - bound)
        if 0.0 < excess <= _SLACK:
            settled -= excess * row
            if np.count_nonzero(row) == 1:
                column = int(np.argmax(np.abs(row)))
                settled[column] = bound / row[column] + 0.0
    return settled
