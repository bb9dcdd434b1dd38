"""The udev rules, read by udev itself."""

import os
import shutil
import subprocess
from pathlib import Path

import pytest

from shared_data import REPOSITORY

RULES = REPOSITORY / "deploy" / "udev" / "60-tauscope.rules"
RUNTIME = Path("/run/udev/rules.d")

pytestmark = [
    pytest.mark.system,
    pytest.mark.skipif(shutil.which("udevadm") is None or os.geteuid() != 0, reason="needs udevadm and root"),
]


@pytest.fixture
def installed(request: pytest.FixtureRequest) -> str:
    """What udev says of a rules file when it handles a device."""
    RUNTIME.mkdir(parents=True, exist_ok=True)
    placed = RUNTIME / f"60-tauscope-test-{os.getpid()}.rules"
    placed.write_text(request.param)
    try:
        done = subprocess.run(
            ["udevadm", "test", "--action=add", "/sys/devices/virtual/mem/null"],
            capture_output=True,
            text=True,
            check=True,
        )
    finally:
        placed.unlink()
    said = (done.stdout + done.stderr).splitlines()
    assert any(line.startswith("Reading rules file") and placed.name in line for line in said)
    return "\n".join(line for line in said if placed.name in line and not line.startswith("Reading"))


@pytest.mark.parametrize("installed", [RULES.read_text()], ids=["ours"], indirect=True)
def test_udev_understands_every_rule(installed: str) -> None:
    assert installed == ""


@pytest.mark.parametrize("installed", ['SUBSYSTEMX=="tty", MODE="0660"\n'], ids=["broken"], indirect=True)
def test_udev_would_say_if_it_did_not(installed: str) -> None:
    assert "SUBSYSTEMX" in installed
