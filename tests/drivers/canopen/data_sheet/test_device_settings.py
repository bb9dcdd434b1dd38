"""What an emulated drive is given from its DCF file, whether it is the drive of the file, and how that is shown."""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import can
import numpy as np
import pytest

from emulated_can_bus import EmulatedBus
from emulated_data_sheet import COMMAND, GAIN, OFFSET, PRODUCT, REVISION, VENDOR, Sections, sections, write_file
from tauscope_drivers import ControlMode, DriveLimits, DriverError, StopPolicy
from tauscope_drivers.canopen.arm import CanopenArm
from tauscope_drivers.canopen.doctor import examine
from tauscope_drivers.canopen.dry_run import plan_frames
from tauscope_drivers.drive_block import DriveJoint
from tauscope_drivers.errors import DriverErrorKind
from tauscope_drivers.inspection import FrameRequest, Severity
from tauscope_sim.canopen_bus.object_dictionary import Abort, AbortError, Entry

FREE = np.full(3, np.inf)
LIMITS = DriveLimits(-FREE, FREE, FREE, np.full(3, 20.0))
SECOND = 1
"""Index of the joint whose drive has the file."""


@pytest.fixture
def bus() -> Iterator[EmulatedBus]:
    with EmulatedBus() as emulated:
        for drive in emulated.drives:
            entries = drive.dictionary.entries
            for subindex, value in ((1, VENDOR), (2, PRODUCT), (3, REVISION)):
                entries[0x1018, subindex] = Entry(4, value, writable=False)
            entries[0x2001, 0] = Entry(2, 100)
            entries[0x2002, 0] = Entry(2, -3, signed=True)
            entries[0x2004, 0] = Entry(1, 0)
        yield emulated


def joints(bus: EmulatedBus, path: str) -> list[DriveJoint]:
    found = bus.joints()
    found[SECOND] = replace(found[SECOND], drive={**found[SECOND].drive, "eds": path})
    return found


def dcf() -> Sections:
    """Every kind of value: the maker's own settings, what the driver sets, commands, communication."""
    content = sections(VendorNumber=hex(VENDOR), ProductNumber=hex(PRODUCT), RevisionNumber=hex(REVISION))
    content["DeviceComissioning"] = {"NodeID": "2", "Baudrate": "500"}
    values = {
        **{GAIN: "250", OFFSET: "0xFFF6", COMMAND: "1", "6076": "600", "6060": "1", "6072": "600", "6040": "0x0F"},
        **{"607A": "77", "607Dsub1": "-5", "1017": "1", "1016sub1": "0x7E0001", "1600sub1": "$NODEID+1"},
    }
    for section, value in values.items():
        content[section]["ParameterValue"] = value
    content["6076"]["AccessType"] = "rw"
    content["2005"] = {**content[GAIN], "ParameterName": "Baud rate", "ParameterValue": "3"}
    return content


def enable(arm: CanopenArm) -> None:
    arm.enable(ControlMode.POSITION, LIMITS, StopPolicy.HOLD, 2.0)


def refusal(arm: CanopenArm) -> str:
    with pytest.raises(DriverError) as caught:
        enable(arm)
    assert caught.value.kind is DriverErrorKind.REFUSED
    message = str(caught.value)
    assert len(message.splitlines()) == 1
    return message


def test_a_drive_has_its_settings_before_it_is_commissioned(bus: EmulatedBus, tmp_path: Path) -> None:
    """Its rated torque is among them: torques mean something else from then on."""
    bus.drives[SECOND].dictionary.entries[0x6076, 0].writable = True
    arm = CanopenArm(joints(bus, write_file(tmp_path, dcf(), "drive.dcf")), patience_s=0.1)
    before = arm.connect().effort
    given = bus.drives[SECOND].dictionary
    assert (given.get(0x2001), given.get(0x2002)) == (100, -3), "connecting writes nothing"
    enable(arm)
    assert (given.get(0x2001), given.get(0x2002), given.get(0x6076)) == (250, -10, 600)
    assert given.get(0x2004) == 0, "a command is no setting"
    assert given.get(0x6060) == 8
    assert given.get(0x6072) == 600, "less than the 666 of 20 Nm behind a gear of 50, of 0.6 Nm"
    assert bus.drives[0].dictionary.get(0x6072) == 800, "20 Nm behind a gear of 50, of 0.5 Nm"
    assert given.get(0x1017) == 100
    assert given.get(0x1600, 1) == 0x60400010
    assert bus.drives[0].dictionary.get(0x2001) == 100, "another drive has no file"
    after = arm.stop(StopPolicy.HOLD).effort
    assert after[SECOND] / before[SECOND] == pytest.approx(1.2)
    arm.disconnect()


def test_only_what_differs_is_written_and_never_under_power(bus: EmulatedBus, tmp_path: Path) -> None:
    content = sections()
    content[GAIN]["ParameterValue"] = "250"
    written: list[int] = []
    bus.drives[SECOND].dictionary.entries[0x2001, 0].hook = written.append
    arm = CanopenArm(joints(bus, write_file(tmp_path, content)), patience_s=0.1)
    arm.connect()
    enable(arm)
    arm.stop(StopPolicy.HOLD)
    enable(arm)
    assert written == [250]
    arm.stop(StopPolicy.HOLD)
    bus.drives[SECOND].dictionary.put(0x2001, 1)
    message = refusal(arm)
    assert message.startswith("joint 2 (node 2): is under power, and Gain (0x2001:00) is not yet 250 as ")
    assert written == [250]
    arm.disconnect()


def test_what_a_drive_does_not_take_is_named(bus: EmulatedBus, tmp_path: Path) -> None:
    content = dcf()
    del content["6076"]["ParameterValue"]
    arm = CanopenArm(joints(bus, write_file(tmp_path, content)), patience_s=0.1)
    arm.connect()
    gain, offset = (bus.drives[SECOND].dictionary.entries[index, 0] for index in (0x2001, 0x2002))

    def forbid(value: int) -> None:
        raise AbortError(Abort.VALUE_RANGE)

    gain.hook = forbid
    message = refusal(arm)
    assert message.startswith("joint 2 (node 2): Gain (0x2001:00) = 250 of ")
    assert message.endswith("correct its ParameterValue, or remove it")
    gain.hook = None

    def clip(_: can.Message) -> bool:
        offset.value = max(offset.value, -4)
        return False

    bus.swallows = clip
    message = refusal(arm)
    assert "Offset (0x2002:00) was written as 0xFFF6, as " in message
    assert "and reads back as 0xFFFC; correct its ParameterValue" in message
    bus.swallows = lambda _: False
    del bus.drives[SECOND].dictionary.entries[0x2002, 0]
    assert "Offset (0x2002:00) = 0xFFF6 of " in refusal(arm)
    assert all(drive.dictionary.get(0x6060) == 0 for drive in bus.drives), "nothing is commissioned"
    arm.disconnect()


def test_a_silent_drive_is_told_as_such(bus: EmulatedBus, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    arm = CanopenArm(joints(bus, write_file(tmp_path, dcf())), patience_s=0.1)
    arm.connect()
    monkeypatch.setattr("tauscope_drivers.canopen.sdo.SDO_TIMEOUT_S", 0.01)
    bus.swallows = lambda frame: frame.arbitration_id == 0x602
    with pytest.raises(DriverError, match=r"node 2: Gain \(0x2001:00\) cannot be read .*check node number") as caught:
        enable(arm)
    assert caught.value.kind is DriverErrorKind.CANNOT_CONNECT
    bus.swallows = lambda _: False
    arm.disconnect()


@pytest.mark.parametrize(
    ("subindex", "told", "words"),
    [
        (1, 0x3A2, "Vendor-ID (0x1018:01) reads 0x3A2, and "),
        (2, 0x403, "Product code (0x1018:02) reads 0x403, and "),
        (3, 0x00030005, "Revision number (0x1018:03) reads 0x30005, and "),
    ],
)
def test_another_drive_than_the_files_is_refused(
    bus: EmulatedBus, tmp_path: Path, subindex: int, told: int, words: str
) -> None:
    path = write_file(tmp_path, dcf())
    bus.drives[SECOND].dictionary.put(0x1018, told, subindex)
    arm = CanopenArm(joints(bus, path), patience_s=0.1)
    with pytest.raises(DriverError, match=r"check drive\.node_id, or give the file of this drive$") as caught:
        arm.connect()
    assert str(caught.value).startswith(f"joint 2 (node 2): {words}drive.eds states 0x")
    failures = [finding for finding in examine(joints(bus, path)) if finding.severity is Severity.FAILURE]
    assert [finding.subject for finding in failures] == ["joint 2 (node 2)"]
    assert words in failures[0].detail


def test_a_minor_revision_and_what_a_drive_does_not_tell_pass(bus: EmulatedBus, tmp_path: Path) -> None:
    dictionary = bus.drives[SECOND].dictionary
    dictionary.put(0x1018, REVISION + 1, 3)
    del dictionary.entries[0x1018, 2]
    arm = CanopenArm(joints(bus, write_file(tmp_path, dcf())), patience_s=0.1)
    arm.connect()
    arm.disconnect()


def test_doctor_tells_what_is_written_and_what_is_not(bus: EmulatedBus, tmp_path: Path) -> None:
    path = write_file(tmp_path, dcf())
    findings = [finding for finding in examine(joints(bus, path)) if "drive.eds" in finding.detail]
    assert {finding.severity for finding in findings} == {Severity.GOOD}
    assert {finding.subject for finding in findings} == {"joint 2 (node 2)"}
    told = [finding.detail.removeprefix("drive.eds ") for finding in findings]
    assert told == [
        "describes all that the driver needs; vendor 0x3A1, product 0x402, revision 0x20005",
        "gives it, before each run: Gain (0x2001:00) = 250, Offset (0x2002:00) = 0xFFF6, object 6076 (0x6076:00) = 600",
        "has values that are not written (communication, the driver's own): 0x1016:01, 0x1017:00, 0x1600:01",
        "has values that are not written (write-only, cannot be read back): 0x2004:00",
        "has values that are not written (node ID or bit rate): 0x2005:00",
        "has values that are not written (a command, no setting): 0x6040:00, 0x607A:00",
        "has values that are not written (set by the driver): 0x6060:00, 0x6072:00, 0x607D:01",
    ]
    assert bus.drives[SECOND].dictionary.get(0x2001) == 100


def test_a_dry_run_shows_what_is_written(bus: EmulatedBus, tmp_path: Path) -> None:
    """Bytes worked out by hand: two bytes expedited; nine bytes announced by their number."""
    content = dcf()
    content["2003"]["ParameterValue"] = "elbow arm"
    asked = [
        replace(one, drive={**one.drive, "rated_torque_nm": 0.5}) for one in joints(bus, write_file(tmp_path, content))
    ]
    limits = DriveLimits(np.full(3, -1.0), np.full(3, 1.0), np.full(3, 2.0), np.full(3, 10.0))
    frames = list(plan_frames(asked, FrameRequest(ControlMode.POSITION, limits, 0.1, np.zeros((1, 3)))))
    sent = [
        (frame.wire, frame.meaning) for frame in frames if frame.wire.startswith("602#2") and "0x200" in frame.meaning
    ]
    assert sent == [
        ("602#2B012000FA000000", "joint 2 (node 2): Gain (0x2001:00) := 250"),
        ("602#2B022000F6FF0000", "joint 2 (node 2): Offset (0x2002:00) := 0xFFF6"),
        ("602#2103200009000000", "joint 2 (node 2): Label (0x2003:00) := elbow arm, 9 bytes in segments"),
    ]
    wires = [frame.wire for frame in frames]
    assert wires.index(sent[-1][0]) < wires.index("602#2F60600008000000"), "before it is commissioned"
