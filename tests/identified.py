"""Identifications to compare: that of a snapshot, changed as a test says."""

import json
import tarfile
from datetime import UTC, datetime, timedelta
from functools import cache
from typing import Any

from snapshots import SNAPSHOTS
from tauscope.identification import IdentificationDocument
from tauscope.server.history.model_judgement import Candidate

NOON = datetime(2026, 11, 3, 12, 0, 0, tzinfo=UTC)


@cache
def _content() -> bytes:
    """The result that was judged by a held-out recording."""
    with tarfile.open(SNAPSHOTS[-1]) as archive:
        for entry in archive:
            if "/identifications/" in entry.name and entry.name.endswith("/result.json"):
                file = archive.extractfile(entry)
                assert file is not None
                content = file.read()
                if json.loads(content)["fit"]["held_out"] is not None:
                    return content
    raise AssertionError("the snapshot has no such result")


def identified(friction: dict[str, float] | None = None, **changes: Any) -> IdentificationDocument:
    """An identification of one joint, ``shoulder``; its friction terms and its fields as given."""
    data = json.loads(_content())
    data["friction"][0] |= friction or {}
    for path, value in changes.items():
        *steps, last = path.split("__")
        place = data
        for step in steps:
            place = place[int(step) if step.isdigit() else step]
        place[int(last) if last.isdigit() else last] = value
    return IdentificationDocument.model_validate_json(json.dumps(data))


def candidate(number: int, document: IdentificationDocument | None, **changes: Any) -> Candidate:
    """The identification of a day of the year 2026, by its number."""
    created = datetime(2026, 1, 1, 12, tzinfo=UTC) + timedelta(days=number)
    result = None if document is None else document.model_dump_json(by_alias=True).encode()
    given = {"robot": "arm", "source": "arm", "created": created, "site": "here", **changes}
    return Candidate(identifier=f"2026{created:%m%d}T120000Z-{number:08x}", result=result, **given)
