"""Campaign: from a robot to an identified model, with every motion on the way."""

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pydantic import Field

from tauscope.errors import AcquisitionError
from tauscope.files import write_atomically
from tauscope.runtime.options import RunOptions
from tauscope.runtime.states import RunState
from tauscope.strict_model import StrictModel
from tauscope.tasks import design_excitation, diagnose, identify, run
from tauscope.tasks.design_excitation import ExcitationDesignOptions
from tauscope.tasks.diagnose import DiagnosisOptions
from tauscope.tasks.identify import IdentificationOptions
from tauscope.tasks.run import BackendChoice
from tauscope.tasks.task import Files, Outputs, Progress


class HeldOutMotion(StrictModel):
    """The motion that the model is judged by, never made from."""

    seed: int | None = Field(
        default=None, ge=0, lt=2**63, description="of its design; null: one more than that of the training motion"
    )
    periods: int = Field(default=2, ge=1, le=100, description="how often its period is repeated")


class CampaignOptions(StrictModel):
    """How each step of a campaign is done."""

    excitation: ExcitationDesignOptions = Field(
        default=ExcitationDesignOptions(), description="how the training motion is designed"
    )
    held_out: HeldOutMotion | None = Field(
        default_factory=HeldOutMotion,  # generators of clients know no default that is an object
        description="a second motion, by which the model is judged; absent: one of 2 periods; null: none",
    )
    run: RunOptions = Field(default=RunOptions(), description="how the motions are run")
    identification: IdentificationOptions = Field(
        default=IdentificationOptions(), description="how the arm is identified"
    )
    diagnosis: DiagnosisOptions | None = Field(
        default=None, description="how what the model leaves out is diagnosed; null: it is not"
    )

    def training_options(self) -> ExcitationDesignOptions:
        """How the training motion is designed: servos may be as far behind as the run allows, if nothing is stated."""
        allowed = self.excitation.following_error or self.run.following_error
        return self.excitation.model_copy(update={"following_error": allowed})

    def held_out_options(self) -> ExcitationDesignOptions | None:
        """How the held-out motion is designed; None where there is none."""
        if self.held_out is None:
            return None
        seed = self.excitation.seed + 1 if self.held_out.seed is None else self.held_out.seed
        changes = {"seed": seed, "periods": self.held_out.periods, "slow_postures": 0, "closing_period": False}
        return self.training_options().model_copy(update=changes)


def backend_of_run(backend: BackendChoice, *, held_out: bool) -> BackendChoice:
    """Which arm is moved by a run; the noise that a scenario's seed fixes is another one in each."""
    scenario = backend.scenario
    if not held_out or scenario is None or not isinstance(scenario.get("seed"), int):
        return backend
    return backend.model_copy(update={"scenario": {**scenario, "seed": scenario["seed"] + 1}})


class Request(CampaignOptions):
    """Which campaign is wanted, and for which robot file."""

    robot: str = Field(description="robot file")
    backend: BackendChoice = Field(default=BackendChoice(), description="which arm is moved")


@dataclass(frozen=True, eq=False)
class Result:
    """What came of it."""

    recordings: tuple[Path, ...]  # the training recording, and the held-out one where there is one
    identification: identify.Result
    diagnosis: diagnose.Result | None

    @property
    def outputs(self) -> Outputs:
        """The outputs of the analyses, below ``identification/`` and ``diagnosis/``."""
        parts: dict[str, Any] = {"identification": self.identification, "diagnosis": self.diagnosis}
        results = {part: result.outputs for part, result in parts.items() if result is not None}
        return Outputs(
            {
                f"{part}/{name}": lambda made=made, name=name: made[name]
                for part, made in results.items()
                for name in made
            }
        )


def perform(request: Request, files: Files, progress: Progress) -> Result:
    """Design, run, identify and, where it is wanted, diagnose.

    Motions and recordings are kept in the target `campaign` of the files, a folder. Raises TauscopeError where a step
    has no result.
    """
    folder = files.target("campaign")
    assert folder is not None  # noqa: S101 - a campaign has a folder
    train = _record(request, request.training_options(), files, folder / "train", progress)
    options = request.held_out_options()
    judge = None if options is None else _record(request, options, files, folder / "held-out", progress)
    inputs = {
        "robot": str(files.find("robot", request.robot)),
        "recordings": (str(train),),
        "held_out": () if judge is None else (str(judge),),
    }
    wanted = identify.Request.model_validate({**inputs, "options": request.identification})
    identified = identify.perform(wanted, Files(), progress)
    diagnosed = None
    if request.diagnosis is not None:
        question = diagnose.Request.model_validate({**inputs, "options": request.diagnosis})
        diagnosed = diagnose.perform(question, Files(), progress)
    return Result((train,) if judge is None else (train, judge), identified, diagnosed)


def _record(request: Request, options: ExcitationDesignOptions, files: Files, place: Path, progress: Progress) -> Path:
    """Design a motion, run it, and keep its trajectory and its recording beside `place`."""
    robot, is_held_out = str(files.find("robot", request.robot)), place.name == "held-out"
    design = design_excitation.Request(robot=robot, options=options)
    trajectory, recording = place.with_suffix(".json"), place.with_suffix(".csv")
    write_atomically(trajectory, design_excitation.perform(design, Files(), progress).outputs["trajectory.json"])
    backend, scenario = backend_of_run(request.backend, held_out=is_held_out), place.with_suffix(".scenario.json")
    if backend.name == "sim":
        content = {"seed": int(is_held_out), **(backend.scenario or {})}
        write_atomically(scenario, json.dumps(content, ensure_ascii=False).encode())
    wanted = run.Request(
        robot=robot,
        backend=backend,
        scenario=str(scenario) if backend.name == "sim" else None,
        trajectory=str(trajectory),
        options=request.run,
    )
    result = run.perform(wanted, Files({"run": place}), progress)
    found = result.recording("csv")
    if result.record.state is not RunState.FINISHED or found is None:
        why = result.record.stop if result.record.problem is None else result.record.problem.detail
        raise AcquisitionError(f"the {place.name} run {result.record.state}: {why or 'no reason is known'}")
    return found.replace(recording)
