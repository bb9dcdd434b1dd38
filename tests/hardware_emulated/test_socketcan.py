"""The conformance suite on the kernel's CAN bus, in a virtual machine where this kernel has none.

The emulated drives' time is stepped, so that what passes there does not depend on how fast the machine is. What netem
shall do to the frames is named in ``TAUSCOPE_NETEM``, as in ``delay 1ms`` or ``loss 0.1%``.
"""

import os
import shlex
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from shared_data import REPOSITORY

TOOL = Path(os.environ.get("TAUSCOPE_SOCKETCAN_VM") or REPOSITORY.parent / "shared" / "tools" / "socketcan-vm.sh")
SHIM = Path(__file__).with_name("xstate_ptrace.c")
INTERFACE = "vcan0"

NETEM = os.environ.get("TAUSCOPE_NETEM", "")


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
@pytest.mark.timeout(1000)
def test_the_conformance_suite_passes(machine: dict[str, str]) -> None:
    suite = [sys.executable, "-m", "pytest", "tests/drivers", "-q", "-m", "", "-k", "socketcan and conformance"]
    suite += ["-p", "no:cacheprovider", "--basetemp=/dev/shm/pytest", "--tb=short"]
    prepare = f"tc qdisc add dev {INTERFACE} root netem {NETEM} && " if NETEM else ""
    command = [str(TOOL), "bash", "-c", prepare + shlex.join(suite)]
    done = subprocess.run(command, cwd=REPOSITORY, env=machine, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout[-8000:] + done.stderr[-2000:]
    assert " passed" in done.stdout
