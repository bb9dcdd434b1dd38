"""The task of a run: what it needs from its caller, and the preparation before the arm is under power."""

import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

import numpy as np

from tauscope.errors import AcquisitionError
from tauscope.recording.journal_rows import JournalHeader
from tauscope.robot import Robot
from tauscope.runtime.drivers import Connection
from tauscope.runtime.options import RunOptions, choose_stop_policy
from tauscope.runtime.plan import Plan, make_plan
from tauscope.runtime.progress import Report
from tauscope.runtime.record import RunRecord
from tauscope.runtime.recorder import Recorder
from tauscope.runtime.states import Stops
from tauscope.trajectory import Trajectory
from tauscope_drivers import ArmState, Backend

OpenRecorder = Callable[[Path, JournalHeader, Stops, bool], Recorder]
"""Opens a journal: its path, its header, requests to stop, and whether the arm runs in real time."""


class Keeper(Protocol):
    """Takes a run's record whenever it changes."""

    def keep(self, record: RunRecord) -> None:
        """Keep the newest record; must not take time."""
        ...


@dataclass(frozen=True, eq=False)
class RunTask:
    """What is to be run."""

    robot: Robot
    trajectory: Trajectory
    options: RunOptions
    connect: Callable[[], Connection]


@dataclass(frozen=True)
class Surroundings:
    """What a run talks to while it runs."""

    folder: Path
    stops: Stops
    keeper: Keeper
    open_recorder: OpenRecorder
    report: Report


LEAST_CYCLES_A_WATCHDOG = 2
"""A watchdog has to outlast this many cycles, or every late one stops the arm."""


def prepare(task: RunTask, backend: Backend, state: ArmState) -> Plan:
    """Plan a run for the arm as it was found, or refuse it: no torque is on yet.

    Raises AcquisitionError where the backend cannot do what was asked for, a drive reports a fault, or the motion does
    not fit.
    """
    options, capabilities = task.options, backend.capabilities
    choose_stop_policy(options, task.robot.joints, capabilities)
    if options.mode not in capabilities.modes:
        can = ", ".join(sorted(capabilities.modes))
        raise AcquisitionError(f"mode {options.mode}: this arm's drives cannot do that; choose {can}")
    shortest, longest = capabilities.watchdog_range_s
    if not shortest <= options.watchdog_s <= longest:
        raise AcquisitionError(
            f"a watchdog of {options.watchdog_s:g} s: this arm's drives take {shortest:g} to {longest:g} s"
        )
    plan = make_plan(task.robot, task.trajectory, _sound(backend, state, options).position, options, capabilities)
    least = LEAST_CYCLES_A_WATCHDOG * plan.period_ns * 1e-9
    if options.watchdog_s < least:
        raise AcquisitionError(
            f"a watchdog of {options.watchdog_s:g} s is too short for {plan.rate_hz:g} cycles a second; "
            f"take {least:.3g} s or more"
        )
    return plan


def journal_header(robot: Robot, plan: Plan, backend: Backend, state: ArmState, mode: str) -> JournalHeader:
    """What all rows of a run's journal have in common."""
    unit = backend.capabilities.effort_unit
    return JournalHeader(
        robot=robot.name,
        joint_names=tuple(joint.name for joint in robot.joints),
        rate_hz=plan.rate_hz,
        mode=mode,
        effort_unit=unit,
        torque_per_effort=tuple(1.0 if unit == "Nm" else joint.torque_constant for joint in robot.joints),
        has_velocity=bool(np.isfinite(state.velocity).any()),
        epoch_offset_ns=time.time_ns() - backend.clock.now_ns(),
    )


def _sound(backend: Backend, state: ArmState, options: RunOptions) -> ArmState:
    """The state without faults, where the operator has said that they may be cleared."""
    if state.faults and options.acknowledge_faults:
        state = backend.acknowledge_faults()
    if state.faults:
        raise AcquisitionError(f"{state.faults[0]}; then acknowledge the fault")
    return state
