"""Files as a bad disk or a crash of the machine may leave them."""

import os
import random
from pathlib import Path

from reliability.ledger import Ledger
from reliability.requests import Note
from tauscope.server.store.data_folder import FOLDERS, RECORDINGS
from tauscope.server.store.files import hash_file


def damage_something(data: Path, ledger: Ledger, note: Note, chance: random.Random) -> bool:
    """Damage a file of a job or of a recording, or what is remembered of a recording; False where there is none.

    The note comes first: who writes it may be killed before the damage is done.
    """
    draw = chance.random()
    recordings = [
        name for name, each in ledger.recordings.items() if each.is_sure and not each.going and each.is_vouched_for
    ]
    if draw < 0.4 and recordings:
        name = chance.choice(recordings)
        # one of the two: where a recording and what is remembered of it are damaged, nobody can tell
        if draw < 0.1 and not ledger.recordings[name].may_be_damaged:
            note("damage_memory", name, "")
            return _damaged(data / RECORDINGS / ".sha256" / f"{name}.json", chance)
        note("damage_recording", name, "")
        return _damaged(data / RECORDINGS / name, chance)
    jobs = [identifier for identifier, each in ledger.jobs.items() if not each.going]
    if not jobs:
        return False
    identifier = chance.choice(jobs)
    folder = data / FOLDERS["identification"] / identifier
    files = sorted(path for path in folder.rglob("*") if path.is_file() and not _is_passing(path))
    chance.shuffle(files)
    for path in files:
        note("damage_job", identifier, f"{hash_file(path)} {path.relative_to(folder)}")
        if _damaged(path, chance):
            return True
    return False


def _is_passing(path: Path) -> bool:
    """Whether a file is still being written, under a name that it soon loses."""
    return path.name.startswith(".") or path.suffix == ".part"


def _damaged(path: Path, chance: random.Random) -> bool:
    """Change a file in place; now and then its time does not tell of it. False where there is nothing in it."""
    try:
        content, status = bytearray(path.read_bytes()), path.stat()
    except FileNotFoundError:
        return False
    if not content:
        return False
    way = chance.choice(("one bit", "cut off", "emptied"))
    if way == "one bit":
        content[chance.randrange(len(content))] ^= 1 << chance.randrange(8)
    elif way == "cut off":
        del content[chance.randrange(len(content)) :]
    else:
        content.clear()
    path.write_bytes(content)
    if chance.random() < 0.5:
        os.utime(path, ns=(status.st_atime_ns, status.st_mtime_ns))
    return True
