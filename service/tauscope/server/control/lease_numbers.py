"""Numbers of leases: each is higher than all before it, whatever happens to the service in between."""

import time
from pathlib import Path

from tauscope.files import write_atomically


def next_number(counter: Path) -> int:
    """A number above all before, kept before it is used."""
    try:
        last = int(counter.read_text(encoding="ascii"))
    except FileNotFoundError:
        last = 0
    except (OSError, ValueError):
        # The seconds of our era are more than any number that was counted one by one.
        last = int(time.time())
    write_atomically(counter, str(last + 1).encode())
    return last + 1
