"""The torque regressor Φ of τ = Φ(q, q̇, q̈) Θ, the seed paper's equation (2), for many samples at once.

Θ stacks ten standard parameters a link, equation (3): Ixx Iyy Izz Ixy Ixz Iyz m msx msy msz, the inertia about the link
frame's origin, equation (5). That makes the force f and the moment n at this origin linear in them:

    f = m a + M ms,      n = I ω̇ + ω × I ω + ms × a,      M = S(ω̇) + S(ω)²

(a: the origin's acceleration minus gravity). Equation (4) hands f and n down the chain and projects them on the joint
axes. Here each joint's screw is carried up the chain instead (`tauscope.dynamics.chain_motion`): (w, v), the link's
angular velocity and its origin's velocity per unit of q̇_i. By virtual power the link's share of τ_i, i ≤ j, is

    τ_i = wᵀ n + vᵀ f,

and nothing at the joints beyond it. Its coefficients are the columns of Φ; k, l, o below are x, y, z in cyclic order:

    I_kk    w_k ω̇_k + w_l ω_o ω_k - w_o ω_k ω_l
    I_kl    w_l M_ol - w_k M_ok + w_o (M_kk - M_ll)
    m       v · a
    ms_k    v · M e_k + w_o a_l - w_l a_o
"""

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager

import numpy as np
from numpy.typing import NDArray

from tauscope.dynamics.chain_motion import Array, ChainMotion, LinkMotion, aligned_empty
from tauscope.robot.robot import STANDARD_PARAMETERS, Robot

Columns = NDArray[np.intp]

# Samples worked on at once: long enough that the calls cost little, short enough that the work stays in the cache.
CHUNK = 3400

# Bytes from which the C library always asks for new pages: they are zero, and cost nothing where they stay so.
_FRESH_MEMORY = 2**25
_PER_LINK = len(STANDARD_PARAMETERS)


def torque_regressor(robot: Robot, q: Array, qd: Array, qdd: Array, *, columns: Columns | None = None) -> Array:
    """Regressor Φ of τ = Φ(q, q̇, q̈) Θ, the seed paper's equation (2); `q`, `qd`, `qdd`: (N, n) [SI].

    `columns`: (C,) int, standard parameters wanted, ascending, over all links from 0; all of them where None.
    Returns (N, n, C), Φ, a view of a C-contiguous (n, C, N) array: samples are adjacent in memory.
    """
    regressor = TorqueRegressor(robot, columns=columns, chunk=min(CHUNK, max(len(q), 1)))
    shape = (robot.joint_count, regressor.column_count, len(q))
    if np.dtype(np.float64).itemsize * np.prod(shape) > _FRESH_MEMORY:
        out = np.zeros(shape)
        regressor.write_shares(q, qd, qdd, out)
    else:
        out = np.empty(shape)
        regressor.write(q, qd, qdd, out)
    return out.transpose(2, 0, 1)


class TorqueRegressor:
    """The torque regressor of one robot with its work buffers, to go through a recording in pieces."""

    def __init__(self, robot: Robot, *, columns: Columns | None = None, chunk: int = CHUNK) -> None:
        wanted = np.arange(_PER_LINK * robot.link_count) if columns is None else np.asarray(columns)
        self.column_count = len(wanted)
        self._chunk = chunk
        self._motion = ChainMotion(robot, chunk)
        self._scratch = aligned_empty(2, robot.joint_count, chunk)
        self._difference = aligned_empty(chunk)
        places = [np.flatnonzero(wanted // _PER_LINK == link) for link in range(robot.link_count)]
        self._inner_columns = [int(np.searchsorted(wanted, _PER_LINK * link)) for link in robot.first_links]
        self._columns = [[(int(at), _COLUMNS[wanted[at] % _PER_LINK]) for at in of_link] for of_link in places]

    def write(self, q: Array, qd: Array, qdd: Array, out: Array) -> None:
        """Write Φ into `out`, (n, C, N), samples on the last axis; `q`, `qd`, `qdd`: (N, n) [SI]."""
        for joint, inner in enumerate(self._inner_columns):
            out[joint, :inner] = 0.0
        self.write_shares(q, qd, qdd, out)

    def write_shares(self, q: Array, qd: Array, qdd: Array, out: Array) -> None:
        """Write Φ into `out`, (n, C, N), but for what is always zero: the caller's zeros; `q`, `qd`, `qdd`: (N, n)."""
        with _rows_used_in_place():
            for start in range(0, len(q), self._chunk):
                part = slice(start, start + self._chunk)
                state = [np.ascontiguousarray(array[part].T) for array in (q, qd, qdd)]
                for link, motion in enumerate(self._motion.links(*state)):
                    self._write_link(link, motion, out[: len(motion.screw_angular[0]), :, part])

    def _write_link(self, link: int, motion: LinkMotion, out: Array) -> None:
        samples = out.shape[-1]
        scratch, difference = self._scratch[:, : len(out), :samples], self._difference[:samples]
        for at, column in self._columns[link]:
            _write_sum(column(motion, difference), out[:, at], scratch)


# Add or subtract, a component of the joint screws (j, N), and its coefficient (N,).
_Term = tuple[np.ufunc, Array, Array]
_Column = Callable[[LinkMotion, Array], Sequence[_Term]]


def _moment_of_inertia(k: int) -> _Column:
    first, second = (k + 1) % 3, (k + 2) % 3

    def terms(motion: LinkMotion, _scratch: Array) -> Sequence[_Term]:
        w, products = motion.screw_angular, motion.products
        return (
            (np.add, w[k], motion.angular_acceleration[k]),
            (np.add, w[first], products[first]),
            (np.subtract, w[second], products[second]),
        )

    return terms


def _product_of_inertia(other: int) -> _Column:
    """Column of I_kl, where k and l follow the third axis in cyclic order."""
    k, l_ = (other + 1) % 3, (other + 2) % 3

    def terms(motion: LinkMotion, scratch: Array) -> Sequence[_Term]:
        w, field = motion.screw_angular, motion.field
        return (
            (np.add, w[l_], field[other][l_]),
            (np.subtract, w[k], field[other][k]),
            (np.add, w[other], np.subtract(field[k][k], field[l_][l_], out=scratch)),
        )

    return terms


def _mass(motion: LinkMotion, _scratch: Array) -> Sequence[_Term]:
    return [(np.add, v, a) for v, a in zip(motion.screw_linear, motion.acceleration, strict=True)]


def _first_moment(k: int) -> _Column:
    first, second = (k + 1) % 3, (k + 2) % 3

    def terms(motion: LinkMotion, _scratch: Array) -> Sequence[_Term]:
        w, a = motion.screw_angular, motion.acceleration
        return (
            *((np.add, v, row[k]) for v, row in zip(motion.screw_linear, motion.field, strict=True)),
            (np.add, w[second], a[first]),
            (np.subtract, w[first], a[second]),
        )

    return terms


# One entry a standard parameter, in the order of `STANDARD_PARAMETERS`.
_COLUMNS: tuple[_Column, ...] = (
    *(_moment_of_inertia(k) for k in range(3)),
    *(_product_of_inertia(other) for other in (2, 1, 0)),
    _mass,
    *(_first_moment(k) for k in range(3)),
)


def _write_sum(terms: Sequence[_Term], out: Array, scratch: Array) -> None:
    """Sum of the terms; the output, which is far larger than the cache, is touched once, by the last of them."""
    total, product = scratch
    (_, screw, coefficient), *others, (last, last_screw, last_coefficient) = terms
    np.multiply(screw, coefficient, out=total)
    for operation, screw, coefficient in others:
        np.multiply(screw, coefficient, out=product)
        operation(total, product, out=total)
    np.multiply(last_screw, last_coefficient, out=product)
    last(total, product, out=out)


@contextmanager
def _rows_used_in_place() -> Iterator[None]:
    """Keep NumPy from copying rows shorter than its ufunc buffer into that buffer, which would double the time."""
    size = np.setbufsize(16)
    try:
        yield
    finally:
        np.setbufsize(size)
