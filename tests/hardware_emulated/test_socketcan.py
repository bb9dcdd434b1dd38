"""The conformance suite on the kernel's CAN bus, in a virtual machine where this kernel has none.

The emulated drives' time is stepped, so that what passes there does not depend on how fast the machine is. The kernel's
netem delays, loses or alters frames meanwhile. What has to hold then:

- late frames change nothing;
- lost frames leave samples that are missing and marked, and everything else passes as without them;
- altered frames do not exist on a CAN bus, whose frames have a checksum. Of those that netem makes, no host can notice
  every one: a target that was altered on its way moves the arm. A test that fails then is repeated, and has to pass.
"""

import os
import shlex
import shutil
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

import pytest

from shared_data import REPOSITORY

TOOL = Path(os.environ.get("TAUSCOPE_SOCKETCAN_VM") or REPOSITORY.parent / "shared" / "tools" / "socketcan-vm.sh")
SHIM = Path(__file__).with_name("xstate_ptrace.c")
INTERFACE = "vcan0"

CONFORMANCE = ["tests/drivers", "-k", "socketcan and conformance"]
MOTION = ["tests/drivers", "-k", "socketcan and (conformance_motion or conformance_watchdog)"]
"""What time allows where frames are disturbed; ``TAUSCOPE_WHOLE_SUITE=1`` runs all of it."""

RUNS = ["tests/hardware_emulated/test_disturbed_runs.py"]
CACHE = "/dev/shm/cache"


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

    @property
    def command(self) -> str:
        """For a shell in the virtual machine."""
        pytest = [sys.executable, "-m", "pytest", "-q", "-m", "", "--tb=short", "--basetemp=/dev/shm/pytest"]
        pytest += ["-o", f"cache_dir={CACHE}"]
        if not self.netem:
            return shlex.join([*pytest, *CONFORMANCE])
        suite = [*pytest, *(CONFORMANCE if os.environ.get("TAUSCOPE_WHOLE_SUITE") else MOTION)]
        again = f" || {shlex.join([*suite, '--last-failed'])}" * self.repeats
        # one after the other: both put drives of the same numbers on the bus
        return (
            f"tc qdisc add dev {INTERFACE} root netem {self.netem} && "
            f"{{ {shlex.join(suite)}{again}; }} && {shlex.join([*pytest, '-s', *RUNS])}"
        )


DISTURBANCES = {
    "none": Disturbance(""),
    "delay": Disturbance("delay 1ms"),
    "loss": Disturbance("loss 0.5%", answers_within=5),
    "corruption": Disturbance("corrupt 0.1%", answers_within=5, repeats=1),
}


@pytest.fixture(scope="module")
def machine(tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    """Environment in which the virtual machine starts."""
    if not TOOL.is_file():
        pytest.skip(f"no {TOOL}; name the virtual machine's tool in TAUSCOPE_SOCKETCAN_VM")
    for program in ("gcc", "tc", "ip"):
        if shutil.which(program) is None:
            pytest.skip(f"needs {program}")
    library = tmp_path_factory.mktemp("shim") / "xstate.so"
    subprocess.run(["gcc", "-shared", "-fPIC", "-O1", "-o", library, SHIM, "-ldl"], check=True)
    subprocess.run([TOOL, "--setup"], check=True, capture_output=True)
    return {**os.environ, "LD_PRELOAD": str(library), "TAUSCOPE_SOCKETCAN": INTERFACE, "VM_TIMEOUT": "900"}


@pytest.mark.system
@pytest.mark.slow
@pytest.mark.timeout(1800)
@pytest.mark.parametrize("name", list(DISTURBANCES))
def test_the_conformance_suite_passes(machine: dict[str, str], name: str) -> None:
    disturbance = DISTURBANCES[name]
    told = {"TAUSCOPE_NETEM": disturbance.netem, "TAUSCOPE_ANSWERS_WITHIN": str(disturbance.answers_within)}
    command = [str(TOOL), "bash", "-c", disturbance.command]
    done = subprocess.run(command, cwd=REPOSITORY, env=machine | told, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout[-8000:] + done.stderr[-2000:]
    assert " passed" in done.stdout
    print(done.stdout[-400:])
