"""Making a schedule from something that was done once: its robot and its options are repeated."""

import json
from datetime import datetime

from tauscope.errors import NotFoundError
from tauscope.server.control.campaign import CampaignWorkspace
from tauscope.server.queue.diagnosis import DiagnosisWorkspace
from tauscope.server.queue.identification import IdentificationWorkspace
from tauscope.server.schedules.definition import ScheduleDefinition
from tauscope.server.schedules.repeater import Repeater
from tauscope.server.schedules.repository import ScheduleEntry

_WORKSPACES = {
    "campaign": CampaignWorkspace,
    "identification": IdentificationWorkspace,
    "diagnosis": DiagnosisWorkspace,
}


def make_schedule(
    name: str, like: str, definition: ScheduleDefinition, repeater: Repeater, site: str | None, now: datetime
) -> ScheduleEntry:
    """A schedule that repeats an item of this site.

    Parameters
    ----------
    site : str or None
        of the data folder whose service does it; None for whichever comes first

    Raises
    ------
    NotFoundError
        if there is no such item, or its files are damaged
    """
    workspace = _WORKSPACES[definition.kind](repeater.items(definition.kind).folder(like))
    order = workspace.read_order()
    if order is None:
        raise NotFoundError(f"{definition.kind} {like}: its order is missing or damaged; name another one")
    plain = json.loads(order.model_dump_json(exclude=_lists(definition)))
    if definition.kind != "campaign":
        plain["recordings"] = []
    try:
        files = {path.name: path.read_text(encoding="utf-8") for path in sorted(workspace.robot.iterdir())}
    except (OSError, UnicodeDecodeError):
        text = f"{definition.kind} {like}: its robot file is missing or damaged; name another one"
        raise NotFoundError(text) from None
    due = definition.next_after(now, now)
    return ScheduleEntry(name, site, definition.model_dump(mode="json"), plain, files, now, due)


def _lists(definition: ScheduleDefinition) -> set[str]:
    """Fields of an order that name files: a campaign's `held_out` is a motion."""
    return set() if definition.kind == "campaign" else {"recordings", "held_out", "simulated", "model"}
