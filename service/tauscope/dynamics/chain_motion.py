"""How every link of the chain moves: the forward recursion of the modified Newton-Euler formula.

For each link j, seen in its own link frame j:

* ω, ω̇  angular velocity and acceleration,
* a      acceleration of the frame's origin minus gravity (an arm at rest "accelerates" upwards),
* M      = S(ω̇) + S(ω)², so that a + M r is the acceleration (minus gravity) of the link's point r,
* the joint screws (w_i, v_i), one a joint met so far: the link's angular velocity, and its origin's velocity, per unit
  of q̇_i. A segment that follows joint i adds its own axis, times the multiplier, to this screw.

Link frame j in link frame j-1 is ``before · motion_z(q_j) · after`` (`tauscope.robot.robot.Segment`). Going along it,
with p the translation of `before` (in frame j-1), then that of `after` (in frame j):

    another origin      a ← a + M p,   v_i ← v_i + w_i × p
    another orientation all vectors ← Rᵀ vectors
    a joint that turns  ω ← ω + ẑ q̇,   ω̇ ← ω̇ + ẑ q̈ + ω × ẑ q̇,   and the new screw w_j = ẑ, v_j = 0
    a joint that slides a ← a + ẑ q̈ + 2 ω × ẑ q̇,   p ← p + ẑ q,   and the new screw w_j = 0, v_j = ẑ

The work is done by NumPy calls on long runs of memory, the samples on the last, contiguous axis: all vectors that turn
with the frame are rows of one block per component, so that one call turns them all. Any constant rotation is split into
turns about z, x and z (`tauscope.dynamics.chain_step`), each of which touches two of the three blocks only. A right
angle costs only a sign.
"""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from tauscope.dynamics.chain_step import ABOUT_Z, Offset, Plane, Step
from tauscope.robot.robot import Array, Robot

Vectors = tuple[Array, Array, Array]  # the x, y and z components, each an array of the same shape
_FIRST_SCREW = 3  # rows of a block: ω, ω̇, a, then w_i and v_i of each joint by turns
_ALIGNMENT = 64  # bytes of the widest vector register: rows that start elsewhere cost up to twice the time


class LinkMotion(NamedTuple):
    """Motion of link j in link frame j: views that hold until the next link is asked for."""

    screw_angular: Vectors  # three (j, N), w_i of the j joints met so far
    screw_linear: Vectors  # three (j, N), v_i
    angular_velocity: Vectors  # three (N,), ω [rad/s]
    angular_acceleration: Vectors  # three (N,), ω̇ [rad/s²]
    acceleration: Vectors  # three (N,), a of the origin, minus gravity [m/s²]
    products: Vectors  # three (N,), ω_y ω_z, ω_x ω_z, ω_x ω_y [rad²/s²]
    field: tuple[Vectors, Vectors, Vectors]  # three rows of three (N,), M = S(ω̇) + S(ω)² [1/s²]


class ChainMotion:
    """The recursion of one robot, with its constants and work buffers."""

    def __init__(self, robot: Robot, capacity: int) -> None:
        rows = _FIRST_SCREW + 2 * robot.joint_count
        self._steps = [Step(segment) for segment in robot.segments]
        self._couplings = robot.couplings
        self._gravity = robot.gravity
        self._blocks = aligned_empty(3, rows, capacity)
        self._scratch = aligned_empty(2, rows, capacity)
        self._field = aligned_empty(3, 3, capacity)
        self._products = aligned_empty(3, capacity)

    def links(self, q: Array, qd: Array, qdd: Array) -> Iterator[LinkMotion]:
        """Motion of link 1, 2, … n in turn; `q`, `qd`, `qdd`: (n, N), a contiguous row a joint."""
        moving = _Frame(self._blocks, self._scratch, self._field, self._products, samples=q.shape[1])
        moving.rest(self._gravity)
        for coupling, step in zip(self._couplings, self._steps, strict=True):
            joint, ratio = coupling.joint, coupling.multiplier
            position, velocity, acceleration = q[joint], qd[joint], qdd[joint]
            if (ratio, coupling.offset) != (1.0, 0.0):
                position, velocity, acceleration = (
                    ratio * position + coupling.offset,
                    ratio * velocity,
                    ratio * acceleration,
                )
            moving.shift(step.before)
            for plane, cosine, sine in step.turns_before:
                moving.turn(plane, cosine, sine)
            if step.revolute:
                moving.turn(ABOUT_Z, *_cosine_and_sine(position + step.angle))
                moving.spin(joint, ratio, velocity, acceleration)
            else:
                moving.slide(joint, ratio, velocity, acceleration)
            for plane, cosine, sine in step.turns_after:
                moving.turn(plane, cosine, sine)
            moving.update_field()
            moving.shift(step.after if step.revolute else step.slid(position))
            yield moving.view()


class _Frame:
    """The frame that travels along the chain, and every vector seen in it."""

    def __init__(self, blocks: Array, scratch: Array, field: Array, products: Array, samples: int) -> None:
        self._blocks = [block[:, :samples] for block in blocks]
        self._scratch = scratch[..., :samples]
        x, y, z = (_vectors(row, samples) for row in field)
        self._field = x, y, z
        self._products = _vectors(products, samples)
        self._rows = _FIRST_SCREW

    def rest(self, gravity: Array) -> None:
        """Start at the base, which accelerates against gravity."""
        for row in self._field:
            for entry in row:
                entry[:] = 0.0
        for k, block in enumerate(self._blocks):
            block[:2] = 0.0
            block[2] = -gravity[k]

    def view(self) -> LinkMotion:
        """All that the link's row of the regressor needs."""
        x, y, z = (block[: self._rows] for block in self._blocks)
        angular, linear = slice(_FIRST_SCREW, None, 2), slice(_FIRST_SCREW + 1, None, 2)
        return LinkMotion(
            (x[angular], y[angular], z[angular]),
            (x[linear], y[linear], z[linear]),
            (x[0], y[0], z[0]),
            (x[1], y[1], z[1]),
            (x[2], y[2], z[2]),
            self._products,
            self._field,
        )

    def turn(self, plane: Plane, cosine: float | Array, sine: float | Array) -> None:
        """See every vector in a frame turned in a plane: x_i ← c x_i + s x_k, x_k ← c x_k - s x_i."""
        i, k = plane
        if isinstance(cosine, float) and cosine == 0.0:
            # A right angle: components trade places, and one changes its sign.
            self._blocks[i], self._blocks[k] = self._blocks[k], self._blocks[i]
            flipped = self._blocks[k if sine > 0 else i][: self._rows]
            flipped *= -1.0  # np.negative of NumPy 2.4 reads past columns of a single sample
            return
        first, second = self._blocks[i][: self._rows], self._blocks[k][: self._rows]
        from_first = np.multiply(first, sine, out=self._scratch[0, : self._rows])
        from_second = np.multiply(second, sine, out=self._scratch[1, : self._rows])
        first *= cosine
        first += from_second
        second *= cosine
        second -= from_first

    def spin(self, joint: int, ratio: float, qd: Array, qdd: Array) -> None:
        """Pass a revolute joint: ω + ẑ q̇, ω̇ + ẑ q̈ + ω × ẑ q̇, and its screw."""
        x, y, z = self._blocks
        scratch = self._scratch[0, 0]
        np.add(z[0], qd, out=z[0])
        np.add(z[1], qdd, out=z[1])
        _add_product(x[1], y[0], qd, scratch)
        _subtract_product(y[1], x[0], qd, scratch)
        self._add_to_screw(joint, angular=ratio, linear=0.0)

    def slide(self, joint: int, ratio: float, qd: Array, qdd: Array) -> None:
        """Pass a prismatic joint: a + ẑ q̈ + 2 ω × ẑ q̇, and its screw; the way along ẑ is left to `shift`."""
        x, y, z = self._blocks
        twice, scratch = np.multiply(qd, 2.0, out=self._scratch[0, 0]), self._scratch[1, 0]
        np.add(z[2], qdd, out=z[2])
        _add_product(x[2], y[0], twice, scratch)
        _subtract_product(y[2], x[0], twice, scratch)
        self._add_to_screw(joint, angular=0.0, linear=ratio)

    def _add_to_screw(self, joint: int, angular: float, linear: float) -> None:
        """Add a motion along z to a joint's screw, which starts at zero where the joint is met first."""
        row = _FIRST_SCREW + 2 * joint
        if row == self._rows:
            for block in self._blocks:
                block[row : row + 2] = 0.0
            self._rows += 2
        self._blocks[2][row] += angular
        self._blocks[2][row + 1] += linear

    def update_field(self) -> None:
        """M = S(ω̇) + S(ω)², and the products of ω's components that it is made of."""
        omega, rate = [block[0] for block in self._blocks], [block[1] for block in self._blocks]
        squares = [np.multiply(omega[k], omega[k], out=self._scratch[0, k]) for k in range(3)]
        for k in range(3):
            i, j = (k + 1) % 3, (k + 2) % 3
            product = np.multiply(omega[i], omega[j], out=self._products[k])
            np.subtract(product, rate[k], out=self._field[i][j])
            np.add(product, rate[k], out=self._field[j][i])
            np.add(squares[i], squares[j], out=self._field[k][k])
            np.negative(self._field[k][k], out=self._field[k][k])

    def shift(self, offset: Offset) -> None:
        """Move the origin by p: a + M p, v_i + w_i × p."""
        joints = (self._rows - _FIRST_SCREW) // 2
        if not joints:
            return  # Nothing turns yet at the base.
        for k, length in enumerate(offset):
            if isinstance(length, float) and length == 0.0:
                continue
            for block, row in zip(self._blocks, self._field, strict=True):
                _add_product(block[2], row[k], length, self._scratch[0, 0])
            after, last = self._blocks[(k + 1) % 3], self._blocks[(k + 2) % 3]
            angular, linear = slice(_FIRST_SCREW, self._rows, 2), slice(_FIRST_SCREW + 1, self._rows, 2)
            _add_product(after[linear], last[angular], length, self._scratch[0, :joints])
            _subtract_product(last[linear], after[angular], length, self._scratch[0, :joints])


def _vectors(buffer: Array, samples: int) -> Vectors:
    x, y, z = buffer[:, :samples]
    return x, y, z


def _add_product(target: Array, factor: Array, other: float | Array, scratch: Array) -> None:
    np.multiply(factor, other, out=scratch)
    np.add(target, scratch, out=target)


def _subtract_product(target: Array, factor: Array, other: float | Array, scratch: Array) -> None:
    np.multiply(factor, other, out=scratch)
    np.subtract(target, scratch, out=target)


def _cosine_and_sine(angle: Array) -> tuple[Array, Array]:
    """Both from t = tan(angle / 2), which NumPy computes in vector registers: a third of the time of two calls."""
    tangent = np.tan(angle * 0.5)
    twice = tangent * tangent
    twice += 1.0
    np.divide(2.0, twice, out=twice)
    tangent *= twice
    twice -= 1.0
    return twice, tangent


def aligned_empty(*shape: int) -> Array:
    """An uninitialised array, (*shape,), whose rows along the last axis start where wide vector registers like it."""
    item = np.dtype(np.float64).itemsize
    width = -(-shape[-1] * item // _ALIGNMENT) * _ALIGNMENT // item
    size = int(np.prod(shape[:-1])) * width
    memory = np.empty(size + _ALIGNMENT // item)
    start = -memory.ctypes.data % _ALIGNMENT // item
    return memory[start : start + size].reshape(*shape[:-1], width)[..., : shape[-1]]
