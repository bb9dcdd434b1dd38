"""Sessions of pytest on the kernel's CAN bus, one disturbance after the other: test_socketcan.py runs this program.

Each session is forked from a process that has imported what all of them need: in the virtual machine that takes 20 s.
"""

import importlib
import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

import pytest

REPOSITORY = Path(__file__).resolve().parents[2]
CONFORMANCE = ["tests/drivers", "-k", "socketcan and conformance"]
MOTION = ["tests/drivers", "-k", "socketcan and (conformance_motion or conformance_watchdog)"]
"""What time allows where frames are disturbed; ``TAUSCOPE_WHOLE_SUITE=1`` runs all of it."""

RUNS = ["-s", "tests/hardware_emulated/test_disturbed_runs.py"]
SHARED = [
    "hypothesis.strategies",
    "mujoco",
    "arm_rigs",
    "hardware_emulated.fault_runs",
    "hardware_emulated.fault_table",
]


def run_session(words: list[str], environment: dict[str, str], printed: int) -> int:
    """Run pytest in a fork whose output goes to a file descriptor; its exit status."""
    process = os.fork()
    if process == 0:
        os.dup2(printed, 1)
        os.dup2(printed, 2)
        os.environ.update(environment)
        options = ["-q", "-m", "", "--tb=short", "-p", "pytest_timeout", "--basetemp=/dev/shm/pytest"]
        status = pytest.main([*options, "-o", "cache_dir=/dev/shm/cache", *words])
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(status)
    return os.waitstatus_to_exitcode(os.waitpid(process, 0)[1])


def run_disturbed(interface: str, disturbance: dict[str, Any], printed: int) -> int:
    """The suite under a disturbance, then whole runs: both put drives of the same numbers on the bus."""
    netem = disturbance["netem"]
    environment = {"TAUSCOPE_NETEM": netem, "TAUSCOPE_ANSWERS_WITHIN": str(disturbance["answers_within"])}
    if not netem:
        return run_session(CONFORMANCE, environment, printed)
    subprocess.run(["tc", "qdisc", "replace", "dev", interface, "root", "netem", *netem.split()], check=True)
    try:
        suite = CONFORMANCE if os.environ.get("TAUSCOPE_WHOLE_SUITE") else MOTION
        status = run_session(suite, environment, printed)
        for _ in range(disturbance["repeats"]):
            if status != 0:
                status = run_session([*suite, "--last-failed"], environment, printed)
        return status or run_session(RUNS, environment, printed)
    finally:
        subprocess.run(["tc", "qdisc", "del", "dev", interface, "root"], check=True)


def main(disturbances: dict[str, dict[str, Any]], results: Path) -> None:
    """Write a line of JSON a disturbance."""
    sys.path[:0] = [str(REPOSITORY / name) for name in ("service", "drivers", "sim_backend", "tests")]
    for module in SHARED:
        importlib.import_module(module)
    for name, disturbance in disturbances.items():
        with tempfile.TemporaryFile() as file:
            status = run_disturbed(os.environ["TAUSCOPE_SOCKETCAN"], disturbance, file.fileno())
            file.seek(0)
            entry = {"name": name, "status": status, "printed": file.read().decode(errors="replace")}
        with results.open("a", encoding="utf-8") as lines:
            lines.write(json.dumps(entry) + "\n")


if __name__ == "__main__":
    main(json.loads(sys.argv[1]), Path(sys.argv[2]))
