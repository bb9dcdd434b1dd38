"""The arm behind emulated drives: what each drive demands becomes torque, and what the arm does, a measurement."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from tauscope.robot import Robot
from tauscope.robot.robot import Array
from tauscope_sim.canopen_bus.drive import AxisDemand, AxisMode, EmulatedDrive
from tauscope_sim.device.servo import InertiaSchedule, Servo
from tauscope_sim.device.target import Target, catching_up_acceleration
from tauscope_sim.scenario import Scenario

FASTEST = 1.25  # of a joint's speed limit: the voltage of its motor lets it turn no faster

# what is done by tracking a target: the master's, or the place where the joint comes to rest
TRACKING = (AxisMode.POSITION, AxisMode.HOLDING)


# what a drive does, and over which time it interpolates: drives that agree in both share a target
Kind = tuple[AxisMode, float]


class DrivenArm:
    """Moves an arm by the demands of its drives, a period of their loops at a time.

    In cyclic synchronous position mode a drive interpolates between the targets of SYNCs, over the period that 0x60C2
    tells; while it holds, or where targets stay away, it brakes on a ramp and stays where it came to rest. The arm
    stands on a stand until all its drives have had power once.
    """

    def __init__(
        self,
        drives: Sequence[EmulatedDrive],
        robot: Robot,
        scenario: Scenario,
        position: ArrayLike,
        period_s: float,
        torque_noise: float = 0.0,
    ) -> None:
        """Everything at rest at `position` (n,) [rad or m]. `torque_noise`: standard deviation measured [Nm or N]."""
        count = robot.joint_count
        self.torque = np.zeros(count)
        self.stands_on_stand = True
        self.encoder_offset = np.zeros(count)
        # one step a period unless its error asks for more: a processor that emulates by the clock has no time for two
        self._plant = scenario.plant(robot, step_s=period_s)
        self._plant.place(position)
        self._servo = Servo(robot, InertiaSchedule(robot, scenario.effects), period_s)
        limits = (joint.limits.velocity for joint in robot.joints)
        self._fastest = np.array([np.inf if limit is None else FASTEST * limit for limit in limits])
        self._acceleration = catching_up_acceleration(robot)
        self._torque_noise, self._rng = torque_noise, np.random.default_rng(0)
        self._drives = drives
        self._period_s = period_s
        self._kinds: list[Kind] = [(AxisMode.RELEASED, 0.0)] * count
        self._targets: dict[Kind, tuple[list[int], Target]] = {}
        self._tracks = np.zeros(count, dtype=np.bool_)
        self._goal, self._goal_rate = (values.copy() for values in self.motion)
        self._seen = self._seen_before = np.array([*self.motion, self.torque])
        self.measure()

    @property
    def motion(self) -> tuple[Array, Array]:
        """Position and velocity of the motors, in joint units, each (n,)."""
        return self._plant.motor_motion

    def take_targets(self, time_s: float) -> None:
        """Let the drives take over the targets that SYNC made valid. SYNC came [s]."""
        demands = self._demands()
        for (mode, _), (joints, target) in self._targets.items():
            if mode is AxisMode.POSITION:
                wanted = np.array([demands[joint].position for joint in joints]) - self.encoder_offset[joints]
                target.follow(wanted, None, time_s / self._period_s)

    def step(self, tick: int) -> None:
        """One period: torque from the demands of this instant, and the motion until the next."""
        demands = self._demands()
        for joints, target in self._targets.values():
            target.advance(tick)
            self._goal[joints], self._goal_rate[joints] = target.position, target.velocity
        torque = self._torque_of(demands)
        # torque is constant between two ticks: at the tick itself, the mean of both sides
        self._seen, self._seen_before = np.array([*self.motion, 0.5 * (self.torque + torque)]), self._seen
        self.torque = torque
        if self.stands_on_stand:
            self.stands_on_stand = any(mode is AxisMode.RELEASED for mode, _ in self._kinds)
        if not self.stands_on_stand:
            self._plant.advance(torque, self._period_s)

    def measure(self, part: float = 0.0) -> None:
        """Let the drives see their joints: real ones sample at SYNC, and their loops are faster than the steps here."""
        position, velocity, torque = self._seen + part * (self._seen - self._seen_before)
        at_tick = self._seen[2]
        torque = np.clip(torque, np.minimum(at_tick, self.torque), np.maximum(at_tick, self.torque))
        torque = torque + self._torque_noise * self._rng.standard_normal(len(self._drives))
        seen = zip(position + self.encoder_offset, velocity, torque, strict=True)
        for drive, values in zip(self._drives, seen, strict=True):
            drive.measure(*map(float, values))

    def _demands(self) -> list[AxisDemand]:
        """What the drives demand now; targets begin anew where a drive does something else than before."""
        demands = [drive.demand() for drive in self._drives]
        kinds = [(demand.mode, demand.interpolation_s) for demand in demands]
        if kinds != self._kinds:
            self._regroup(kinds)
        return demands

    def _regroup(self, kinds: list[Kind]) -> None:
        """Joints that do the same share a target, which begins where they are, or where their last one was."""
        position, velocity = self.motion
        for joint, (before, _) in enumerate(self._kinds):
            if before not in TRACKING:
                self._goal[joint], self._goal_rate[joint] = position[joint], velocity[joint]
        if [mode in TRACKING for mode, _ in kinds] != [mode in TRACKING for mode, _ in self._kinds]:
            self._servo.begin()
        self._kinds, self._targets = kinds, {}
        self._tracks = np.array([mode in TRACKING for mode, _ in kinds])
        for kind in dict.fromkeys(kinds):
            if kind[0] in TRACKING:
                joints = [joint for joint, other in enumerate(kinds) if other == kind]
                goal, rate, acceleration = self._goal[joints], self._goal_rate[joints], self._acceleration[joints]
                target = Target(goal, rate, acceleration, self._period_s, kind[1] / self._period_s or None)
                unlimited = np.full(len(joints), np.inf)
                target.limit(-unlimited, unlimited, self._fastest[joints])
                self._targets[kind] = joints, target

    def _torque_of(self, demands: Sequence[AxisDemand]) -> Array:
        """Torque of the position loops where a target is tracked, else what is demanded."""
        cap = np.array([demand.torque_cap for demand in demands])
        wanted = np.array([demand.torque for demand in demands])
        if self._targets:
            tracks = self._tracks
            position, velocity = self.motion
            error = np.where(tracks, self._goal - position, 0.0)
            error_rate = np.where(tracks, self._goal_rate - velocity, 0.0)
            self._servo.set_torque_limit(np.where(tracks, cap, np.inf))
            wanted = np.where(tracks, self._servo.track(error, error_rate, None, position), wanted)
        return np.clip(wanted, -cap, cap)
