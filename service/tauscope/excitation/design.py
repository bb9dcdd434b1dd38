"""Designing an excitation: from a robot and a few wishes to a trajectory that a run can play, and its document."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from tauscope.excitation.information import Criterion
from tauscope.excitation.margins import Margins, trajectory_margins
from tauscope.excitation.optimiser import OptimiserProgress, optimise
from tauscope.excitation.setting import ExcitationOptions, Setting
from tauscope.excitation.slow_reversals import SlowPart, slow_part
from tauscope.robot import Robot
from tauscope.strict_model import take_fields
from tauscope.trajectory.document import ExcitationDocument, HistoryPart, trajectory_document
from tauscope.trajectory.fourier_series import FourierSeries
from tauscope.trajectory.segments import FourierSegment
from tauscope.trajectory.trajectory import DesignRecord, Trajectory

# Part of a limit: a limit that leaves no more than this above what is spared by wish is one that limits the design.
ACTIVE = 0.01
ACTIVE_CLEARANCE_M = 0.005  # clearance from floor or boxes at which they limit the design [m]


@dataclass(frozen=True, eq=False)
class ExcitationDesign:
    """A designed excitation."""

    trajectory: Trajectory
    series: FourierSeries
    periods: int
    criterion: Criterion
    value: float
    condition_number: float
    random_value: float
    history: tuple[HistoryPart, ...]  # every iteration, with the criterion as the optimiser sees it
    margins: Margins
    active: tuple[str, ...]
    notes: tuple[str, ...]
    evaluations: int
    seconds: float  # time that the optimiser took [s]


def design_excitation(
    robot: Robot,
    options: ExcitationOptions | None = None,
    *,
    progress: Callable[[OptimiserProgress], None] = lambda _: None,
) -> ExcitationDesign:
    """The best excitation within the limits, (20) and (21). Raises ExcitationError, which names what blocks."""
    options = options or ExcitationOptions()
    setting = Setting.of(robot, options)
    rng = np.random.default_rng(options.seed)
    result = optimise(setting.stages(rng), setting.feasibility, rng, starts=options.starts, progress=progress)
    series = setting.space.series(result.x)
    slow = slow_part(robot, series, setting.planned, setting.states, options.slow_postures)
    value, condition_number = setting.value(series)
    record = DesignRecord(
        criterion=options.criterion.value, value=value, condition_number=condition_number, margins={}, seed=options.seed
    )
    closing = [FourierSegment(series, 1, first_period=options.periods)] if options.closing_period else []
    segments = (FourierSegment(series, options.periods, first_period=0), *slow.segments, *closing)
    names = tuple(joint.name for joint in robot.joints)
    trajectory = Trajectory(robot.name, names, segments, setting.stated, record)
    margins = trajectory_margins(trajectory, setting.stated, setting.states)
    return ExcitationDesign(
        trajectory=replace(trajectory, design=record.model_copy(update={"margins": margins.as_table()})),
        series=series,
        periods=options.periods,
        criterion=options.criterion,
        value=value,
        condition_number=condition_number,
        random_value=result.random_value,
        history=tuple(result.history),
        margins=margins,
        active=_active(robot, margins, options),
        notes=_notes(robot, setting, slow),
        evaluations=result.evaluations,
        seconds=result.seconds,
    )


def _active(robot: Robot, margins: Margins, options: ExcitationOptions) -> tuple[str, ...]:
    spared = 1.0 - options.limit_fraction
    found = []
    for kind, left in margins.as_table().items():
        kept, pairs = 0.0 if kind in margins.drive else spared, zip(robot.joints, left, strict=True)
        found += [f"{kind} of {joint.name}" for joint, part in pairs if part is not None and part <= kept + ACTIVE]
    if margins.workspace_m is not None and margins.workspace_m <= ACTIVE_CLEARANCE_M:
        found.append("workspace")
    return tuple(found)


def _notes(robot: Robot, setting: Setting, slow: SlowPart) -> tuple[str, ...]:
    notes = list(setting.stated.assumed)
    if robot.model.links is None:
        notes.append("torque is not constrained: the robot file has no model to predict it with")
    else:
        missing = [joint.name for joint in robot.joints if joint.limits.torque is None]
        if missing:
            notes.append(f"torque is not constrained on {', '.join(missing)}: no limit is stated")
    pairs = zip(robot.joints, robot.actuators, strict=True)
    unknown = [joint.name for joint, loop in pairs if loop and loop.unit == "register" and not loop.stall_torque]
    if unknown:
        notes.append(f"{', '.join(unknown)}: servos limit nothing; state actuator.supply_voltage and torque_per_volt")
    wanted = setting.options.slow_postures
    if slow.postures < wanted:
        notes.append(f"slow reversals at {slow.postures} of {wanted} postures: no more have room within the limits")
    return tuple(notes)


def excitation_document(design: ExcitationDesign) -> ExcitationDocument:
    """The document of a designed excitation."""
    trajectory = trajectory_document(design.trajectory)
    return take_fields(
        ExcitationDocument,
        design,
        robot=trajectory.robot,
        joints=trajectory.joints,
        criterion=design.criterion.value,
        period_s=design.series.period_s,
        harmonics=design.series.harmonics,
        duration_s=design.trajectory.duration_s,
        margins=design.margins.as_table(),
        clearance_m=design.margins.workspace_m,
        trajectory=trajectory,
    )
