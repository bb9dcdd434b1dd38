"""The protocol that every backend implements, and what it declares of itself.

The order of calls is fixed: ``connect``, ``enable``, any number of ``exchange``, ``stop``, ``disconnect``. ``stop`` and
``disconnect`` are legal at any time and any number of times. Between ``enable`` and ``stop`` the device's own watchdog
is armed: where no ``exchange`` reaches the device within its time, the device stops by itself and reports the fault
``watchdog`` until it is acknowledged. Drives without a watchdog may be driven in position mode alone, where they hold
their last target; their backend reports the fault as soon as it is called again.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum
from typing import Protocol

from tauscope_drivers.clock import Clock
from tauscope_drivers.state import ArmState, Array, Setpoint


class ControlMode(StrEnum):
    """Who closes the loop."""

    POSITION = "position"
    """The drives track positions with a torque cap: Dynamixel current-based position, CiA 402 cyclic synchronous."""
    TORQUE = "torque"  # the host commands torque: Dynamixel current, CiA 402 cyclic synchronous torque


class StopPolicy(StrEnum):
    """What the arm does when it is stopped."""

    HOLD = "hold"  # stay under power at the place of the stop
    DAMP = "damp"  # resist motion in proportion to speed: a falling arm sinks slowly
    TORQUE_OFF = "torque_off"  # no torque: for arms that are balanced or braked


@dataclass(frozen=True, eq=False)
class DriveLimits:
    """What the drives enforce, set before they have torque; infinite: none. `position_low`, `position_high`: (n,)."""

    position_low: Array
    position_high: Array
    velocity: Array  # (n,), largest speed [rad/s or m/s]
    torque: Array  # (n,), largest torque [Nm or N]


@dataclass(frozen=True)
class Capabilities:
    """What a backend can do, known without motion.

    `policies_by_mode`: what the device does itself in each mode; None: all; `remarks`: what drives lack, known once
    connected.
    """

    joint_count: int
    modes: frozenset[ControlMode]
    stop_policies: frozenset[StopPolicy]
    largest_rate_hz: float
    watchdog_range_s: tuple[float, float]  # shortest and longest time of the device's watchdog [s]
    takes_feed_forward: bool
    effort_unit: str = "Nm"
    policies_by_mode: Mapping[ControlMode, frozenset[StopPolicy]] | None = None
    rate_limited_by: str = ""
    holds_before_torque: bool = True
    remarks: tuple[str, ...] = ()

    def policies_in(self, mode: ControlMode) -> frozenset[StopPolicy]:
        """Ways to stop that the device carries out itself when its host is gone."""
        return self.stop_policies if self.policies_by_mode is None else self.policies_by_mode.get(mode, frozenset())


class Backend(Protocol):
    """An arm that can be moved: real drives on a bus, or a simulation of them."""

    @property
    def capabilities(self) -> Capabilities:
        """What it can do."""
        ...

    @property
    def clock(self) -> Clock:
        """The clock that its control loop runs by."""
        ...

    def connect(self) -> ArmState:
        """Reach and read every drive; moves nothing. Raises DriverError ``cannot-connect``: missing or wrong."""
        ...

    def acknowledge_faults(self) -> ArmState:
        """Clear latched faults on the operator's word; moves none. Raises DriverError ``not-connected``, ``fault``."""
        ...

    def enable(
        self,
        mode: ControlMode,
        limits: DriveLimits,
        stop_policy: StopPolicy,
        watchdog_s: float,
        cycle_s: float | None = None,
    ) -> ArmState:
        """Take the arm under power where it stands: targets := present, limits and watchdog read back, then torque.

        Raises DriverError: ``not-connected``, ``refused`` (a mode, policy or time that the backend cannot do), or
        ``fault`` (latched and not acknowledged).
        `cycle_s`: time between two calls of `exchange`, for drives that interpolate between targets; None where it is
        not known [s].
        """
        ...

    def exchange(self, setpoint: Setpoint) -> ArmState:
        """One cycle: write the setpoints, read the arm. Feeds the watchdog; never waits longer than the bus takes.

        A drive that does not answer leaves NaN in the state; a fault that it reports stands in `ArmState.faults`.
        Raises DriverError: ``not-enabled``, ``refused`` (a target that is not finite: nothing is sent), or ``lost``
        (the bus is gone).
        """
        ...

    def stop(self, policy: StopPolicy) -> ArmState:
        """Stop the arm; afterwards it needs no cycles and stays so until `enable`."""
        ...

    def disconnect(self) -> None:
        """Let go of the bus; an arm that is still enabled is stopped by its own policy first."""
