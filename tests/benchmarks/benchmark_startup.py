"""How much processor time the program takes to start: ``--help``, and ``identify`` on a small recording.

Every time is the least of several runs, of the process and its children. `numbers` loads NumPy and SciPy as an
identification does; the ratios to it in the same run do not depend on how fast the machine is.
"""

import os
import subprocess
import sys
import tempfile
from pathlib import Path

TESTS = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(TESTS)]

from cli.simulated_files import write_files  # noqa: E402

RUNS = 5
NUMBERS = "import numpy, scipy.linalg, scipy.signal"
MOST_HELP = 0.2
"""Most time of `--help`, as a multiple of loading NumPy and SciPy: 0.15 s where that takes 0.75 s."""

MOST_IDENTIFY = 2.1
"""Most time of `identify`, likewise: 0.9 s beyond the numbers, where they take 0.8 s."""


def processor_time(words: list[str]) -> float:
    """Least processor time of a Python process [s]."""
    times = []
    for _ in range(RUNS):
        before = os.times()
        subprocess.run([sys.executable, *words], check=True, stdout=subprocess.DEVNULL)
        after = os.times()
        times.append(after.children_user - before.children_user + after.children_system - before.children_system)
    return min(times)


def main() -> None:
    """Print the table; exit status 1 where a ratio is too large."""
    with tempfile.TemporaryDirectory() as folder:
        files = write_files(Path(folder))
        numbers = processor_time(["-c", NUMBERS])
        imported = processor_time(["-c", "import tauscope"])
        shown = processor_time(["-m", "tauscope.cli", "--help"])
        identified = processor_time(["-m", "tauscope.cli", "identify", str(files.robot), str(files.train[0])])
    print(f"numbers           {numbers:6.3f} s")
    print(f"import tauscope   {imported:6.3f} s")
    print(f"tauscope --help   {shown:6.3f} s  {shown / numbers:5.2f} of numbers (at most {MOST_HELP:g})")
    print(f"tauscope identify {identified:6.3f} s  {identified / numbers:5.2f} of numbers (at most {MOST_IDENTIFY:g})")
    print(f"identify beyond the numbers: {identified - numbers:.3f} s")
    if shown > MOST_HELP * numbers or identified > MOST_IDENTIFY * numbers:
        raise SystemExit("start-up takes too long: look at python -X importtime -m tauscope.cli ...")


if __name__ == "__main__":
    main()
