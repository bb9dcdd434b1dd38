"""Real recordings against closed-loop simulation with the same commands."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from tauscope.actuation import estimate_delays, is_open, require_loops
from tauscope.closed_loop import drive as drives
from tauscope.closed_loop.model import RolloutModel, rollout_model, stated_model
from tauscope.closed_loop.plant import STEP_S, make_plant
from tauscope.closed_loop.refine import Refined, refine_model
from tauscope.closed_loop.result import (
    HorizonEntry,
    ModelEntry,
    RecordingEntry,
    RefinedEntry,
    RefinementEntry,
    RolloutDocument,
    SummaryEntry,
)
from tauscope.errors import RecordingMismatchError
from tauscope.export.model import ExportModel
from tauscope.recording import Recording
from tauscope.recording.recording import Array, take_commands
from tauscope.result_warning import ResultWarning
from tauscope.robot import Actuator, Robot
from tauscope.strict_model import take_fields

HORIZONS_S = (0.1, 1.0, 10.0)  # times between restarts at the real state [s]: one command, one move, one task
STABILISED = ResultWarning(
    code="stabiliser",
    text="no loop is stated, or commands are missing: recorded torque drives the arm, and a stabiliser holds it",
    remedy="state joints[].actuator and record qref; compare torque of the stabiliser with that of the joint",
)
Progress = Callable[[str], None]


@dataclass(frozen=True, eq=False)
class Trace:
    """One recording and its simulations."""

    motion: drives.RecordedMotion
    simulated: dict[str, Array]  # dict of str to (N, n), positions by model, from one start [rad or m]
    entry: RecordingEntry


@dataclass(frozen=True, eq=False)
class Rollout:
    """All recordings rolled out with all models."""

    robot: Robot
    is_closed: bool
    models: tuple[RolloutModel, ...]
    traces: tuple[Trace, ...]
    warnings: tuple[ResultWarning, ...]
    refined: Refined | None = None

    @property
    def document(self) -> RolloutDocument:
        """The result, typed."""
        loops = self.robot.actuators if self.is_closed else (None,) * self.robot.joint_count
        return RolloutDocument(
            robot=self.robot.name,
            joints=[joint.name for joint in self.robot.joints],
            drive="loop" if self.is_closed else "torque",
            delay=[None if loop is None else loop.delay for loop in loops],
            step_s=STEP_S,
            recordings=[trace.entry for trace in self.traces],
            summary=[self._summary(place) for place in range(len(self.models))],
            left_out=list(dict.fromkeys(text for model in self.models for text in model.left_out)),
            refinement=None if self.refined is None else self._refinement(self.refined),
            warnings=list(self.warnings),
        )

    def _refinement(self, refined: Refined) -> RefinementEntry:
        """Parameters of the refined model, and whether its mean error over joints is below that of each other model."""
        *others, own = (np.mean(self._summary(place).rms) for place in range(len(self.models)))
        return RefinementEntry(
            segments=refined.count,
            rms_before=refined.before,
            rms_after=refined.after,
            is_better=bool(own < min(others)),
            parameters=[
                take_fields(RefinedEntry, each, name=each.term.name, unit=each.term.unit) for each in refined.terms
            ],
            left_out=list(refined.left_out),
        )

    def _summary(self, place: int) -> SummaryEntry:
        entries = [trace.entry.models[place] for trace in self.traces]
        rms, worst = np.array([entry.rms for entry in entries]), np.array([entry.worst for entry in entries])
        return SummaryEntry(model=entries[0].model, rms=rms.mean(axis=0).tolist(), worst=worst.max(axis=0).tolist())


def roll_out(
    robot: Robot,
    recordings: Sequence[Recording],
    exports: Sequence[ExportModel] = (),
    progress: Progress = lambda step: None,
    training: Sequence[Recording] = (),
) -> Rollout:
    """Simulate what a recording commanded, without and with a model's findings. `exports`: as `read_export_models`.

    Raises RecordingMismatchError for another arm's model or none, TauscopeError without commands, torque or simulator.
    `training`: with commands, by which the model without findings is refined; the other recordings judge it.
    """
    models = _models(robot, exports)
    known = exports[-1].robot if exports else None
    robot, is_closed = _complete_loops(robot, recordings, known)
    loops = tuple(joint.actuator for joint in robot.joints if joint.actuator is not None) if is_closed else ()
    refined = None
    if training:
        refined = _refine(_plain_model(robot, exports), loops, training, progress)
        models.append(rollout_model("refined", refined.model, refined.friction))
    # MuJoCo integrates an actuator's damping implicitly; a servo computes it of the velocity that it has measured.
    damping = drives.loop_damping(loops) if loops and robot.mjcf is not None else np.zeros(robot.joint_count)
    plants = [make_plant(model.mjcf, model.joints, damping) for model in models]
    traces = []
    for recording in recordings:
        progress(f"simulate {recording.name}")
        motion = drives.record_motion(recording)
        entries, simulated = [], {}
        for model, plant in zip(models, plants, strict=True):
            runs: dict[float | None, Array] = {}
            stabiliser = None
            for horizon in (*(h for h in HORIZONS_S if h < motion.time[-1] - motion.time[0]), None):
                own = loops if refined is None or model.name != "refined" else refined.loops
                drive = (
                    drives.LoopDrive(own, recording, motion.time, is_damped=robot.mjcf is None)
                    if own
                    else drives.TorqueDrive(robot, recording, motion, model.inertia)
                )
                runs[horizon] = drives.simulate_motion(model, plant, drive, motion, horizon)
                stabiliser = drive.stabiliser_rms.tolist() if isinstance(drive, drives.TorqueDrive) else None
            simulated[model.name] = runs[None]
            entries.append(_entry(model.name, motion, runs, stabiliser))
        length = float(motion.rows[-1] - motion.rows[0])
        traces.append(
            Trace(motion, simulated, RecordingEntry(recording=recording.name, duration_s=length, models=entries))
        )
    warnings = (*(() if is_closed else (STABILISED,)), *(w for recording in recordings for w in recording.warnings))
    return Rollout(robot, is_closed, tuple(models), tuple(traces), warnings, refined)


def _models(robot: Robot, exports: Sequence[ExportModel]) -> list[RolloutModel]:
    names = [joint.name for joint in robot.joints]
    for export in exports:
        others = [joint.name for joint in export.robot.joints]
        if others != names:
            raise RecordingMismatchError(
                f"the model is of joints {', '.join(others)}, robot {robot.name} has {', '.join(names)};"
                " give the model of this arm"
            )
    stated = stated_model(robot)
    models = [] if stated is None else [rollout_model("stated", stated)]
    if exports:
        found, plain = exports[-1], _plain_model(robot, exports)
        models += [] if plain is None else [rollout_model("identified", plain)]
        if any(each.effect.id != "rotor_inertia" for each in found.effects):
            models.append(rollout_model("findings", found))
    if not models:
        raise RecordingMismatchError(
            f"robot {robot.name} states no links and no model is given; write one by"
            " `tauscope identify ... --model MODEL.json`, and give it with --model"
        )
    return models


def _complete_loops(robot: Robot, recordings: Sequence[Recording], known: Robot | None) -> tuple[Robot, bool]:
    """The robot with delays of its loops, and whether loops can close: commands of all joints are there."""
    loops = robot.actuators
    commands = [take_commands(recording) for recording in recordings]
    if not all(loop is not None and loop.has_loop for loop in loops) or any(each is None for each in commands):
        return robot, False
    others = loops if known is None else known.actuators
    robot = robot.with_actuators(
        loop if loop is None or other is None else _fill(loop, other) for loop, other in zip(loops, others, strict=True)
    )
    for recording in recordings:
        require_loops(robot, recording)
    for number, joint in enumerate(robot.joints, 1):
        if is_open(joint):
            place = f"joints[{number - 1}].actuator.torque_per_volt"
            raise RecordingMismatchError(
                f"robot {robot.name}: {joint.name}: its loop has no torque per volt; state {place}, or give a model"
                " that identify made from commands"
            )
    delays = estimate_delays(robot, [each for each in commands if each is not None])
    pairs = zip(robot.actuators, delays, strict=True)
    return robot.with_actuators(loop and replace(loop, delay=delay.value) for loop, delay in pairs), True


def _fill(loop: Actuator, known: Actuator) -> Actuator:
    return replace(
        loop,
        delay=known.delay if loop.delay is None else loop.delay,
        torque_per_volt=known.torque_per_volt if loop.volt_torque is None else loop.torque_per_volt,
    )


def _plain_model(robot: Robot, exports: Sequence[ExportModel]) -> ExportModel | None:
    if not exports:
        return stated_model(robot)
    return exports[0] if len(exports) > 1 else replace(exports[-1], effects=())


def _refine(
    model: ExportModel | None, loops: tuple[Actuator, ...], training: Sequence[Recording], progress: Progress
) -> Refined:
    """The refined model. Raises RecordingMismatchError where no commands reach loops."""
    commands = [take_commands(recording) for recording in training]
    lacking = [recording.name for recording, each in zip(training, commands, strict=True) if each is None]
    if not loops or model is None or lacking:
        raise RecordingMismatchError(
            f"{', '.join(lacking) or training[0].name}: a refinement needs commands through loops; record qref, state"
            " joints[].actuator in the robot file, or roll out without --refine"
        )
    return refine_model(model, loops, [each for each in commands if each is not None], progress)


def _entry(
    name: str, motion: drives.RecordedMotion, runs: dict[float | None, Array], stabiliser: list[float] | None
) -> ModelEntry:
    real, free = motion.measured, runs[None]
    turned = _reversal_error(motion.rows, real, free, motion.time, motion.velocity)

    def rms(run: Array) -> list[float]:
        return np.sqrt(np.nanmean((run - real) ** 2, axis=0)).tolist()

    return ModelEntry(
        model=name,  # pyright: ignore[reportArgumentType]
        rms=rms(free),
        worst=np.nanmax(np.abs(free - real), axis=0).tolist(),
        reversals=[None if np.isnan(value) else float(value) for value in turned],
        lag=_lag(motion.rows, real, free).tolist(),
        horizons=[HorizonEntry(horizon_s=at, rms=rms(run)) for at, run in runs.items()],
        stabiliser_rms=stabiliser,
    )


LONGEST_LAG_S = 0.25  # largest delay between both motions that is looked for [s]
REVERSAL_S = 0.1  # time on either side of a reversal that belongs to it [s]
MOVES = 0.05  # share of its top speed above which a joint moves: below it, it may rest and turn for noise


def _lag(time: Array, measured: Array, simulated: Array) -> Array:
    """Delay of the real motion behind the simulated one, (n,) [s]: that at which both differ least."""
    step = float(np.median(np.diff(time)))
    reach = int(LONGEST_LAG_S / step)
    found = np.zeros(measured.shape[1])
    shifts = np.arange(-reach, reach + 1)
    at = np.arange(reach, len(time) - reach)
    if not len(at):
        return found
    for joint in range(measured.shape[1]):
        real, other = measured[:, joint], simulated[:, joint]
        errors = np.array([np.nanmean((real[at] - other[at - shift]) ** 2) for shift in shifts])
        best, between = int(np.argmin(errors)), 0.0
        if 0 < best < len(shifts) - 1:
            before, least, after = errors[best - 1 : best + 2]
            bend = before - 2.0 * least + after
            between = 0.5 * (before - after) / bend if bend > 0.0 else 0.0
        found[joint] = step * (shifts[best] + between)
    return found


def _reversal_error(rows: Array, measured: Array, simulated: Array, time: Array, velocity: Array) -> Array:
    """Rms position error within `REVERSAL_S` of a reversal of the real joint, (n,) [rad or m]; NaN without one."""
    found = np.full(measured.shape[1], np.nan)
    for joint, speed in enumerate(velocity.T):
        moving = np.flatnonzero(np.abs(speed) > MOVES * np.abs(speed).max())
        turns = np.flatnonzero(np.diff(np.sign(speed[moving])) != 0)
        if not len(turns):
            continue
        instants = 0.5 * (time[moving[turns]] + time[moving[turns + 1]])
        place = np.clip(np.searchsorted(instants, rows), 1, len(instants) - 1) if len(instants) > 1 else None
        near = np.abs(rows - instants[0])
        if place is not None:
            near = np.minimum(np.abs(rows - instants[place]), np.abs(rows - instants[place - 1]))
        error = (simulated - measured)[near <= REVERSAL_S, joint]
        if np.isfinite(error).any():
            found[joint] = float(np.sqrt(np.nanmean(error**2)))
    return found
