"""The simulated drives with the arm that they move: everything on the far side of the bus, in its own time."""

import copy
from collections import deque
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from tauscope.errors import ScenarioError
from tauscope.robot.robot import Array, Robot
from tauscope_drivers import ArmState, Capabilities, ControlMode, DriveLimits, DriverError, Setpoint, StopPolicy
from tauscope_drivers.errors import DriverErrorKind
from tauscope_drivers.limits import require_finite, require_sensible
from tauscope_sim.device.drives import COMMANDED, COMMANDED_BY, POWERED, Activity, Drives, Motion, stopped_by
from tauscope_sim.device.faults import Disturbances, FaultCode, FaultLatch, Injection, device_fault
from tauscope_sim.device.mechanism import Mechanism
from tauscope_sim.scenario import Scenario

TICK_NS = 500_000  # time between two ticks of the drives: 2 kHz [ns]
HOTTEST = 85.0  # temperature of a motor above which its drive reports a fault [°C]
WATCHDOG_RANGE_S = (0.005, 10.0)  # shortest and longest time of the watchdog [s]

_TICK_S = TICK_NS * 1e-9
_TICKS_PER_TEMPERATURE = 64


def list_capabilities(joint_count: int, largest_rate_hz: float) -> Capabilities:
    """What simulated drives can do, at a rate that a connection to them carries [Hz]."""
    modes, policies = frozenset(ControlMode), frozenset(StopPolicy)
    return Capabilities(joint_count, modes, policies, largest_rate_hz, WATCHDOG_RANGE_S, takes_feed_forward=True)


class SimulatedDevice:
    """Drives and arm as a pure object: time passes only in `advance_to`, and the same calls give the same readings.

    The drives run at ticks of `TICK_NS`; a reading is that of the last tick. Setpoints count from the next tick on, or
    later by the scenario's latency; a stop has no latency.

    An arm that was never under power is braked: it stands still, and the time of the scenario's physics does not run.
    Enabling takes the load over from the brakes. There are no brakes afterwards: a stop with `StopPolicy.HOLD` brings
    all joints to rest within `tauscope_sim.device.target.STOP_TIME_S` and keeps them under power, one with
    `StopPolicy.TORQUE_OFF` lets the arm fall. In torque control the arm is held until the first setpoint comes, and the
    drives stop it by its policy, with a fault, before it leaves its range or its speed limit; in position control they
    keep the target within both.

    `start_position`: (n,), where the arm stands; None is `tauscope_sim.device.mechanism.resting_posture` [rad or m].
    `start_ns`: device time at which it begins to exist [ns].

    Raises RobotFileError where the robot file lacks what a simulation needs.
    Raises ScenarioError where the scenario does not fit the arm.
    """

    def __init__(
        self, robot: Robot, scenario: Scenario, *, start_position: ArrayLike | None = None, start_ns: int = 0
    ) -> None:
        count = robot.joint_count
        self._mechanism = Mechanism(robot, scenario, start_position, _TICK_S)
        self._disturbances = Disturbances(count)
        self._drives = Drives(robot, scenario, self._motion(), _TICK_S)
        self._latency_ticks = scenario.command_latency_s / _TICK_S
        self._pending: deque[tuple[float, Setpoint]] = deque()
        self._latch = FaultLatch()
        self.activity = Activity.BRAKED
        self._enabling: tuple[StopPolicy, int] | None = None  # how it is stopped, and after which silence [ns]
        self._start_ns, self._tick = start_ns, 0
        self.time_ns = self._fed_ns = start_ns
        self.capabilities = list_capabilities(count, 1.0 / _TICK_S)

    @property
    def fault_codes(self) -> tuple[str, ...]:
        """Codes of the latched faults."""
        return tuple(fault.code for fault in self._latch.faults)

    @property
    def true_motion(self) -> tuple[Array, Array]:
        """True position and velocity of the links, each (n,): what an onlooker sees."""
        return self._mechanism.true.link_position, self._mechanism.true.link_velocity

    def advance_to(self, time_ns: int) -> None:
        """Carry out every tick up to and at an instant; one that has passed changes nothing."""
        last = (time_ns - self._start_ns) // TICK_NS
        while self._tick <= last:
            if self.activity is Activity.BRAKED and not self._disturbances.waiting:
                self._tick = last
            self._carry_out_tick()
            self._tick += 1

    def read(self) -> ArmState:
        """What the drives report now."""
        position, velocity, effort = self._mechanism.reading()
        temperature = self._mechanism.true.temperature
        if self._disturbances.any:
            position = position + self._disturbances.slip
            temperature = temperature + self._disturbances.heat
            lost = self._disturbances.lost
            position, velocity, effort, temperature = (
                np.where(lost, np.nan, values) for values in (position, velocity, effort, temperature)
            )
        enabled = np.full(len(position), self.activity in POWERED)
        return ArmState(self.time_ns, position, velocity, effort, temperature, enabled, self._latch.faults)

    def enable(self, mode: ControlMode, limits: DriveLimits, stop_policy: StopPolicy, watchdog_s: float) -> None:
        """Take the arm under power where it stands, for `watchdog_s` [s]. Raises DriverError ``refused``, ``fault``."""
        if self.activity in COMMANDED:
            raise DriverError.refusal("the arm is enabled already; stop it before enabling it again")
        self._refuse_faults()
        shortest, longest = WATCHDOG_RANGE_S
        if not shortest <= watchdog_s <= longest:
            raise DriverError.refusal(
                f"the watchdog's time {watchdog_s} s is not within {shortest} to {longest} s; choose another"
            )
        motion = self._motion()
        require_sensible(limits, motion.position, [f"joint {number + 1}" for number in range(len(motion.position))])
        self._drives.enable(self.activity, motion, copy.deepcopy(limits))
        self._enabling = stop_policy, round(watchdog_s * 1e9)
        self.activity = COMMANDED_BY[mode]
        self._fed_ns = self.time_ns

    def command(self, setpoint: Setpoint, sent_ns: int | None = None) -> None:
        """Take a setpoint, feed the watchdog. Raises DriverError ``not-enabled``, ``refused``. `sent_ns`: None: now."""
        if self._enabling is None:
            raise DriverError(DriverErrorKind.NOT_ENABLED, "the arm is not enabled; enable it before sending setpoints")
        require_finite(setpoint, self.capabilities.joint_count)
        kept = copy.deepcopy(setpoint)
        if self.activity in COMMANDED:
            sent_ns = self.time_ns if sent_ns is None else sent_ns
            # a device that makes up for lost time has not come as far as the host yet
            self._fed_ns = max(self.time_ns, sent_ns)
            self._pending.append(((sent_ns - self._start_ns) / TICK_NS + self._latency_ticks, kept))

    def stop(self, policy: StopPolicy | None = None) -> None:
        """Stop the arm; legal at any time. Setpoints that are still on their way are forgotten."""
        if policy is None and self._enabling is not None and self.activity in COMMANDED:
            policy = self._enabling[0]
        self._enabling = None
        if policy is not None:
            self._stop(policy)

    def lose_host(self, detail: str) -> None:
        """The host is gone: what the watchdog would find out in its time."""
        if self.activity in COMMANDED:
            self._trip(FaultCode.WATCHDOG, None, detail)
        self._enabling = None

    def acknowledge_faults(self) -> None:
        """Clear the latched faults. Raises DriverError: ``fault`` where the cause of one persists."""
        self._latch.clear()
        self._look_for_faults()
        self._refuse_faults()

    def put_back(self) -> None:
        """Carry the arm back to where it began, without faults. Raises DriverError ``refused`` while it is enabled."""
        if self.activity in COMMANDED:
            raise DriverError.refusal("the arm is enabled; stop it before carrying it back")
        self._enabling = None
        self.activity = Activity.BRAKED
        self._latch.clear()
        self._disturbances = Disturbances(self.capabilities.joint_count)
        self._mechanism.put_back(self._tick)

    def inject(self, injection: Injection) -> None:
        """Make a disturbance happen. Raises DriverError ``refused`` where no such joint."""
        if not 1 <= injection.joint <= self.capabilities.joint_count:
            raise DriverError.refusal(
                f"joint {injection.joint}: the arm has {self.capabilities.joint_count} joints; name one of them"
            )
        begins = max(injection.start_ns, self.time_ns + TICK_NS)
        self._disturbances.add(replace(injection, start_ns=begins))

    def _carry_out_tick(self) -> None:
        self.time_ns = self._start_ns + self._tick * TICK_NS
        if self._disturbances.waiting or self._tick % _TICKS_PER_TEMPERATURE == 0:
            self._disturbances.update(self.time_ns)
            self._look_for_faults()
        if self.activity is Activity.BRAKED:
            self._mechanism.rest(self._tick)
            return
        motion = self._motion()
        if self._enabling is not None and self.activity in COMMANDED:
            self._serve_host(self._enabling[1], motion)
        try:
            self._mechanism.move(self._drives.torque(self.activity, motion, self._tick), self._tick)
        except ScenarioError as error:
            # no arm moves like this: it is put to rest where it was, as if it had never been under power
            self.activity = Activity.BRAKED
            self._latch.latch(device_fault(FaultCode.UNSTABLE, None, str(error)))

    def _serve_host(self, watchdog_ns: int, motion: Motion) -> None:
        """Take the setpoints that are due; stop where none has come for too long, or where one leads too far."""
        while self._pending and self._pending[0][0] <= self._tick:
            arrival, setpoint = self._pending.popleft()
            self._drives.command(self.activity, setpoint, arrival)
        silence_ns = self.time_ns - self._fed_ns
        if silence_ns >= watchdog_ns:
            self._trip(FaultCode.WATCHDOG, None, f"no setpoint for {silence_ns * 1e-6:.1f} ms")
        elif self.activity is Activity.TORQUE and (overrun := self._drives.overrun(motion)) is not None:
            self._trip(*overrun)

    def _motion(self) -> Motion:
        true = self._mechanism.true
        position = true.motor_position + self._disturbances.slip if self._disturbances.any else true.motor_position
        return Motion(position, true.motor_velocity)

    def _stop(self, policy: StopPolicy) -> None:
        before, self.activity = self.activity, stopped_by(self.activity, policy)
        self._pending.clear()
        if self.activity is Activity.HOLDING and before is not Activity.HOLDING:
            self._drives.hold(before, self._motion())

    def _trip(self, code: FaultCode, joint: int | None, detail: str) -> None:
        """Latch a fault; where the host has the arm, stop by the policy that it left."""
        self._latch.latch(device_fault(code, joint, detail))
        if self._enabling is not None and self.activity in COMMANDED:
            self._stop(self._enabling[0])

    def _look_for_faults(self) -> None:
        temperature = self._mechanism.true.temperature + self._disturbances.heat
        for column in np.flatnonzero(temperature > HOTTEST).tolist():
            detail = f"motor at {temperature[column]:.0f} °C, above {HOTTEST:.0f} °C"
            self._trip(FaultCode.OVER_TEMPERATURE, column + 1, detail)
        for column in np.flatnonzero(self._disturbances.overloaded).tolist():
            self._trip(FaultCode.OVERLOAD, column + 1, "the drive reports an overload")

    def _refuse_faults(self) -> None:
        if faults := self._latch.faults:
            raise DriverError(DriverErrorKind.FAULT, "; ".join(str(fault) for fault in faults), faults)
