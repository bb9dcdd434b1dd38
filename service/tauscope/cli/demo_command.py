"""``tauscope demo``: a whole campaign on the seed paper's arm, simulated, and what it found beside the truth.

Nothing but the simulated arm knows its model: the motions are designed, and the arm is identified, from a robot file
without one.
"""

import io
import shutil
import sys
import time
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Annotated, Any

import numpy as np
from rich.console import Console
from ruamel.yaml import YAML
from typer import Option

from tauscope.cli.demo_page import DATA, LEFT_FOR_S, PORT, PageShown, leave_page, prepare_folder, show_page
from tauscope.cli.identify_command import show_identification
from tauscope.cli.run_command import explain_unfinished, keep_recording
from tauscope.cli.task_run import write_file, write_outputs
from tauscope.cli.terminal import Told, output, say, show_progress, table
from tauscope.diagnosis import DiagnosisDocument
from tauscope.errors import AcquisitionError, TauscopeError
from tauscope.excitation import ExcitationOptions, OptimiserProgress, design_excitation
from tauscope.export.formats import EXPORT_FILES
from tauscope.identification import Identification
from tauscope.number_text import given, with_uncertainty
from tauscope.report.tables import Table
from tauscope.robot import Robot, read_robot
from tauscope.runtime.options import RunOptions
from tauscope.runtime.states import RunState
from tauscope.server.control.campaign import CampaignOrder, CampaignWorkspace
from tauscope.server.http.campaigns import CAMPAIGNS, get_result
from tauscope.server.http.services import Services, open_services
from tauscope.server.http.settings import Settings
from tauscope.server.queue.job_folder import JobState
from tauscope.server.queue.task_job import stage_workspace
from tauscope.server.queue.worker_pool import WorkerPool
from tauscope.tasks import identify, run
from tauscope.tasks.campaign import HeldOutMotion
from tauscope.tasks.design_excitation import ExcitationDesignOptions
from tauscope.tasks.diagnose import DiagnosisOptions
from tauscope.tasks.run import BackendChoice
from tauscope.tasks.task import Files
from tauscope.trajectory import write_trajectory
from tauscope_sim.examples import example_robot

NOISE_STD_NM = (0.5, 0.3, 0.7)  # σ_τ of the seed paper's section 5
RATE_HZ = 200.0
TRAIN_MOTION = ExcitationOptions(periods=5, slow_postures=1, seed=0)
HELD_OUT_MOTION = ExcitationOptions(periods=2, slow_postures=0, closing_period=False, seed=1)
ROBOT, TRAIN, HELD_OUT = "robot.yaml", "train.csv", "held-out.csv"
SCENARIO, TRAIN_TRAJECTORY, HELD_OUT_TRAJECTORY = "scenario.yaml", "train.json", "held-out.json"
RESULT, REPORT = "identification.json", "report.html"
EXPORTS = ("friction.json", "friction.yaml", "friction.h", "friction.py", "model.xml")
# What the demo writes, and may therefore write again.
FILES = (ROBOT, SCENARIO, TRAIN_TRAJECTORY, HELD_OUT_TRAJECTORY, TRAIN, HELD_OUT, RESULT, REPORT, *EXPORTS)
# What the arm of that campaign conceals: a scenario, by which the diagnosis is put to the test.
CONCEALED = {"torque_noise_std": list(NOISE_STD_NM), "seed": 1} | {
    "effects": [{"effect": "joint_spring", "joint": 1, "stiffness": 0.6}]
}
# What the simulated arm conceals, but for the seed of its noise.
SCENARIO_TEXT = f"torque_noise_std: {list(NOISE_STD_NM)}\n"
_HEADING = """\
The seed paper's arm, Table 1, as `tauscope demo` hands it to the design and to the identification: what its links weigh
and how its joints rub is left out. Of the friction curve only the shape constants are given."""


@dataclass(frozen=True)
class Comparison:
    name: str
    truth: float
    value: float
    std: float

    @property
    def z(self) -> float:
        return (self.value - self.truth) / self.std


def demo(
    out: Annotated[Path, Option(metavar="DIR", file_okay=False, help="Folder of results.")] = Path("demo-output"),
    page: Annotated[
        bool | None,
        Option(
            "--page/--no-page",
            show_default=False,
            help="Show the page with what was found, until Ctrl-C. By default so in a terminal; elsewhere a process of"
            " its own is left that shows it for a while.",
        ),
    ] = None,
) -> None:
    """Run a whole campaign on a simulated arm.

    Designs a motion for the seed paper's arm and a second one that the model is judged by, runs both, identifies the
    arm from the noisy recordings, and compares the estimate with the truth. Then a campaign through the service on the
    same arm with a concealed spring, which the page shows. Takes a minute or two.
    """
    by_default = PageShown.HERE if sys.stdout.isatty() else PageShown.LEFT
    run_demo(out, {None: by_default, True: PageShown.HERE, False: PageShown.NOT}[page])


def run_demo(folder: Path, page: PageShown) -> None:
    """Raises TauscopeError where the folder holds other files, cannot be written, or the page cannot be served."""
    prepare_folder(folder, (*FILES, DATA))
    arm = read_robot(example_robot("paper_arm"))
    write_file(folder / ROBOT, robot_text_without_model(example_robot("paper_arm")).encode())
    write_file(folder / SCENARIO, SCENARIO_TEXT.encode())
    with show_progress() as told, TemporaryDirectory(prefix=".runs-", dir=folder) as runs:
        design_motion(folder / ROBOT, folder / TRAIN_TRAJECTORY, TRAIN_MOTION, told)
        design_motion(folder / ROBOT, folder / HELD_OUT_TRAJECTORY, HELD_OUT_MOTION, told)
        for seed, (trajectory, out) in enumerate(((TRAIN_TRAJECTORY, TRAIN), (HELD_OUT_TRAJECTORY, HELD_OUT))):
            run_motion(Path(runs).resolve() / Path(out).stem, folder / trajectory, folder / out, seed, told)
    request = identify.Request(
        robot=str(folder / ROBOT), recordings=(str(folder / TRAIN),), held_out=(str(folder / HELD_OUT),)
    )
    exports = {folder / file.name: file.output for file in EXPORT_FILES.values() if file.name in EXPORTS}
    outputs = {folder / RESULT: "result.json", folder / REPORT: "report.html", **exports}
    with show_progress() as progress:
        outcome, _ = write_outputs(identify, request, outputs, progress)
    _show(output(), folder, outcome, compare(arm, outcome.identification))
    with show_progress() as told:
        found = run_campaign(folder / DATA, example_robot("paper_arm"), CONCEALED, told)
    _show_findings(output(), found)
    if page is PageShown.HERE:
        return show_page(folder)
    hint = f"tauscope serve --data {folder / DATA} (or make page)"
    said = f"Look at it: {hint}, then open http://127.0.0.1:{PORT}"
    if page is PageShown.LEFT:
        said = f"Look at it: {leave_page(folder).address}, for {LEFT_FOR_S / 60.0:.0f} minutes; after that: {hint}"
    say(said)


def design_motion(robot: Path, out: Path, options: ExcitationOptions, told: Told) -> None:
    def tell(progress: OptimiserProgress) -> None:
        told(f"design {out.stem} motion", 100.0 * progress.fraction)

    write_trajectory(design_excitation(read_robot(robot), options, progress=tell).trajectory, out)


def run_motion(folder: Path, trajectory: Path, out: Path, seed: int, told: Told) -> None:
    """Play a motion on the simulated arm, and keep its recording. Raises AcquisitionError if it does not finish."""
    scenario = folder.with_suffix(".yaml")
    scenario.write_text(f"{SCENARIO_TEXT}seed: {seed}\n", encoding="utf-8")
    request = run.Request(
        robot=str(example_robot("paper_arm")),
        scenario=str(scenario),
        trajectory=str(trajectory),
        # What the arm weighs is the simulation's secret: nobody may feed it forward.
        options=RunOptions(rate_hz=RATE_HZ, feed_forward=False),
    )
    result = run.perform(request, Files({"run": folder}), told)
    if result.record.state is not RunState.FINISHED:
        raise AcquisitionError(explain_unfinished(result.record, None))
    keep_recording(result, out)


def robot_text_without_model(path: Path) -> str:
    """Text of a robot file without what it believes about links and friction; a heading says so."""
    yaml = YAML()
    yaml.width = 4096
    content = yaml.load(path.read_text(encoding="utf-8"))
    content.pop("model", None)
    content.yaml_set_start_comment(_HEADING)
    stream = io.StringIO()
    yaml.dump(content, stream)
    return stream.getvalue()


def compare(arm: Robot, identification: Identification) -> list[Comparison]:
    """The estimate beside the truth: base parameters, then every joint's friction."""
    structure, std = identification.structure, np.sqrt(np.diag(identification.covariance))
    standard = np.concatenate([link.to_vector() for link in arm.model.links or ()])
    truth = dict(zip(structure.base.expressions, structure.base.project(standard), strict=True))
    for joint, friction in zip(arm.joints, arm.model.friction or (), strict=True):
        truth |= {f"{name} {joint.name}": getattr(friction, name) for name in ("stiction", "stribeck", "viscous")}
        truth[f"offset {joint.name}"] = 0.0
    rows = zip(structure.names, identification.parameters, std, strict=False)
    return [Comparison(name, float(truth[name]), float(value), float(error)) for name, value, error in rows]


def _show(console: Console, folder: Path, outcome: identify.Result, comparisons: list[Comparison]) -> None:
    show_identification(console, outcome.document, outcome.robot)
    rows = [
        (row.name, given(round(row.truth, 6)), *with_uncertainty(row.value, row.std), f"{row.z:+.2f}")
        for row in comparisons
    ]
    console.print()
    console.print(table("Truth and estimate", Table(("parameter", "truth", "estimate", "± std", "z"), rows)))
    rms = float(np.sqrt(np.mean([row.z**2 for row in comparisons])))
    say(f"z is the error in standard errors; its rms over {len(rows)} parameters is {rms:.2f} (1 expected)", console)
    for name in FILES:
        say(f"wrote {folder / name}", console)


def _show_findings(console: Console, found: DiagnosisDocument) -> None:
    console.print()
    say("The same arm once more, a spring concealed at its first joint; what the diagnosis found:", console)
    for finding in found.findings:
        say(finding.statement, console)
    say(f"verdict: {found.verdict}", console)
    console.print()


POLL_S = 0.2
MOTION = ExcitationDesignOptions(starts=1, periods=2, slow_postures=1, closing_period=False)


def run_campaign(data: Path, robot_file: Path, scenario: Mapping[str, Any], told: Told) -> DiagnosisDocument:
    """Run a campaign on a simulated arm, and diagnose it. Raises TauscopeError if the campaign does not succeed."""
    pool = WorkerPool(1, niceness=0)  # no arm is stopped beside it, and other work would leave it no time at all
    with open_services(Settings(data_folder=data), pool) as services:
        identifier = _begin(services, robot_file, scenario)
        _wait_for_end(services, identifier, told)
        found = get_result(identifier, services).diagnosis
    if found is None:
        raise TauscopeError("the demo's campaign made no diagnosis; run the demo again")
    return found


def _begin(services: Services, robot_file: Path, scenario: Mapping[str, Any]) -> str:
    with stage_workspace(services.campaigns.items, CampaignWorkspace) as workspace:
        shutil.copy(robot_file, workspace.robot)
        workspace.write_order(
            CampaignOrder(
                robot_file=robot_file.name,
                robot_name=read_robot(robot_file).name,
                backend=BackendChoice(name="sim", time="virtual", scenario=dict(scenario)),
                excitation=MOTION,
                held_out=HeldOutMotion(periods=1),
                run=RunOptions(rate_hz=RATE_HZ, feed_forward=False),
                diagnosis=DiagnosisOptions(),
            )
        )
        return services.campaigns.submit(workspace.folder)


def _wait_for_end(services: Services, identifier: str, told: Told) -> None:
    """Wait as long as it takes: the arm's time is virtual."""
    while True:
        answer = CAMPAIGNS.describe(services, identifier)
        if answer.state == "damaged" or JobState(answer.state).is_end:
            break
        going = [step.name for step in answer.steps if step.state not in ("waiting", "succeeded", "finished")]
        told(f"concealed effect: {going[0] if going else 'begin'}", None)
        time.sleep(POLL_S)
    if answer.problem is not None:
        raise TauscopeError(f"the demo's campaign did not succeed: {answer.problem.detail}")
