"""Campaigns: what is asked for, how far they have come, and what their folder holds."""

from pathlib import Path
from typing import Literal

from pydantic import Field

from tauscope.runtime.options import RunOptions
from tauscope.server.queue.stored import StoredModel, read_stored, write_stored
from tauscope.server.queue.workspace import Workspace
from tauscope.tasks.design_excitation import ExcitationDesignOptions
from tauscope.tasks.diagnose import DiagnosisOptions
from tauscope.tasks.identify import IdentificationOptions
from tauscope.tasks.run import BackendChoice


class HeldOutMotion(StoredModel):
    """The motion that the model is judged by, never made from."""

    seed: int | None = Field(
        default=None, ge=0, lt=2**63, description="of its design; null: one more than that of the training motion"
    )
    periods: int = Field(default=2, ge=1, le=100, description="how often its period is repeated")


class CampaignOrder(StoredModel):
    """Input of a campaign."""

    form: Literal["tauscope.campaign-order/1"] = Field(
        default="tauscope.campaign-order/1", description="name and version of this form"
    )
    robot_file: str = Field(description="name of the robot file in the campaign's robot folder")
    robot_name: str = Field(description="what the robot file calls the robot")
    backend: BackendChoice = Field(default=BackendChoice(), description="which arm is moved")
    excitation: ExcitationDesignOptions = Field(
        default=ExcitationDesignOptions(), description="how the training motion is designed"
    )
    held_out: HeldOutMotion | None = Field(default=HeldOutMotion(), description="null: no second motion")
    run: RunOptions = Field(default=RunOptions(), description="how the motions are run")
    identification: IdentificationOptions = Field(
        default=IdentificationOptions(), description="how the arm is identified"
    )
    diagnosis: DiagnosisOptions | None = Field(default=None, description="how it is diagnosed; null: it is not")

    def backend_of(self, *, held_out: bool) -> BackendChoice:
        """Which arm is moved by a run; the noise that a scenario's seed fixes is another one in each."""
        scenario = self.backend.scenario
        if not held_out or scenario is None or not isinstance(scenario.get("seed"), int):
            return self.backend
        return self.backend.model_copy(update={"scenario": {**scenario, "seed": scenario["seed"] + 1}})

    def held_out_options(self) -> ExcitationDesignOptions | None:
        """How the held-out motion is designed; None where there is none."""
        if self.held_out is None:
            return None
        seed = self.excitation.seed + 1 if self.held_out.seed is None else self.held_out.seed
        changes = {"seed": seed, "periods": self.held_out.periods, "slow_postures": 0, "closing_period": False}
        return self.excitation.model_copy(update=changes)


class CampaignLinks(StoredModel):
    """What a campaign has made so far; null where it has not come to it."""

    excitation: str | None = Field(default=None, description="identifier of the training motion")
    held_out_excitation: str | None = Field(default=None, description="identifier of the held-out motion")
    run: str | None = Field(default=None, description="identifier of the training run")
    held_out_run: str | None = Field(default=None, description="identifier of the held-out run")
    identification: str | None = Field(default=None, description="identifier of the identification")
    diagnosis: str | None = Field(default=None, description="identifier of the diagnosis")
    recordings: tuple[str, ...] = Field(default=(), description="recordings that the model is made from")
    held_out: tuple[str, ...] = Field(default=(), description="recordings that it is judged by")


class CampaignWorkspace(Workspace):
    """Files of a campaign: ``order.json`` and ``robot/``; ``made.json`` names what it has made so far."""

    def __init__(self, folder: Path) -> None:
        """Look at a campaign's folder; nothing is opened yet."""
        super().__init__(folder)
        self.robot = folder / "robot"
        self._order = folder / "order.json"
        self._made = folder / "made.json"

    def prepare(self) -> None:
        """Make the folder that holds a campaign's input."""
        self.robot.mkdir()

    def read_order(self) -> CampaignOrder | None:
        """The campaign's input, or None where the file is missing or damaged."""
        return read_stored(self._order, CampaignOrder)

    def write_order(self, order: CampaignOrder) -> None:
        """Keep the campaign's input."""
        write_stored(self._order, order)

    def read_made(self) -> CampaignLinks:
        """What the campaign has made so far; nothing where the file is missing or damaged."""
        return read_stored(self._made, CampaignLinks) or CampaignLinks()

    def write_made(self, made: CampaignLinks) -> None:
        """Keep what the campaign has made so far."""
        write_stored(self._made, made)
