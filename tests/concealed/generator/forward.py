"""Forward physics without noise: what the arm does under its drives, kept on disk because it takes long.

Noise is added afterwards (`concealed.generator.sensing`): the simulated drives' own loop does not see it, so one
passage serves any number of noisy recordings.
"""

import hashlib
import json
import os
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from concealed.generator.motions import Asked
from concealed.generator.rates import FINE, RATE_HZ
from tauscope.robot import Robot, robot_to_dict
from tauscope_drivers import ControlMode, DriveLimits, Setpoint, StopPolicy
from tauscope_sim.driver import SimulatedArm
from tauscope_sim.effects import EFFECTS, Effect, SensorEffect
from tauscope_sim.scenario import Scenario

Array = NDArray[np.float64]
Entry = dict[str, Any]
"""An effect as a scenario file writes it."""

CACHE = Path(os.environ.get("TAUSCOPE_CONCEALED_CACHE", Path(tempfile.gettempdir()) / "tauscope-concealed"))
"""Where passages are kept; never in the repository."""


@dataclass(frozen=True, eq=False)
class Passage:
    """One motion as it truly was, at 1 kHz.

    position, velocity, torque : (N, n) float64
        of the motors on the joint's side [rad, rad/s, Nm]
    """

    position: Array
    velocity: Array
    torque: Array

    @property
    def recorded(self) -> tuple[Array, Array]:
        """Position and torque at the recording's rate."""
        return self.position[::FINE], self.torque[::FINE]


def physical(entries: Sequence[Entry]) -> tuple[Effect, ...]:
    """The entries that change the motion."""
    return tuple(e for e in map(_effect, entries) if isinstance(e, Effect))


def sensory(entries: Sequence[Entry]) -> tuple[SensorEffect, ...]:
    """The entries that change the recording alone."""
    return tuple(e for e in map(_effect, entries) if isinstance(e, SensorEffect))


def _effect(entry: Entry) -> Any:
    return EFFECTS[entry["effect"]].model_validate({key: value for key, value in entry.items() if key != "effect"})


def passage(robot: Robot, entries: Sequence[Entry], motion: Asked) -> Passage:
    """The motion under the physical ones of some effects; from disk where it was made before."""
    acting = [entry for entry in entries if physical([entry])]
    setpoints = motion.setpoints
    described = json.dumps([robot_to_dict(robot), acting, RATE_HZ, FINE], sort_keys=True, default=str)
    key = hashlib.sha256(described.encode() + setpoints.tobytes()).hexdigest()[:32]
    path = CACHE / f"{key}.npz"
    if path.exists():
        with np.load(path) as kept:
            return Passage(*(kept[name].astype(np.float64) for name in ("position", "velocity", "torque")))
    made = _played(robot, physical(acting), setpoints)
    CACHE.mkdir(parents=True, exist_ok=True)
    part = path.with_suffix(f".{os.getpid()}.npz")
    np.savez(part, position=made.position, velocity=made.velocity, torque=made.torque)
    part.replace(path)
    return made


def _played(robot: Robot, effects: tuple[Effect, ...], setpoints: Array) -> Passage:
    """Drives in position control follow the setpoints; what an onlooker with perfect instruments sees."""
    count = robot.joint_count
    arm = SimulatedArm(robot, Scenario(effects=effects), start_position=setpoints[0])
    arm.connect()
    boundless, zero = np.full(count, np.inf), np.zeros(count)
    limits = DriveLimits(-boundless, boundless, boundless, np.full(count, 1e4))
    arm.enable(ControlMode.POSITION, limits, StopPolicy.HOLD, 1.0)
    step_ns = round(1e9 / RATE_HZ)
    rows: list[tuple[Array, Array, Array]] = []
    for number, setpoint in enumerate(setpoints):
        arm.exchange(Setpoint(setpoint, zero))
        for part in range(1, FINE + 1):
            _, position, velocity, torque = arm.device._mechanism._sample
            rows.append((position, velocity, torque))
            arm.clock.wait_until_ns(number * step_ns + part * step_ns // FINE)
    position, velocity, torque = (np.array(column) for column in zip(*rows, strict=True))
    return Passage(position, velocity, torque)
