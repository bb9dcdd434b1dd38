"""The conformance suite on the kernel's CAN bus, in a virtual machine where this kernel has none.

The emulated drives' time is stepped, so that what passes there does not depend on how fast the machine is. The kernel's
netem delays, loses or alters frames meanwhile. What has to hold then:

- late frames change nothing;
- lost frames leave samples that are missing and marked, and everything else passes as without them;
- altered frames do not exist on a CAN bus, whose frames have a checksum. Of those that netem makes, no host can notice
  every one: a target that was altered on its way moves the arm. A test that fails then is repeated, and has to pass.
"""

import json
import os
import shutil
import subprocess
import sys
from dataclasses import asdict, dataclass
from pathlib import Path

import pytest

from shared_data import REPOSITORY

TOOL = Path(os.environ.get("TAUSCOPE_SOCKETCAN_VM") or REPOSITORY.parent / "shared" / "tools" / "socketcan-vm.sh")
SHIM = Path(__file__).with_name("xstate_ptrace.c")
SESSIONS = Path(__file__).with_name("socketcan_sessions.py")
INTERFACE = "vcan0"


@dataclass(frozen=True)
class Result:
    """How the sessions of pytest under one disturbance ended."""

    status: int
    printed: str


@dataclass(frozen=True)
class Disturbance:
    """What netem does to the frames, and what that may cost.

    netem : str
        its arguments; empty for nothing
    answers_within : int
        cycles in which every drive answers at least once
    repeats : int
        how often a test that failed is repeated
    """

    netem: str
    answers_within: int = 1
    repeats: int = 0


DISTURBANCES = {
    "none": Disturbance(""),
    "delay": Disturbance("delay 1ms"),
    "loss": Disturbance("loss 0.5%", answers_within=5),
    "corruption": Disturbance("corrupt 0.1%", answers_within=5, repeats=1),
}


@pytest.fixture(scope="module")
def results(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Result]:
    """How each disturbance ended; one machine for all, as to start it and Python in it takes 20 s."""
    if not TOOL.is_file():
        pytest.skip(f"no {TOOL}; name the virtual machine's tool in TAUSCOPE_SOCKETCAN_VM")
    for program in ("gcc", "tc", "ip"):
        if shutil.which(program) is None:
            pytest.skip(f"needs {program}")
    library = tmp_path_factory.mktemp("shim") / "xstate.so"
    subprocess.run(["gcc", "-shared", "-fPIC", "-O1", "-o", library, SHIM, "-ldl"], check=True)
    subprocess.run([TOOL, "--setup"], check=True, capture_output=True)
    path = tmp_path_factory.mktemp("sessions") / "results.jsonl"
    told = {"TAUSCOPE_SOCKETCAN": INTERFACE, "VM_TIMEOUT": "2400", "PYTEST_DISABLE_PLUGIN_AUTOLOAD": "1"}
    asked = json.dumps({name: asdict(disturbance) for name, disturbance in DISTURBANCES.items()})
    done = subprocess.run(
        [TOOL, sys.executable, SESSIONS, asked, path],
        cwd=REPOSITORY,
        env={**os.environ, "LD_PRELOAD": str(library), **told},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stdout[-8000:] + done.stderr[-2000:]
    return {entry.pop("name"): Result(**entry) for entry in map(json.loads, path.read_text().splitlines())}


@pytest.mark.system
@pytest.mark.proof
@pytest.mark.timeout(3000)
@pytest.mark.parametrize("name", list(DISTURBANCES))
def test_the_conformance_suite_passes(results: dict[str, Result], name: str) -> None:
    result = results[name]
    assert result.status == 0, result.printed[-8000:]
    assert " passed" in result.printed
    print(result.printed[-400:])
