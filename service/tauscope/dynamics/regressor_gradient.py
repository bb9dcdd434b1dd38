"""Gradient of any function of the regressor by the motion: one pass back along what the regressor is made of.

For a scalar S whose derivatives by the regressor's entries are known, G = ∂S/∂Φ, the chain rule asks for
Σ G ∂Φ/∂(q, q̇, q̈). Column by column that costs 3 n regressors; done backwards it costs about two, whatever n.

Link j's share of τ_i is linear in the link's ten parameters and in the joint screw (w_i, v_i) seen from link j
(`tauscope.dynamics.regressor`): τ_i = w_iᵀ n + v_iᵀ f. With row i of G as the parameters of a body, (n_i, f_i) is the
wrench that this body would need, hence ∂S/∂(w_i, v_i); ω, ω̇ and a collect theirs by the product rule. What remains is
how they depend on the motion, all seen from link j, s_i = (w_i, v_i), [x, y] the screws' cross product:

    ∂s_i/∂q_k = [s_i, s_k] for k > i, else 0
    V  = Σ_i s_i q̇_i                                           (ω, v)
    V' = Σ_k s_k q̈_k + [U_k, s_k] q̇_k,  U_k = Σ_{i<k} s_i q̇_i   (ω̇, v')
    a  = v' + ω × v + γ,  ∂γ/∂q_k = γ × w_k                      (γ: minus gravity)
"""

from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tauscope.dynamics.chain_motion import ChainMotion, LinkMotion
from tauscope.robot.robot import STANDARD_PARAMETERS, Array, Robot

Columns = NDArray[np.intp]

_PER_LINK = len(STANDARD_PARAMETERS)
_NEXT, _LAST = np.array([1, 2, 0]), np.array([2, 0, 1])


class Screws(NamedTuple):
    """Screws or wrenches, one a joint: angular part (or moment) and linear part (or force), each (3, j, N)."""

    angular: Array
    linear: Array


class RegressorGradient:
    """Gradients of functions of one robot's torque regressor of some `columns`, (C,) int, or of all."""

    def __init__(self, robot: Robot, *, columns: Columns | None = None, capacity: int) -> None:
        links = robot.link_count
        wanted = np.arange(_PER_LINK * links) if columns is None else np.asarray(columns)
        # The screws of one joint's segments are added up in Φ but change apart: each segment counts as a joint here.
        apart = tuple(replace(segment, coupling=None) for segment in robot.segments)
        self._motion = ChainMotion(replace(robot, joints=(robot.joints * links)[:links], segments=apart), capacity)
        self._is_coupled = any(segment.coupling for segment in robot.segments)
        self._offsets = np.array([each.offset for each in robot.couplings])
        self._ratios = robot.ratios
        self._places = [np.flatnonzero(wanted // _PER_LINK == link) for link in range(links)]
        self._parameters = [wanted[places] % _PER_LINK for places in self._places]

    def contract(self, q: Array, qd: Array, qdd: Array, weight: Array) -> tuple[Array, Array, Array]:
        """Σ G ∂Φ/∂q, Σ G ∂Φ/∂q̇, Σ G ∂Φ/∂q̈, (N, n) each, sample by sample; `q`, `qd`, `qdd`: (N, n).

        `weight`: (n, C, N), G = ∂S/∂Φ, laid out as `TorqueRegressor.write` writes Φ.
        """
        state = [self._ratios @ array.T for array in (q, qd, qdd)]
        state[0] += self._offsets[:, None]
        if self._is_coupled:
            weight = np.tensordot(self._ratios, weight, axes=1)
        gradient = [np.zeros_like(array) for array in state]
        for link, motion in enumerate(self._motion.links(*state)):
            bodies = np.zeros((_PER_LINK, link + 1, len(q)))
            bodies[self._parameters[link]] = weight[: link + 1, self._places[link]].swapaxes(0, 1)
            inner = slice(0, link + 1)
            parts = _link_gradient(motion, bodies, state[1][inner], state[2][inner])
            for total, part in zip(gradient, parts, strict=True):
                total[inner] += part
        q_bar, qd_bar, qdd_bar = (np.ascontiguousarray((self._ratios.T @ array).T) for array in gradient)
        return q_bar, qd_bar, qdd_bar


def _link_gradient(motion: LinkMotion, bodies: Array, qd: Array, qdd: Array) -> tuple[Array, Array, Array]:
    """Shares of one link in ∂S/∂q, ∂S/∂q̇, ∂S/∂q̈, each (j, N)."""
    screws = Screws(np.stack(motion.screw_angular), np.stack(motion.screw_linear))
    omega, omega_dot, acceleration = (
        np.stack(vector)[:, None]
        for vector in (motion.angular_velocity, motion.angular_acceleration, motion.acceleration)
    )
    inertia, mass, moment = bodies[:6], bodies[6], bodies[7:]
    wrench = _wrench(inertia, mass, moment, omega, omega_dot, acceleration)
    of_omega, of_omega_dot, of_acceleration = _motion_gradient(inertia, mass, moment, screws, omega)

    before = _sum_before(_scaled(screws, qd))  # U_k
    turned = _bracket(before, screws)  # [U_k, s_k]
    velocity = (screws.linear * qd).sum(axis=1, keepdims=True)
    bodily = (screws.linear * qdd + turned.linear * qd).sum(axis=1, keepdims=True)
    against_gravity = acceleration - bodily - _cross(omega, velocity)  # γ

    # a = v' + ω × v + γ
    of_omega = of_omega + _cross(velocity, of_acceleration)
    of_v = Screws(of_omega, _cross(of_acceleration, omega))
    of_v_dot = Screws(of_omega_dot, of_acceleration)

    # V' = Σ s_k q̈_k + [U_k, s_k] q̇_k
    of_qdd = _power(of_v_dot, screws)
    of_qd = _power(of_v_dot, turned)
    of_turned = _scaled(of_v_dot, qd)
    of_screws = _sum(wrench, _scaled(of_v_dot, qdd), _of_second(of_turned, before))
    of_before = _sum_after(_of_first(of_turned, screws))

    # U_k and V gather s_i q̇_i.
    gathered = _sum(of_before, of_v)
    of_qd += _power(gathered, screws)
    of_screws = _sum(of_screws, _scaled(gathered, qd))

    # ∂s_i/∂q_k = [s_i, s_k] for i < k, and γ turns with every joint.
    of_q = _power(_sum_before(_of_second(of_screws, screws)), screws)
    of_q += (screws.angular * _cross(of_acceleration, against_gravity)).sum(axis=0)
    return of_q, of_qd, of_qdd


def _wrench(inertia: Array, mass: Array, moment: Array, omega: Array, omega_dot: Array, acceleration: Array) -> Screws:
    """Wrench n = I ω̇ + ω × I ω + ms × a and f = m a + ω̇ × ms + ω × (ω × ms) of every body."""
    n = _times(inertia, omega_dot) + _cross(omega, _times(inertia, omega)) + _cross(moment, acceleration)
    f = mass * acceleration + _cross(omega_dot, moment) + _cross(omega, _cross(omega, moment))
    return Screws(n, f)


def _motion_gradient(
    inertia: Array, mass: Array, moment: Array, screws: Screws, omega: Array
) -> tuple[Array, Array, Array]:
    """Derivatives of Σ wᵀ n + vᵀ f by ω, ω̇ and a, each (3, 1, N)."""
    w, v = screws
    inertia_w = _times(inertia, w)
    of_omega = (
        _cross(_times(inertia, omega), w)
        + _times(inertia, _cross(w, omega))
        + v * (omega * moment).sum(axis=0)
        + moment * (omega * v).sum(axis=0)
        - 2.0 * omega * (v * moment).sum(axis=0)
    )
    of_omega_dot = inertia_w + _cross(moment, v)
    of_acceleration = _cross(w, moment) + mass * v
    return (
        of_omega.sum(axis=1, keepdims=True),
        of_omega_dot.sum(axis=1, keepdims=True),
        of_acceleration.sum(axis=1, keepdims=True),
    )


def _cross(a: Array, b: Array) -> Array:
    """Product a × b along the first axis."""
    return a[_NEXT] * b[_LAST] - a[_LAST] * b[_NEXT]


def _times(inertia: Array, vector: Array) -> Array:
    """I x for the six entries xx, yy, zz, xy, xz, yz."""
    xx, yy, zz, xy, xz, yz = inertia
    x, y, z = vector
    return np.stack([xx * x + xy * y + xz * z, xy * x + yy * y + yz * z, xz * x + yz * y + zz * z])


def _bracket(first: Screws, second: Screws) -> Screws:
    """[x, y] = (w × w', w × v' + v × w')."""
    return Screws(
        _cross(first.angular, second.angular),
        _cross(first.angular, second.linear) + _cross(first.linear, second.angular),
    )


def _of_second(wrench: Screws, first: Screws) -> Screws:
    """The covector z with z · y = wrench · [first, y]."""
    return Screws(
        _cross(wrench.angular, first.angular) + _cross(wrench.linear, first.linear),
        _cross(wrench.linear, first.angular),
    )


def _of_first(wrench: Screws, second: Screws) -> Screws:
    """The covector z with z · x = wrench · [x, second]."""
    opposite = _of_second(wrench, second)
    return Screws(-opposite.angular, -opposite.linear)


def _power(wrench: Screws, screws: Screws) -> Array:
    """Power of wrenches along screws, (j, N)."""
    return (wrench.angular * screws.angular).sum(axis=0) + (wrench.linear * screws.linear).sum(axis=0)


def _scaled(screws: Screws, factor: Array) -> Screws:
    return Screws(screws.angular * factor, screws.linear * factor)


def _sum(*screws: Screws) -> Screws:
    first, *others = screws
    angular, linear = first
    for other in others:
        angular, linear = angular + other.angular, linear + other.linear
    return Screws(angular, linear)


def _sum_before(screws: Screws) -> Screws:
    """For each joint the sum over the joints before it."""
    return Screws(*(np.cumsum(part, axis=1) - part for part in screws))


def _sum_after(screws: Screws) -> Screws:
    """For each joint the sum over the joints after it."""
    return Screws(*(part.sum(axis=1, keepdims=True) - np.cumsum(part, axis=1) for part in screws))
