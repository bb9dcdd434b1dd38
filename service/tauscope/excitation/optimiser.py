"""Finding the best feasible series: many random ones, sequential quadratic programming from the best of them."""

import time
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from scipy.optimize import minimize
from threadpoolctl import threadpool_limits

from tauscope.errors import ExcitationError
from tauscope.excitation.feasibility import Feasibility
from tauscope.excitation.information import CriterionValue, reported_value
from tauscope.excitation.problem import ExcitationProblem
from tauscope.robot.robot import Array
from tauscope.trajectory.document import HistoryPart

CANDIDATES = 192  # random feasible series of which the best are improved
STARTS = 4  # series that are improved from
SHORT_ROUND = 30  # iterations from every start
LONG_ROUND = 50  # iterations from the best of them, its constraints calibrated anew, and once more
ROUNDS = 2  # rounds from the best
TOLERANCE = 1e-4  # change of the cost, a logarithm, at which a round ends


@dataclass(frozen=True)
class OptimiserProgress:
    """Where the optimiser is."""

    step: str
    fraction: float
    cost: float
    best: float


@dataclass(eq=False)
class OptimiserResult:
    """What came of it."""

    x: Array  # (n, columns), the best feasible vector found
    history: list[HistoryPart]
    evaluations: int
    seconds: float  # time that it took [s]
    random_value: float


@dataclass(frozen=True, eq=False)
class Stages:
    """The same question at two resolutions; `exact` compares candidates, with friction's curve as it is."""

    coarse: ExcitationProblem
    fine: ExcitationProblem
    exact: Callable[[Array], CriterionValue]


@dataclass(eq=False)
class _Search:
    """State of the search: the best feasible vector so far, and what is reported."""

    stages: Stages
    feasibility: Feasibility
    progress: Callable[[OptimiserProgress], None]
    iterations: int
    best: Array | None = None
    best_value: CriterionValue | None = None
    done: int = 0
    history: list[HistoryPart] = field(default_factory=list)

    def consider(self, x: Array) -> float:
        """Exact cost of a feasible vector, kept where it is the best."""
        value = self.stages.exact(x)
        if self.best_value is None or value.cost < self.best_value.cost:
            self.best, self.best_value = x, value
        return value.cost

    def tell(self, step: str, fraction: float, own: float | None = None) -> None:
        criterion = self.stages.coarse.criterion
        best = np.inf if self.best_value is None else reported_value(criterion, self.best_value.own)
        value = best if own is None else reported_value(criterion, own)
        self.progress(OptimiserProgress(step, min(1.0, fraction), value, best))

    def improve(self, problem: ExcitationProblem, x: Array, start: int, iterations: int) -> Array:
        """A round of sequential quadratic programming from a feasible vector; what comes out is feasible."""
        first, count = self.done, 0
        problem.calibrate(x.ravel())

        def report(xk: Array) -> None:
            nonlocal count
            count += 1
            own = problem.own(xk)
            violation = max(0.0, -float(problem.constraints(xk).min()))
            if np.isfinite(value := reported_value(problem.criterion, own)):
                self.history.append(HistoryPart(start=start, iteration=count, value=value, violation=violation))
            self.tell(f"start {start}", (first + count) / self.iterations, own)

        # The stubs want the constraint as a typed dictionary of their own.
        result = minimize(  # pyright: ignore[reportCallIssue]
            problem.cost,
            x.ravel(),
            jac=problem.gradient,
            method="SLSQP",
            constraints={"type": "ineq", "fun": problem.constraints, "jac": problem.jacobian},  # pyright: ignore[reportArgumentType]
            options={"maxiter": iterations, "ftol": TOLERANCE},
            callback=report,
        )
        self.done = first + iterations
        if not np.isfinite(result.x).all():
            return x
        improved = self.feasibility.repaired(result.x.reshape(x.shape), x)
        return improved if self.consider(improved) < self.stages.exact(x).cost else x


def optimise(
    stages: Stages,
    feasibility: Feasibility,
    rng: np.random.Generator,
    *,
    starts: int = STARTS,
    progress: Callable[[OptimiserProgress], None] = lambda _: None,
) -> OptimiserResult:
    """The best feasible vector of several starts. Raises ExcitationError where none excites all parameters."""
    begin = time.perf_counter()
    search = _Search(stages, feasibility, progress, starts * SHORT_ROUND + ROUNDS * LONG_ROUND)
    # The matrices have some fifty columns: more threads would only wait for one another.
    with threadpool_limits(limits=1, user_api="blas"):
        x, random_value = _run(search, rng, starts)
    seconds = time.perf_counter() - begin
    evaluations = stages.coarse.evaluations + stages.fine.evaluations
    return OptimiserResult(x, search.history, evaluations, seconds, random_value)


def _run(search: _Search, rng: np.random.Generator, starts: int) -> tuple[Array, float]:
    """Random series, a short round from each of the best, long ones from the best of these."""
    stages = search.stages
    candidates = _candidates(search, rng)[:starts]
    random_value = reported_value(stages.coarse.criterion, min(stages.exact(x).own for x in candidates))
    ends = []
    for start, x in enumerate(candidates, 1):
        search.consider(x)
        improved = search.improve(stages.coarse, x, start, SHORT_ROUND)
        ends.append((stages.exact(improved).cost, start, improved))
    _, start, x = min(ends, key=lambda end: end[:2])
    for _ in range(ROUNDS):
        x = search.improve(stages.fine, x, start, LONG_ROUND)
    if search.best is None or search.best_value is None or not np.isfinite(search.best_value.cost):
        raise ExcitationError("no motion within the limits shows all parameters; widen the limits")
    return search.best, random_value


def _candidates(search: _Search, rng: np.random.Generator) -> list[Array]:
    search.tell("random motions", 0.0)
    postures = search.feasibility.standing_postures(rng)
    found: list[tuple[float, int, Array]] = []
    for number in range(CANDIDATES):
        x = search.feasibility.random_start(postures, rng)
        cost = np.inf if x is None else search.stages.coarse.cost(x.ravel())
        if x is not None and np.isfinite(cost):
            found.append((cost, number, x))
    if not found:
        raise ExcitationError(
            f"none of {CANDIDATES} random motions within the limits shows all parameters: the limits leave hardly any "
            "motion; widen those of position, velocity, torque, workspace or following error"
        )
    return [x for _, _, x in sorted(found, key=lambda each: each[:2])]
