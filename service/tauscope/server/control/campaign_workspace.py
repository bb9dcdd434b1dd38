"""The folder of a campaign: which file in it holds what."""

from pathlib import Path

from tauscope.server.control.campaign_order import CampaignLinks, CampaignOrder
from tauscope.server.queue.stored import read_stored, write_stored
from tauscope.server.queue.workspace import Workspace


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
