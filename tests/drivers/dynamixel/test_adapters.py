"""What is said of serial adapters that nobody has opened: latency timer, permission, holder."""

import os
from pathlib import Path
from types import SimpleNamespace

import pytest

from tauscope_drivers.drive_block import DriveJoint
from tauscope_drivers.dynamixel.bus import planned_budget
from tauscope_drivers.dynamixel.configuration import read_configuration
from tauscope_drivers.inspection import Severity
from tauscope_drivers.serial_port import latency_finding, read_latency_timer_ms, serial_adapters


@pytest.fixture
def adapter(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A device file, reached by a link as udev makes them, and no other adapter on this machine."""
    device, link = tmp_path / "ttyUSB7", tmp_path / "dynamixel"
    device.touch()
    link.symlink_to(device)
    monkeypatch.setattr("tauscope_drivers.serial_port._TTY_DEVICES", tmp_path / "sys")
    one = SimpleNamespace(device=str(link), description="USB <-> Serial Converter")
    monkeypatch.setattr("tauscope_drivers.serial_port.comports", lambda: [one])
    return link


def set_timer(adapter: Path, text: str) -> None:
    folder = adapter.parent / "sys" / "ttyUSB7" / "device"
    folder.mkdir(parents=True)
    (folder / "latency_timer").write_text(text)


def test_a_long_latency_timer_is_told_with_the_rate_that_it_leaves(adapter: Path) -> None:
    set_timer(adapter, "16\n")
    access, latency = serial_adapters()
    assert (access.severity, access.detail) == (Severity.GOOD, "USB <-> Serial Converter")
    assert latency.severity is Severity.WARNING
    assert latency.detail == "latency timer 16 ms: no more than 31 Hz", "two reads a cycle wait for it"
    assert latency.remedy.startswith("write 1 to /sys/class/tty/ttyUSB7/device/latency_timer"), "of the device itself"


@pytest.mark.parametrize(("text", "words"), [("1\n", "latency timer 1 ms"), ("", "the adapter has no latency timer")])
def test_a_short_one_or_none_is_sound(adapter: Path, text: str, words: str) -> None:
    if text:
        set_timer(adapter, text)
    finding = latency_finding(str(adapter))
    assert (finding.severity, finding.detail, finding.remedy) == (Severity.GOOD, words, "")


def test_the_planned_rate_knows_the_timer(adapter: Path) -> None:
    configuration = read_configuration([DriveJoint("joint1", {"id": 1, "port": str(adapter)})])
    assert planned_budget(configuration)[1].latency_s == 1e-3
    set_timer(adapter, "16\n")
    assert planned_budget(configuration)[1].latency_s == 16e-3


def test_what_is_no_number_is_no_timer(adapter: Path) -> None:
    set_timer(adapter, "soon\n")
    assert read_latency_timer_ms(str(adapter)) is None


def test_a_port_that_may_not_be_opened_is_told_with_who_may(adapter: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(os, "access", lambda *_: False)
    (finding,) = serial_adapters()
    assert (finding.severity, finding.subject) == (Severity.FAILURE, str(adapter))
    assert "may not be opened" in finding.detail
    assert "dialout" in finding.remedy


def test_a_port_that_a_program_has_is_told_by_its_name(adapter: Path) -> None:
    master, slave = os.openpty()
    adapter.unlink()
    adapter.symlink_to(os.ttyname(slave))
    (finding,) = serial_adapters()
    os.close(master)
    os.close(slave)
    assert finding.severity is Severity.WARNING
    assert f"held by process {os.getpid()}" in finding.detail
    assert finding.remedy
