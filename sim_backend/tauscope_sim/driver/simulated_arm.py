"""The simulated arm in virtual time: a whole run takes as long as it takes to compute."""

from collections.abc import Callable

from numpy.typing import ArrayLike

from tauscope.robot.robot import Robot
from tauscope_drivers import ArmState, ControlMode, DriveLimits, DriverError, Setpoint, StopPolicy
from tauscope_drivers.errors import DriverErrorKind
from tauscope_sim.device import SimulatedDevice
from tauscope_sim.scenario import Scenario


class VirtualClock:
    """The clock of a simulated device. `start_ns`: first instant; `advance`: lets the device live up to one [ns]."""

    def __init__(self, start_ns: int, advance: Callable[[int], None]) -> None:
        self._now_ns = start_ns
        self._advance = advance

    def now_ns(self) -> int:
        """The present instant [ns]."""
        return self._now_ns

    def wait_until_ns(self, deadline_ns: int) -> int:
        """Let the device live up to a deadline, and return there; at once where it has passed."""
        if deadline_ns > self._now_ns:
            self._now_ns = deadline_ns
            self._advance(deadline_ns)
        return self._now_ns


class SimulatedArm:
    """A backend whose clock carries the device forward, which keeps its place and faults while disconnected.

    `start_position`: (n,), None: `tauscope_sim.device.mechanism.resting_posture` [rad or m]. Raises as
    `SimulatedDevice` does.
    """

    def __init__(
        self, robot: Robot, scenario: Scenario | None = None, *, start_position: ArrayLike | None = None
    ) -> None:
        kept = Scenario() if scenario is None else scenario
        self.device = SimulatedDevice(robot, kept, start_position=start_position)
        """the drives and the arm, for tests and demonstrations"""
        self.capabilities = self.device.capabilities
        self.clock = VirtualClock(self.device.time_ns, self.device.advance_to)
        self._connected = False

    def connect(self) -> ArmState:
        """Reach the device and read it. Raises DriverError: ``cannot-connect`` where it is connected already."""
        if self._connected:
            raise DriverError.no_connection("the arm is connected already; disconnect it first")
        self._connected = True
        return self.device.read()

    def acknowledge_faults(self) -> ArmState:
        """Clear the latched faults; see `drivers.Backend`."""
        self._require_connection()
        self.device.acknowledge_faults()
        return self.device.read()

    def enable(
        self,
        mode: ControlMode,
        limits: DriveLimits,
        stop_policy: StopPolicy,
        watchdog_s: float,
        cycle_s: float | None = None,
    ) -> ArmState:
        """Take the arm under power; see `drivers.Backend`. `watchdog_s`: without `exchange`, in virtual time [s]."""
        del cycle_s
        self._require_connection()
        self.device.enable(mode, limits, stop_policy, watchdog_s)
        return self.device.read()

    def exchange(self, setpoint: Setpoint) -> ArmState:
        """Write the setpoints, read the arm; see `drivers.Backend`."""
        self._require_connection()
        self.device.command(setpoint, self.clock.now_ns())
        return self.device.read()

    def stop(self, policy: StopPolicy) -> ArmState:
        """Stop the arm; legal at any time, also while disconnected."""
        self.device.stop(policy)
        return self.device.read()

    def disconnect(self) -> None:
        """Let go of the device; an arm that is still enabled is stopped by its own policy first."""
        self.device.stop()
        self._connected = False

    def _require_connection(self) -> None:
        if not self._connected:
            raise DriverError(DriverErrorKind.NOT_CONNECTED, "the arm is not connected; connect it first")
