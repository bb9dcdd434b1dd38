"""The units, read by systemd itself."""

import os
import re
import shutil
import subprocess
from pathlib import Path

import pytest

from shared_data import REPOSITORY

UNITS = REPOSITORY / "deploy" / "systemd"
SERVICES = ["tauscope.service", "tauscope-job@.service"]

WORST_EXPOSURE = {"tauscope.service": 2.5, "tauscope-job@.service": 2.0}
"""Of 10, by `systemd-analyze security`; the service may use real-time threads, devices and the network."""

pytestmark = [
    pytest.mark.system,
    pytest.mark.skipif(shutil.which("systemd-analyze") is None, reason="needs systemd-analyze"),
]


@pytest.fixture
def placed(tmp_path: Path) -> Path:
    """The units with a program that is there, and instances in place of templates."""
    for path in UNITS.iterdir():
        text = path.read_text(encoding="utf-8").replace("/opt/tauscope/bin/tauscope", "/bin/true")
        (tmp_path / path.name.replace("@.", "@nightly.")).write_text(text, encoding="utf-8")
    return tmp_path


def analyze(*arguments: str) -> subprocess.CompletedProcess[str]:
    environment = {**os.environ, "SYSTEMD_COLORS": "0"}
    return subprocess.run(["systemd-analyze", *arguments], check=False, capture_output=True, text=True, env=environment)


def complaints(folder: Path, name: str) -> str:
    """What systemd says of a unit of ours, that of others left out."""
    done = analyze("verify", "--man=no", "--recursive-errors=no", str(folder / name))
    return "\n".join(line for line in (done.stdout + done.stderr).splitlines() if "tauscope" in line)


@pytest.mark.parametrize("name", ["tauscope.service", "tauscope-job@nightly.service", "tauscope-job@nightly.timer"])
def test_systemd_understands_every_line(name: str, placed: Path) -> None:
    assert complaints(placed, name) == ""


def test_systemd_would_say_if_it_did_not(placed: Path) -> None:
    unit = placed / "tauscope.service"
    unit.write_text(unit.read_text().replace("ProtectSystem=strict", "ProtectSystems=strict"))
    assert "ProtectSystems" in complaints(placed, "tauscope.service")


@pytest.mark.parametrize("name", SERVICES)
def test_how_little_is_open(name: str, placed: Path) -> None:
    done = analyze("security", "--offline=true", "--no-pager", str(placed / name.replace("@.", "@nightly.")))
    found = re.search(r"Overall exposure level for \S+: ([0-9.]+)", done.stdout)
    assert found is not None, done.stdout + done.stderr
    assert float(found[1]) <= WORST_EXPOSURE[name], done.stdout


def test_the_timer_names_a_time_that_comes() -> None:
    text = (UNITS / "tauscope-job@.timer").read_text()
    (when,) = re.findall(r"^OnCalendar=(.+)$", text, flags=re.MULTILINE)
    done = analyze("calendar", when)
    assert done.returncode == 0, done.stderr
    assert "Next elapse" in done.stdout
