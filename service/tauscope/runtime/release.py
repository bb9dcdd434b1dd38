"""Letting go of an arm: at once, on an operator's word, or once it stands still."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from tauscope.errors import AcquisitionError
from tauscope.robot import Robot
from tauscope.runtime.drivers import make_backend, translate_driver_errors
from tauscope_drivers import ArmState, Backend, StopPolicy

SETTLED_S = 0.5  # time for which every joint has to stand still [s]
STILL = 1e-3  # most that a joint may move in that time: some counts of an encoder [rad or m]
LONGEST_S = 5.0  # time after which an arm that does not come to rest stays held [s]
_LOOK_S = 0.05


def release_settled(backend: Backend, state: ArmState) -> ArmState:
    """Hold an arm that was just stopped until it stands still, then let go; one that moves stays held."""
    clock = backend.clock
    begin_ns = since_ns = clock.now_ns()
    place = state.position
    while clock.now_ns() - begin_ns < LONGEST_S * 1e9:
        if state.faults or not np.isfinite(state.position).all():
            return state
        if (np.abs(state.position - place) > STILL).any():
            place, since_ns = state.position, clock.now_ns()
        if clock.now_ns() - since_ns >= SETTLED_S * 1e9:
            return backend.stop(StopPolicy.TORQUE_OFF)
        clock.wait_until_ns(clock.now_ns() + round(_LOOK_S * 1e9))
        state = backend.stop(StopPolicy.HOLD)
    return state


def release(backend_name: str, robot: Robot, settings: Mapping[str, Any]) -> None:
    """Take the torque off an arm. Raises AcquisitionError where a drive is not reached, or is under power still."""
    backend = make_backend(backend_name, robot, settings).backend
    with translate_driver_errors():
        backend.connect()
        try:
            state = backend.stop(StopPolicy.TORQUE_OFF)
        finally:
            backend.disconnect()
    held = [joint.name for joint, is_held in zip(robot.joints, state.enabled, strict=True) if is_held]
    if held:
        raise AcquisitionError(f"{', '.join(held)}: still under power; switch the arm's power off, look at its drives")
    silent = [fault for fault in state.faults if fault.code == "silent"]
    if silent:
        raise AcquisitionError(f"{silent[0]}")
