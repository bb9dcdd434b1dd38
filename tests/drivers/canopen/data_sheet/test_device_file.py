"""EDS and DCF files, right, wrong and damaged, before any bus is opened."""

import re
from pathlib import Path
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from emulated_data_sheet import GAIN, LABEL, OFFSET, Sections, sections, text_of, write_file
from tauscope_drivers import ControlMode
from tauscope_drivers.canopen import objects
from tauscope_drivers.canopen.configuration import (
    BusConfiguration,
    NodeConfiguration,
    check_blocks,
    read_configuration,
    require_targets,
)
from tauscope_drivers.canopen.data_sheet.device_file import DataSheetError, DeviceFile, read_device_file
from tauscope_drivers.canopen.data_sheet.needs import pdo_slots, present_objects
from tauscope_drivers.canopen.objects import describe_absent
from tauscope_drivers.canopen.process_data import MEASURED_WHERE_THERE, plan_pdos
from tauscope_drivers.drive_block import DriveJoint
from tauscope_drivers.errors import DriverError, DriverErrorKind
from tauscope_drivers.inspection import Severity

WHOLE = text_of(sections(VendorNumber="0x3A1", ProductNumber="", RevisionNumber="0x20005"))


def configured(path: object, **block: Any) -> BusConfiguration:
    bus = {"interface": "nobody opens it", "channel": "none", "node_id": 5, "counts_per_turn": 4096}
    return read_configuration([DriveJoint("elbow", {**bus, "eds": path, **block}, gear_ratio=50.0)])


def refusal(path: object, **block: Any) -> str:
    with pytest.raises(DriverError) as caught:
        configured(path, **block)
    assert caught.value.kind is DriverErrorKind.REFUSED
    message = str(caught.value)
    assert "\n" not in message
    assert message.startswith("joint elbow: drive.eds ")
    return message


def read(folder: Path, content: Sections, node_id: int = 5) -> DeviceFile:
    return read_device_file(Path(write_file(folder, content)), node_id)


def test_the_file_of_the_emulated_drive_is_what_the_driver_needs(tmp_path: Path) -> None:
    """Empty numbers, an empty default and lower case are as makers' tools leave them."""
    path = tmp_path / "drive.eds"
    path.write_text(WHOLE.replace("[607A]", "[607a]").replace("sub1]", "SUB1]").replace("=rw\n", "=RW\n"))
    (node,) = configured(str(path)).nodes
    assert node.device_file is not None
    file = node.device_file
    assert (file.vendor, file.product, file.revision, file.node_id) == (0x3A1, None, 0x20005, None)
    target = file.objects[0x607A, 0]
    assert (target.type_name, target.access, target.is_mappable) == ("INTEGER32", "rw", True)
    assert (0x607D, 3) not in file.objects


@pytest.mark.parametrize("access", [None, "ro"])
def test_a_drive_that_watches_no_heartbeat_is_guarded(tmp_path: Path, access: str | None) -> None:
    content = sections()
    if access is None:
        remove(content, "1016")
    else:
        content["1016sub1"]["AccessType"] = access
    block = {"interface": "virtual", "channel": "none", "node_id": 5, "counts_per_turn": 4096}
    block |= {"eds": write_file(tmp_path, content)}
    said = [finding.detail for finding in check_blocks([DriveJoint("elbow", block, gear_ratio=50.0)])]
    assert any("Consumer heartbeat time (0x1016:01): the host guards it by remote frames" in line for line in said)


def test_no_file_is_needed() -> None:
    assert configured(None).nodes[0].device_file is None


NEEDED = ("1000", "1016", "1016sub1", "6040", "6041", "6060", "6061", "6064", "6077", "607A", "6502")
OPTIONAL = ("1017", "6007", "603F", "605A", "605E", "606C", "6072", "607D", "60C2")


def remove(content: Sections, *sections: str) -> None:
    for name in [name for name in content if name.startswith(sections)]:
        del content[name]


@pytest.mark.parametrize("section", NEEDED)
def test_a_missing_object_is_named(tmp_path: Path, section: str) -> None:
    content = sections()
    remove(content, section, *(["100D"] if section.startswith("1016") else []))
    path = write_file(tmp_path, content)
    index = section[:4]
    message = refusal(path)
    assert repr(path) in message
    assert f"(0x{index}:0{'1' if index == '1016' else '0'}) is missing" in message


def test_all_flaws_are_named_at_once(tmp_path: Path) -> None:
    content = sections()
    remove(content, *NEEDED, "100C", "6076")
    content["6072"]["DataType"] = "0x20"
    message = refusal(write_file(tmp_path, content))
    assert message.count(" is missing") == len(NEEDED) + 1
    watchdog = (
        "heartbeat time (0x1016:01) is missing, and Guard time (0x100C:00) is missing: the drive would not notice"
    )
    assert watchdog in message
    assert "Motor rated torque (0x6076:00) is missing: give drive.rated_torque_nm" in message
    assert "Max torque (0x6072:00) is DOMAIN" in message


@pytest.mark.parametrize("section", OPTIONAL)
def test_an_optional_object_may_be_absent(tmp_path: Path, section: str) -> None:
    content = sections()
    remove(content, section)
    file = configured(write_file(tmp_path, content)).nodes[0].device_file
    assert file is not None
    lines = describe_absent(present_objects(file))
    assert len(lines) == 1
    assert f"(0x{section}:" in lines[0]


@pytest.mark.parametrize(("stated", "doubts"), [({}, 1), ({"rated_torque_nm": 0.4}, 0)])
def test_a_rated_torque_that_nobody_states_is_told(tmp_path: Path, stated: dict[str, float], doubts: int) -> None:
    content = sections()
    remove(content, "6076")
    bus = {"interface": "virtual", "channel": "none", "node_id": 5, "counts_per_turn": 4096}
    findings = check_blocks([DriveJoint("elbow", {**bus, "eds": write_file(tmp_path, content), **stated})])
    told = [one for one in findings if one.remedy == "state drive.rated_torque_nm"]
    assert len(told) == doubts
    assert all(one.severity is not Severity.FAILURE for one in findings)


def test_one_that_is_read_only_counts_as_absent(tmp_path: Path) -> None:
    content = sections()
    content["605A"]["AccessType"] = "ro"
    file = configured(write_file(tmp_path, content)).nodes[0].device_file
    assert file is not None
    assert objects.QUICK_STOP_OPTION not in present_objects(file)


def fix_mapping(content: Sections, mapping: str, *entries: int) -> None:
    """Make a PDO's mapping constant."""
    for name in [name for name in content if name.startswith(f"{mapping}sub")]:
        content[name]["AccessType"] = "const"
    content[f"{mapping}sub0"]["DefaultValue"] = str(len(entries))
    for subindex, entry in enumerate(entries, 1):
        content[f"{mapping}sub{subindex}"]["DefaultValue"] = hex(entry)


def test_pdos_of_fixed_mapping_are_used_as_they_are(tmp_path: Path) -> None:
    content = sections()
    fix_mapping(content, "1600", 0x60400010)
    fix_mapping(content, "1602", 0x60400010, 0x607A0020)
    fix_mapping(content, "1A01", 0x60410010, 0x60640020)
    file = configured(write_file(tmp_path, content)).nodes[0].device_file
    assert file is not None
    plan = plan_pdos(pdo_slots(file), objects.TARGET_POSITION, MEASURED_WHERE_THERE)
    assert plan.missing == ()
    assert [(pdo.number, pdo.is_fixed) for pdo in plan.received] == [(2, True)]
    assert [(pdo.number, pdo.is_fixed) for pdo in plan.sent] == [(0, False), (1, True)]
    assert plan.sent[0].layout.objects == (objects.TORQUE_ACTUAL, objects.VELOCITY_ACTUAL, objects.ERROR_CODE)


def test_fixed_mappings_without_a_needed_object_are_refused(tmp_path: Path) -> None:
    content = sections()
    for number in range(4):
        fix_mapping(content, f"160{number}", 0x60400010)
        fix_mapping(content, f"1A0{number}", 0x60410010, 0x60640020)
    message = refusal(write_file(tmp_path, content))
    for entry in ("Target position (0x607A:00)", "Torque actual value (0x6077:00)"):
        assert f"{entry} is in none of its PDOs, and their mapping cannot be written" in message


@pytest.mark.parametrize(
    ("section", "changes", "words"),
    [
        ("607A", {"PDOMapping": "0"}, "Target position (0x607A:00) cannot be mapped to a PDO"),
        ("6041", {"PDOMapping": ""}, "Statusword (0x6041:00) cannot be mapped"),
        ("6064", {"DataType": "0x0003"}, "Position actual value (0x6064:00) is INTEGER16, not INTEGER32"),
        ("6077", {"DataType": "0x0006"}, "Torque actual value (0x6077:00) is UNSIGNED16, not INTEGER16"),
        ("6072", {"DataType": "0x20"}, "Max torque (0x6072:00) is DOMAIN, not UNSIGNED16"),
        ("60C2sub1", {"DataType": "0x0006"}, "Interpolation time period, value (0x60C2:01) is UNSIGNED16"),
        ("6060", {"AccessType": "ro"}, "Modes of operation (0x6060:00) cannot be written (AccessType 'ro')"),
        ("6040", {"DataType": "word"}, "DataType in [6040] is 'word', which is no number"),
        ("6064", {"ParameterName": ""}, "is no whole EDS or DCF file"),
        ("DeviceInfo", {"VendorNumber": "many"}, "VendorNumber in [DeviceInfo] is 'many'"),
        ("DeviceComissioning", {"NodeID": "6"}, "is made for node 6; correct drive.node_id"),
        (GAIN, {"ParameterValue": "70000"}, "ParameterValue '70000' of Gain (0x2001:00) is no UNSIGNED16"),
        (GAIN, {"ParameterValue": "$NODEID*2"}, "ParameterValue '$NODEID*2' of Gain (0x2001:00)"),
        ("6072", {"ParameterValue": "-1"}, "ParameterValue '-1' of object 6072 (0x6072:00) is no UNSIGNED16"),
        (LABEL, {"ParameterValue": "Arm Ω"}, "of Label (0x2003:00) is no VISIBLE_STRING"),
        ("2001Value", {"NrOfEntries": "1", "1": "4"}, "[2001Value] belongs to no array with CompactSubObj"),
    ],
)
def test_what_the_driver_cannot_use_is_named(tmp_path: Path, section: str, changes: dict[str, str], words: str) -> None:
    content = sections()
    content[section] = {**content.get(section, {}), **changes}
    assert words in refusal(write_file(tmp_path, content))


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (b"", "Device type (0x1000:00) is missing"),
        (b"name: arm\n", "line 1 stands before any [section]"),
        (b"[6040]\nDataType\n", "line 2 is neither [section] nor keyword=value"),
        (b"[6040]\n[6040]\n", "line 2 begins a section that was there already"),
        (b"[6040]\n[6041]\nDataType=6\nDATATYPE=6\n", "line 4 states 'datatype' again"),
        (b"[607a]\n[607A]\n", "[607A] stands twice"),
        (b"[1016sub1]\nParameterName=x\nDataType=7\nAccessType=rw\n", "0x1016 was not found"),
        (
            b"[1016]\nObjectType=8\nParameterName=x\nCompactSubObj=999\n",
            "CompactSubObj in [1016] is 999; give 1 to 254",
        ),
        (b"\x89PNG\r\n\x1a\n\0\0\xff", "line 1 stands before any [section]"),
    ],
)
def test_a_file_that_is_none_is_told_with_the_line(tmp_path: Path, content: bytes, words: str) -> None:
    path = tmp_path / "file.eds"
    path.write_bytes(content)
    assert words in refusal(str(path))


def test_a_file_that_cannot_be_read_is_told(tmp_path: Path) -> None:
    assert "there is no such file" in refusal(str(tmp_path / "none.eds"))
    assert "there is no such file" in refusal(str(tmp_path)), "a folder, and no device that never ends"
    assert "there is no such file" in refusal("/dev/zero")
    assert "give the path" in refusal(3)
    (tmp_path / "large.eds").write_bytes(bytes(8 * 1024 * 1024 + 1))
    assert "is larger than 8 MiB" in refusal(str(tmp_path / "large.eds"))


def test_a_drive_without_what_nobody_reads_is_taken(tmp_path: Path) -> None:
    """Its rated torque where the robot file states it, the cycle, and targets of torque until they are asked for."""
    content = sections()
    for name in ("6076", "60C2", "60C2sub0", "60C2sub1", "60C2sub2"):
        del content[name]
    content["6071"]["PDOMapping"] = "0"
    configuration = configured(write_file(tmp_path, content), rated_torque_nm=0.4)
    with pytest.raises(DriverError, match=re.escape("Target torque (0x6071:00) cannot be mapped")):
        require_targets(configuration, ControlMode.TORQUE)
    del content["6071"]
    configuration = configured(write_file(tmp_path, content), rated_torque_nm=0.4)
    require_targets(configuration, ControlMode.POSITION)
    with pytest.raises(DriverError, match=re.escape("drive.eds: Target torque (0x6071:00) is missing")) as caught:
        require_targets(configuration, ControlMode.TORQUE)
    assert str(caught.value).startswith("joint 1 (node 5): ")


def test_compact_arrays_are_written_out(tmp_path: Path) -> None:
    """Names and values of single subindices stand in sections of their own; the library drops the values."""
    content = sections()
    del content["1016sub0"], content["1016sub1"]
    common = {"ObjectType": "0x8", "AccessType": "rw", "CompactSubObj": "3"}
    content["1016"] = {"ParameterName": "Heartbeats", "DataType": "0x0007", **common}
    content["2010"] = {"ParameterName": "Filter", "DataType": "0x0003", **common}
    content["2010Name"] = {"NrOfEntries": "1", "2": "Second filter"}
    content["2010Value"] = {"NrOfEntries": "2", "2": "-7", "3": "0xFFF0"}
    (node,) = configured(write_file(tmp_path, content)).nodes
    assert node.device_file is not None
    filters = [node.device_file.objects[0x2010, subindex] for subindex in (1, 2, 3)]
    assert [one.name for one in filters] == ["Filter 1", "Second filter", "Filter 3"]
    assert [one.value for one in filters] == [None, bytes([0xF9, 0xFF]), bytes([0xF0, 0xFF])]
    content["2010Value"]["4"] = "1"
    assert "[2010Value] has a value 4 of 3" in refusal(write_file(tmp_path, content))


def test_values_are_those_of_their_type_and_node(tmp_path: Path) -> None:
    content = sections()
    content[GAIN]["ParameterValue"] = "$NODEID + 0x180"
    content[OFFSET]["ParameterValue"] = "0xFFFE"
    content[LABEL]["ParameterValue"] = "Arm 1"
    content["2005"] = {"ParameterName": "Ratio", "DataType": "0x8", "AccessType": "rw", "ParameterValue": "-0.5"}
    file = read(tmp_path, content)
    values = [file.objects[index, 0].value for index in (0x2001, 0x2002, 0x2003, 0x2005)]
    assert values == [bytes.fromhex("8501"), bytes.fromhex("FEFF"), b"Arm 1", bytes.fromhex("000000BF")]


@pytest.mark.parametrize(
    ("text", "value"),
    [
        *[("$NODEID", 5), ("$NODEID+0x180", 0x185), ("0x180+$NodeID", 0x185), ("0x180 + $NODEID", 0x185), ("19", 19)],
        *[("0X1f", 31), ("1F", 31), ("00ff", 255), ("017", 15), ("0019", 19), ("0", 0), ("00000000", 0)],
    ],
)
def test_numbers_are_read_as_makers_write_them(tmp_path: Path, text: str, value: int) -> None:
    content = sections()
    content[GAIN] |= {"ParameterValue": text, "DefaultValue": text}
    described = read(tmp_path, content).objects[0x2001, 0]
    assert (described.value, described.default) == (value.to_bytes(2, "little"), value)


@pytest.mark.parametrize(
    "text", ["0x", "12 apples", "$NODE", "1.5", "G0", "--3", pytest.param("9" * 5000, id="5000 digits")]
)
def test_a_value_that_is_no_number_is_refused(tmp_path: Path, text: str) -> None:
    content = sections()
    content[GAIN]["ParameterValue"] = text
    assert "ParameterValue" in refusal(write_file(tmp_path, content))


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "latin-1", "utf-16"])
@pytest.mark.parametrize("end", ["\n", "\r\n", "\r"])
def test_encodings_and_line_ends_of_any_system_are_read(tmp_path: Path, encoding: str, end: str) -> None:
    content = sections()
    content["6077"]["ParameterName"] = "Drehmoment [µNm] für Möller"
    path = tmp_path / "drive.eds"
    path.write_bytes(text_of(content).replace("\n", end).encode(encoding))
    (node,) = configured(str(path)).nodes
    assert node.device_file is not None
    assert node.device_file.objects[0x6077, 0].name == "Drehmoment [µNm] für Möller"


@pytest.mark.parametrize("section", ["DeviceComissioning", "DeviceCommissioning"])
def test_a_dcf_of_another_node_is_refused_however_its_section_is_spelt(tmp_path: Path, section: str) -> None:
    content = sections() | {section: {"NodeID": "0x06"}}
    assert "is made for node 6" in refusal(write_file(tmp_path, content))


def test_leading_zeros_and_digits_without_a_prefix_are_numbers(tmp_path: Path) -> None:
    content = sections(VendorNumber="000003A1", RevisionNumber="00020005")
    for keys in content.values():
        if "DataType" in keys:
            keys["DataType"] = f"{int(keys['DataType'], 16):04d}"
    (node,) = configured(write_file(tmp_path, content)).nodes
    assert node.device_file is not None
    assert node.device_file.vendor == 0x3A1


def test_the_identity_is_that_of_the_device_or_of_its_object(tmp_path: Path) -> None:
    content = sections(ProductNumber="7")
    content["1018sub1"]["DefaultValue"] = "0x3A1"
    file = read(tmp_path, content)
    assert (file.vendor, file.product, file.revision) == (0x3A1, 7, None)


def is_told(path: Path) -> None:
    """A file is taken, or refused in one line; nothing else is raised."""
    told: str | None = None
    try:
        (node,) = configured(str(path)).nodes
        assert isinstance(node, NodeConfiguration)
    except DriverError as error:
        told = str(error)
    assert told is None or (told.startswith("joint elbow: drive.eds ") and len(told.splitlines()) == 1)


SCRAPS = ["", "$NODEID", "0x", "-1", "1e9", "0x1C", "99999999999", "ro", "\0", "é\u2028", "%(x)s", "9" * 5000]


def damages(line: str, other: str, scrap: str) -> list[list[str]]:
    """What may stand in place of a line."""
    key, _, value = line.partition("=")
    return [
        *([], [line, line], [other], [line.swapcase()], [line[: len(line) // 2]], [f" {line}{scrap}"]),
        *([f"{key}={scrap}"], [f"{scrap}={value}"], [f"ParameterValue={scrap}", line]),
        *([f"CompactSubObj={scrap}", line], ["[1000Value]", f"1={scrap}"], ["[DeviceComissioning]", f"NodeID={scrap}"]),
    ]


@given(data=st.data())
@settings(suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_no_damage_to_a_file_crashes_the_driver(tmp_path: Path, data: st.DataObject) -> None:
    lines = WHOLE.splitlines()
    for _ in range(data.draw(st.integers(1, 4))):
        at, other = (data.draw(st.integers(0, len(lines) - 1)) for _ in range(2))
        scrap = data.draw(st.sampled_from(SCRAPS))
        lines[at : at + 1] = data.draw(st.sampled_from(damages(lines[at], lines[other], scrap)))
    path = tmp_path / "damaged.eds"
    path.write_text("\n".join(lines), encoding="utf-8")
    is_told(path)


@given(content=st.binary(max_size=200) | st.text(max_size=200).map(str.encode))
@settings(suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_no_other_file_crashes_the_driver(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "any.eds"
    path.write_bytes(b"[607A]\n" + content)
    is_told(path)


def test_a_sheet_with_a_mistake_is_no_sheet(tmp_path: Path) -> None:
    (tmp_path / "x.dcf").write_text("[")
    with pytest.raises(DataSheetError, match="line 1"):
        read_device_file(tmp_path / "x.dcf", 1)
