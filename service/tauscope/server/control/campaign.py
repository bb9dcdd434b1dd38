"""Campaigns: what is asked for, how far they have come, and what their folder holds."""

from pathlib import Path
from typing import Literal

from pydantic import Field

from tauscope.server.queue.job_folder import Workspace, read_stored, write_stored
from tauscope.strict_model import StrictModel
from tauscope.tasks.campaign import CampaignOptions
from tauscope.tasks.run import BackendChoice


class CampaignOrder(CampaignOptions):
    form: Literal["tauscope.campaign-order/1"] = "tauscope.campaign-order/1"
    robot_file: str = Field(description="name of the robot file in the campaign's robot folder")
    robot_name: str = Field(description="what the robot file calls the robot")
    backend: BackendChoice = Field(default=BackendChoice(), description="which arm is moved")


class CampaignLinks(StrictModel):
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
        super().__init__(folder)
        self.robot = folder / "robot"
        self._order = folder / "order.json"
        self._made = folder / "made.json"

    def prepare(self) -> None:
        self.robot.mkdir()

    def read_order(self) -> CampaignOrder | None:
        return read_stored(self._order, CampaignOrder)

    def write_order(self, order: CampaignOrder) -> None:
        write_stored(self._order, order)

    def read_made(self) -> CampaignLinks:
        return read_stored(self._made, CampaignLinks) or CampaignLinks()

    def write_made(self, made: CampaignLinks) -> None:
        write_stored(self._made, made)
