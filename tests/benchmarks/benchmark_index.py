"""How fast the index of a data folder is made anew: items a second, of a folder whose database was lost.

The items are copies of those of a data folder of version 0.1.0, with their results and exports.
"""

import os
import shutil
import sys
import tempfile
import time
from pathlib import Path

TESTS = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(TESTS)]

from snapshots import SNAPSHOTS, unpacked  # noqa: E402
from tauscope.server.history.indexer import open_index  # noqa: E402
from tauscope.server.store.data_folder import FOLDERS, RECORDINGS, item_stores  # noqa: E402
from tauscope.server.store.database.database import FILE_NAME, Database  # noqa: E402
from tauscope.server.store.database.index import Index  # noqa: E402
from tauscope.server.store.recordings import RecordingStore  # noqa: E402

ITEMS = 4000
LEAST_PER_S = 1000.0
"""Items a second on two quiet cores."""


def main() -> None:
    """Print the rate; exit status 1 where it is too small."""
    with tempfile.TemporaryDirectory() as folder:
        data = unpacked(SNAPSHOTS[0], Path(folder))
        copied = copy_items(data)
        (data / FILE_NAME).unlink(missing_ok=True)
        database = Database(data / FILE_NAME)
        keeper = open_index(Index(database, "here"), item_stores(data), RecordingStore(data / RECORDINGS), "data")
        began = time.monotonic()
        keeper.sync()
        elapsed_s = time.monotonic() - began
        database.close()
    rate = copied / elapsed_s
    print(f"{copied} items in {elapsed_s:.2f} s: {rate:.0f} a second (at least {LEAST_PER_S:g})")
    sys.exit(rate < LEAST_PER_S)


def copy_items(data: Path) -> int:
    """Copy items until there are `ITEMS`; returns how many there are."""
    present = [path for name in FOLDERS.values() for path in (data / name).iterdir() if path.is_dir()]
    for number in range(ITEMS - len(present)):
        source = present[number % len(present)]
        stamp = source.name.partition("-")[0]
        shutil.copytree(source, source.with_name(f"{stamp}-{number:08x}"), copy_function=os.link)
    return max(ITEMS, len(present))


if __name__ == "__main__":
    main()
