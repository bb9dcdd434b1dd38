"""The host's own loop where the drives take torque: proportional-derivative with feed-forward, weighed by inertia."""

import numpy as np

from tauscope.errors import AcquisitionError
from tauscope.robot import Robot
from tauscope.robot.robot import Array
from tauscope.runtime.plan import Plan, compute_inertia
from tauscope_drivers import ArmState

LEAST_RATE_HZ = 200.0  # fewer cycles a second make the loop sluggish or unstable
_VELOCITY_BANDWIDTHS = 5.0
_LEAST_INERTIA = 0.1


class TorqueControl:
    """τ = τ_ff + H(q_ref) (ω² (q_ref - q) + 2 ω (q̇_ref - q̇)), cut to the torque limits: critically damped.

    A tenth of each joint's largest inertia is added to H: in postures where a joint hardly feels the arm it is still
    held against friction.
    """

    def __init__(self, plan: Plan, inertia: Array, stride: int, bandwidth_rad_s: float) -> None:
        """Set the gains. `inertia`: (K, n, n), H at every `stride`-th cycle [kg m², kg m, kg]; `bandwidth_rad_s`: ω."""
        largest = np.diagonal(inertia, axis1=1, axis2=2).max(axis=0)
        self._inertia, self._stride = inertia + _LEAST_INERTIA * np.diag(largest), stride
        self._proportional, self._derivative = bandwidth_rad_s**2, 2.0 * bandwidth_rad_s
        self._plan = plan
        period_s = plan.period_ns * 1e-9
        self._share = 1.0 - np.exp(-_VELOCITY_BANDWIDTHS * bandwidth_rad_s * period_s)
        self._position: Array | None = None
        self._time_ns = 0
        self._velocity = np.zeros(inertia.shape[1])

    def torque(self, cycle: int, state: ArmState) -> Array:
        """Torque for a cycle [Nm or N], shape (n,)."""
        position, velocity = self._observe(state)
        plan = self._plan
        wanted = self._proportional * (plan.position[cycle] - position)
        wanted += self._derivative * (plan.velocity[cycle] - velocity)
        torque = plan.torque[cycle] + self._inertia[cycle // self._stride] @ wanted
        return np.clip(torque, -plan.limits.torque, plan.limits.torque)

    def _observe(self, state: ArmState) -> tuple[Array, Array]:
        """Position and velocity; velocity from positions, smoothed, where the drive reports none."""
        previous = state.position if self._position is None else self._position
        position = np.where(state.fresh, state.position, previous)
        elapsed_s = (state.time_ns - self._time_ns) * 1e-9
        if self._position is not None and elapsed_s > 0.0:
            rate = (position - self._position) / elapsed_s
            self._velocity = self._velocity + self._share * (rate - self._velocity)
        self._position, self._time_ns = position, state.time_ns
        return position, np.where(np.isfinite(state.velocity), state.velocity, self._velocity)


def torque_control(robot: Robot, plan: Plan, bandwidth_rad_s: float) -> TorqueControl:
    """The loop for an arm of known model. Raises AcquisitionError: no model, or too slow. `bandwidth_rad_s`: ω."""
    found = compute_inertia(robot, plan.position)
    if found is None:
        raise AcquisitionError(
            f"{robot.name}: torque mode takes its gains from the robot file's model, which is missing; "
            "add it, or let the drives track positions (mode position)"
        )
    if plan.rate_hz < LEAST_RATE_HZ:
        raise AcquisitionError(
            f"torque mode needs {LEAST_RATE_HZ:g} cycles a second or more, {plan.rate_hz:g} are possible; "
            "use mode position"
        )
    inertia, stride = found
    return TorqueControl(plan, inertia, stride, bandwidth_rad_s)
