"""The functions of ``import tauscope``. Files are given as paths, or as what these functions return."""

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any, Literal, TypeAlias, Union

from tauscope.errors import AcquisitionError

if TYPE_CHECKING:
    from tauscope.recording import Recording
    from tauscope.results import (
        DiagnosisResult,
        ExcitationResult,
        IdentificationResult,
        RolloutResult,
        SimulationResult,
    )
    from tauscope.robot import Robot
    from tauscope.trajectory import Trajectory

RobotSource: TypeAlias = Union["Robot", str, Path]
RecordingSource: TypeAlias = Union["Recording", "SimulationResult", str, Path]
Recordings: TypeAlias = RecordingSource | Sequence[RecordingSource]


def _ignore(step: str) -> None:
    """Progress that nobody follows."""


def load_robot(path: str | Path) -> "Robot":
    """Read a robot file.

    Raises
    ------
    RobotFileError
        the file cannot be read or is not valid
    """
    from tauscope.robot import read_robot

    return read_robot(path)


def read_recording(
    path: str | Path,
    robot: RobotSource | None = None,
    *,
    units: Mapping[str, str] | None = None,
    rate_hz: float | None = None,
    trust_units: bool = False,
    columns: Mapping[str, Any] | str | Path | None = None,
    decimal: str | None = None,
    delimiter: str | None = None,
    topic: str | None = None,
) -> "Recording":
    """Read a recording: a table, MCAP or a bag; samples that are none are masked or repaired.

    Parameters
    ----------
    robot : Robot or path or None
        its joints are picked by name where the file has names; None takes the file's own
    units : mapping of str to str, or None
        units of columns that are not in SI, as in ``{"q": "deg", "t": "ms"}``; None takes those of the robot file
    rate_hz : float or None
        samples a second where t counts samples [Hz]
    columns : mapping, str, path or None
        where the columns are found, as in ``{"t": "time", "q": "position_{1}", "tau": "effort_{1}"}``; a preset, or a
        file with such a mapping; None takes those of the robot file
    decimal, delimiter : str or None
        of a CSV; None detects it
    topic : str or None
        of a log that has several with joint states

    Raises
    ------
    RecordingError
        the file cannot be read, does not fit the robot, or can hardly be in its units
    RobotFileError
        the columns cannot be used
    """
    from tauscope.recording import Reading, open_recording
    from tauscope.robot import RecordingLayout, layout_from_dict, read_layout

    layout = RecordingLayout()
    if columns is not None:
        layout = layout_from_dict(columns) if isinstance(columns, Mapping) else read_layout(str(columns))
    reading = Reading(
        {**layout.units, **(units or {})},
        layout.rate_hz if rate_hz is None else rate_hz,
        trust_units=trust_units,
        columns=layout.columns,
        decimal=decimal or layout.decimal,
        delimiter=delimiter or layout.delimiter,
        topic=topic or layout.topic,
    )
    return open_recording(path, None if robot is None else _robot(robot), reading)


def identify(
    robot: RobotSource,
    recordings: Recordings,
    held_out: Recordings = (),
    *,
    estimator: Literal["ls", "wls"] = "wls",
    cutoff_hz: float | Literal["auto"] | None = "auto",
    rotor_inertia: bool = True,
    prior: bool = True,
    progress: Callable[[str], None] = _ignore,
) -> "IdentificationResult":
    """Identify an arm's parameters from recordings.

    Parameters
    ----------
    cutoff_hz : float, "auto" or None
        band that torque and regressor share [Hz]; None filters nothing
    prior : bool
        whether the most probable bodies are delivered, or the free least-squares estimate

    Raises
    ------
    TauscopeError
        the data or the robot cannot answer
    """
    from tauscope import identification
    from tauscope.actuation import make_efforts
    from tauscope.results import IdentificationResult

    arm = _robot(robot)
    arm, train, judge = make_efforts(arm, _recordings(recordings, arm), _recordings(held_out, arm))
    options = identification.Options(identification.Estimator(estimator), cutoff_hz, rotor_inertia, prior)
    return IdentificationResult(identification.identify(arm, train, judge, options, progress), train, judge)


def diagnose(
    robot: RobotSource,
    recordings: Recordings,
    held_out: Recordings = (),
    *,
    against: Literal["identified", "model"] | Recordings = "identified",
    cutoff_hz: float | Literal["auto"] | None = "auto",
    headroom: bool = False,
    progress: Callable[[str], None] = _ignore,
) -> "DiagnosisResult":
    """Say which physics an arm's model leaves out.

    Parameters
    ----------
    against : "identified", "model", path or recordings
        the best model that the data allow, the robot file's model, a model that ``tauscope diagnose --model`` wrote
        (``.json``), or recordings made in a simulator
    cutoff_hz : float, "auto" or None
        band of the identification [Hz]; None filters nothing
    headroom : bool
        whether a black box says how much of held-out motion is still predictable

    Raises
    ------
    TauscopeError
        the data or the robot cannot answer
    """
    from tauscope import diagnosis
    from tauscope.actuation import make_efforts
    from tauscope.diagnosis.next_experiment import planned_experiment
    from tauscope.export.model_file import read_extended_model
    from tauscope.identification import Options
    from tauscope.results import DiagnosisResult

    arm, options = _robot(robot), Options(cutoff_hz=cutoff_hz)
    is_saved = isinstance(against, str | Path) and Path(against).suffix.lower() == ".json"
    saved = read_extended_model(Path(str(against)), arm) if is_saved else None
    simulated = () if is_saved or against in ("identified", "model") else _recordings(against, arm)
    arm, train, judge = make_efforts(arm, _recordings(recordings, arm), _recordings(held_out, arm))
    if headroom:
        from tauscope.headroom import measure_headroom, require_black_box

        require_black_box(len(judge))
    found = diagnosis.diagnose(arm, train, judge, options, progress)
    if saved is not None:
        found = diagnosis.compare_with_saved(found, saved)
    elif simulated:
        found = diagnosis.against_simulation(found, simulated, options)
    elif against == "model":
        found = diagnosis.against_model(found)
    return DiagnosisResult(found, planned_experiment(found, progress), measure_headroom(found) if headroom else None)


def design_excitation(
    robot: RobotSource,
    *,
    period_s: float = 10.0,
    harmonics: int = 5,
    periods: int = 5,
    slow_reversals: bool = True,
    closing_period: bool = True,
    torque_margin: float = 0.2,
    limit_fraction: float = 0.95,
    seed: int = 0,
) -> "ExcitationResult":
    """Design the motion within an arm's limits that tells most about it.

    Parameters
    ----------
    period_s : float
        length of one period of the Fourier series [s]
    torque_margin : float
        share of each torque limit that is kept free, 0 to 1
    limit_fraction : float
        share of all other limits that is used, 0 to 1

    Raises
    ------
    ExcitationError
        no motion keeps the limits
    """
    from tauscope import excitation
    from tauscope.results import ExcitationResult

    options = excitation.ExcitationOptions(
        period_s=period_s,
        harmonics=harmonics,
        periods=periods,
        slow_postures=excitation.ExcitationOptions.slow_postures if slow_reversals else 0,
        closing_period=closing_period,
        torque_margin=torque_margin,
        limit_fraction=limit_fraction,
        seed=seed,
    )
    return ExcitationResult(excitation.design_excitation(_robot(robot), options))


def simulate(
    robot: RobotSource,
    motion: "ExcitationResult | Trajectory | str | Path",
    *,
    scenario: Mapping[str, Any] | str | Path | None = None,
    rate_hz: float = 200.0,
    name: str = "simulation",
) -> "SimulationResult":
    """Play a motion on the simulated arm, in virtual time, and record it.

    Parameters
    ----------
    scenario : mapping, path or None
        what the simulated arm conceals, as in a scenario file: noise and effects
    rate_hz : float
        samples a second [Hz]
    name : str
        name of the recording

    Raises
    ------
    AcquisitionError
        the run did not reach its end
    MissingExtraError
        the sim extra is not installed
    """
    from tauscope.recording import read_recording as read
    from tauscope.results import ExcitationResult, SimulationResult
    from tauscope.runtime.drivers import make_backend
    from tauscope.runtime.options import RunOptions
    from tauscope.runtime.run import run_trajectory
    from tauscope.runtime.states import RunState
    from tauscope.trajectory import Trajectory, read_trajectory

    arm = _robot(robot)
    if isinstance(motion, ExcitationResult):
        motion = motion.design.trajectory
    trajectory = motion if isinstance(motion, Trajectory) else read_trajectory(Path(motion), arm)
    with TemporaryDirectory(prefix="tauscope-") as folder:
        settings: dict[str, Any] = {"time": "virtual"}
        if isinstance(scenario, Mapping):
            settings["scenario"] = str(Path(folder, "scenario.yaml"))
            Path(folder, "scenario.yaml").write_text(json.dumps(dict(scenario)), encoding="utf-8")  # JSON is YAML
        elif scenario is not None:
            settings["scenario"] = str(scenario)
        connection = make_backend("sim", arm, settings)
        options = RunOptions(rate_hz=rate_hz)
        record = run_trajectory(arm, trajectory, lambda: connection, Path(folder, "run"), options)
        if record.state is not RunState.FINISHED:
            reason = record.stop if record.problem is None else record.problem.detail
            raise AcquisitionError(f"the simulated run {record.state}: {reason or 'no reason is known'}")
        recording = read(Path(folder, "run", "recording.csv"), joint_names=[joint.name for joint in arm.joints])
        return SimulationResult(replace(recording, name=name, is_examined=True))


def rollout(
    robot: RobotSource,
    recordings: Recordings,
    *,
    model: str | Path | None = None,
    refine: Recordings = (),
    progress: Callable[[str], None] = _ignore,
) -> "RolloutResult":
    """Close the loop in MuJoCo on a recording's commands, and compare real and simulated motion.

    Parameters
    ----------
    model : path or None
        what ``tauscope identify`` or ``diagnose`` wrote with ``--model``: rolled out without and with its findings
    refine : recordings
        with commands, by which the model without findings is refined; the other recordings judge it

    Raises
    ------
    TauscopeError
        the data, the robot or the model cannot answer
    MissingExtraError
        the sim extra is not installed
    """
    from tauscope.closed_loop import roll_out
    from tauscope.export.model_file import read_export_models
    from tauscope.results import RolloutResult

    arm = _robot(robot)
    exports = () if model is None else read_export_models(Path(model))
    return RolloutResult(roll_out(arm, _recordings(recordings, arm), exports, progress, _recordings(refine, arm)))


def _robot(source: RobotSource) -> "Robot":
    """A robot, read where a path is given."""
    return load_robot(source) if isinstance(source, str | Path) else source


def _recordings(sources: Any, robot: "Robot") -> "tuple[Recording, ...]":
    """One recording or several, read where a path is given."""
    from tauscope.recording import examine_recording
    from tauscope.results import SimulationResult

    several = sources if isinstance(sources, list | tuple) else (sources,)
    taken = [source.recording if isinstance(source, SimulationResult) else source for source in several]
    return tuple(
        read_recording(each, robot) if isinstance(each, str | Path) else examine_recording(each, robot)
        for each in taken
    )
