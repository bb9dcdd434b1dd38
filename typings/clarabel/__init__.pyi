"""Types of the part of Clarabel that Tauscope calls: its extension module ships none."""

from collections.abc import Sequence
from enum import Enum
from typing import Any

import numpy as np
from numpy.typing import NDArray

class SolverStatus(Enum):
    Unsolved = ...
    Solved = ...
    PrimalInfeasible = ...
    DualInfeasible = ...
    AlmostSolved = ...
    AlmostPrimalInfeasible = ...
    AlmostDualInfeasible = ...
    MaxIterations = ...
    MaxTime = ...
    NumericalError = ...
    InsufficientProgress = ...
    CallbackTerminated = ...

class ZeroConeT:
    def __init__(self, dim: int) -> None: ...

class NonnegativeConeT:
    def __init__(self, dim: int) -> None: ...

class SecondOrderConeT:
    def __init__(self, dim: int) -> None: ...

class PSDTriangleConeT:
    def __init__(self, dim: int) -> None: ...

class DefaultSettings:
    verbose: bool
    max_iter: int
    max_threads: int
    time_limit: float
    equilibrate_enable: bool
    tol_feas: float
    tol_gap_abs: float
    tol_gap_rel: float

class DefaultSolution:
    x: Sequence[float]
    z: Sequence[float]
    s: Sequence[float]
    status: SolverStatus
    obj_val: float
    obj_val_dual: float
    iterations: int
    solve_time: float
    r_prim: float
    r_dual: float

class DefaultSolver:
    # P and A are scipy.sparse.csc_matrix; SciPy's stubs make that generic, which the solver does not care about.
    def __init__(
        self,
        P: Any,
        q: NDArray[np.float64],
        A: Any,
        b: NDArray[np.float64],
        cones: Sequence[ZeroConeT | NonnegativeConeT | SecondOrderConeT | PSDTriangleConeT],
        settings: DefaultSettings,
    ) -> None: ...
    def solve(self) -> DefaultSolution: ...
