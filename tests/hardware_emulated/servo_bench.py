"""Arms of emulated servos in a process of their own, and the drivers that are plugged into them."""

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

import feetech_bus
from emulator_process import EmulatorProcess
from feetech_bus import FeetechOrder
from prompt_process import prompt_process
from tauscope_drivers import ArmState, Backend, ControlMode, DriveLimits, Setpoint, StopPolicy
from tauscope_drivers.drive_block import DriveJoint
from tauscope_drivers.dynamixel.arm import DynamixelArm
from tauscope_drivers.feetech.arm import FeetechArm
from tauscope_sim.dynamixel_bus import DynamixelOrder, ServoSpecification

TORQUE_PER_UNIT = 0.01
"""Of the driver's unit of effort [Nm]."""

SLACK_S = 0.03
"""Answers are waited for this much longer than the bus takes: the machine of a test may be busy."""

WATCHDOG_S = 0.4
PERIOD_S = 0.005

GLANCE_S = 0.002
"""Between two looks at the device, which has its own work to do."""


@dataclass
class Bench:
    """The emulator, and arms to plug into it."""

    emulator: EmulatorProcess
    drives: list[dict[str, Any]]
    make_arm: Any = DynamixelArm
    arms: list[Any] = field(default_factory=list)

    def arm(self, torque_constant: float | None = TORQUE_PER_UNIT, **changes: Any) -> Any:
        joints = [
            DriveJoint(f"joint{number}", {**drive, **changes}, torque_per_unit=torque_constant)
            for number, drive in enumerate(self.drives, 1)
        ]
        self.arms.append(self.make_arm(joints, slack_s=SLACK_S))
        return self.arms[-1]

    def enabled_arm(self, mode: ControlMode = ControlMode.POSITION, **options: Any) -> Any:
        arm = self.arm()
        arm.connect()
        policy = StopPolicy.HOLD if mode is ControlMode.POSITION else StopPolicy.TORQUE_OFF
        arm.enable(mode, limits(len(self.drives)), policy, options.get("watchdog_s", WATCHDOG_S))
        return arm

    def clear(self) -> None:
        """Unplug every arm."""
        while self.arms:
            self.arms.pop().disconnect()

    def anew(self) -> "Bench":
        """The same servos, as delivered."""
        self.clear()
        self.emulator.reset()
        return self

    @property
    def position(self) -> np.ndarray:
        return np.array(self.emulator.state["position"])

    def wait_until(self, condition: Callable[[dict[str, Any]], bool], timeout_s: float = 10.0) -> dict[str, Any]:
        """State of the device once it is as wanted."""
        deadline = time.monotonic() + timeout_s
        while not condition(state := self.emulator.state):
            assert time.monotonic() < deadline, f"not within {timeout_s} s: {state}"
            time.sleep(GLANCE_S)
        return state

    def let_pass(self, seconds: float) -> dict[str, Any]:
        """State of the device when so much of its own time has passed."""
        end = self.emulator.state["time"] + seconds
        return self.wait_until(lambda state: state["time"] >= end)


@contextmanager
def bench(
    folder: Path, servos: int | tuple[ServoSpecification, ...] = 3, *, start: float = 0.2, **options: Any
) -> Iterator[Bench]:
    """An emulated arm of pendulums, all of them in the same place."""
    if isinstance(servos, int):
        specification = ServoSpecification(1, torque_per_milliampere=TORQUE_PER_UNIT)
        servos = tuple(replace(specification, servo=number) for number in range(1, servos + 1))
    drives = [{"id": servo.servo, "baud": servo.baud} for servo in servos]
    with _bench(folder, drives, partial(DynamixelOrder, servos=servos, **options), start, DynamixelArm) as one:
        yield one


@contextmanager
def feetech_bench(folder: Path, *, start: float = 0.2, **options: Any) -> Iterator[Bench]:
    """The same with three STS3215 servos, which answer at once."""
    quick = {"return_delay": 0}
    servos = tuple(
        feetech_bus.ServoSpecification(number, torque_per_permille=TORQUE_PER_UNIT, registers=quick)
        for number in (1, 2, 3)
    )
    drives = [{"servo_id": servo.servo} for servo in servos]
    with _bench(folder, drives, partial(FeetechOrder, servos=servos, **options), start, FeetechArm) as one:
        yield one


@contextmanager
def _bench(folder: Path, drives: list[dict[str, Any]], order: Any, start: float, make_arm: Any) -> Iterator[Bench]:
    port = str(folder / "port")
    places, control = (start,) * len(drives), str(folder / "control")
    asked = order(start=places, port=port, control=control, trace=str(folder / "trace"))
    with EmulatorProcess(asked) as emulator:
        one = Bench(emulator, [{**drive, "port": port} for drive in drives], make_arm)
        try:
            yield one
        finally:
            one.clear()


def limits(count: int, **changes: float) -> DriveLimits:
    values = {"position_low": -3.0, "position_high": 3.0, "velocity": 3.0, "torque": 8.0} | changes
    return DriveLimits(**{name: np.full(count, value) for name, value in values.items()})


def setpoint(position: Any, torque: Any = 0.0) -> Setpoint:
    place = np.array(position, dtype=np.float64)
    return Setpoint(place, np.zeros_like(place) + np.array(torque, dtype=np.float64))


def drive(arm: Backend, target: Callable[[float], Setpoint], seconds: float) -> list[ArmState]:
    """States of cycles at the usual rate, or as fast as the machine can; each target is that of its instant."""
    clock = arm.clock
    begin = deadline = clock.now_ns()
    states: list[ArmState] = []
    with prompt_process():
        while deadline < begin + round(seconds * 1e9):
            states.append(arm.exchange(target((clock.now_ns() - begin) * 1e-9)))
            deadline = max(deadline + round(PERIOD_S * 1e9), clock.now_ns())
            clock.wait_until_ns(deadline)
    return states
