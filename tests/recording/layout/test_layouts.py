"""Files of other tools: any names, order, units and separators give the same recording, by preset, mapping or guess."""

import importlib.util
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from recording.layout_files import JOINTS, QD, TAU, TIME, Q, guess_of, read, write
from recording.recording_files import message_of, rows_of
from tauscope.errors import RecordingError, RobotFileError
from tauscope.recording import Reading, read_recording
from tauscope.recording.layout.guess import guess_layout
from tauscope.robot import RecordingLayout, layout_from_dict, read_layout

STYLES = {
    "rtde": ("timestamp", "actual_q_{0}", "actual_qd_{0}", "actual_current_as_torque_{0}"),
    "franka": ("time", "q[{0}]", "dq[{0}]", "tau_J[{0}]"),
    "franka state": ("state.time", "state.q_{0}", "state.dq_{0}", "state.tau_J_{0}"),
    "plotjuggler": (
        "__time",
        "/joint_states/{name}/position",
        "/joint_states/{name}/velocity",
        "/joint_states/{name}/effort",
    ),
    "mujoco": ("time", "qpos_{0}", "qvel_{0}", "qfrc_actuator_{0}"),
    "isaac": ("sim_time", "joint_pos_{0}", "joint_vel_{0}", "applied_torque_{0}"),
    "isaac by name": ("time", "joint_pos[{name}]", "joint_vel[{name}]", "joint_effort[{name}]"),
    "numbers from 1": ("Time", "Position{1}", "Velocity{1}", "Torque{1}"),
    "numbered joints": ("t", "joint{1}_position", "joint{1}_velocity", "joint{1}_torque"),
    "kuka": ("time", "measured_joint_position_{0}", "measured_joint_velocity_{0}", "measured_torque_{0}"),
    "dynamixel": ("timestamp", "Present_Position_{1}", "Present_Velocity_{1}", "Present_Torque_{1}"),
    "names in front": ("time", "{name}_position", "{name}_velocity", "{name}_effort"),
    "zero based": ("t", "q{0}", "qd{0}", "tau{0}"),
    "short words": ("time", "pos_{0}", "vel_{0}", "eff_{0}"),
    "krl trace": ("time", "AXIS_ACT_A{1}", "VEL_AXIS_ACT_A{1}", "TORQUE_AXIS_ACT_A{1}"),
    "german": ("Zeit", "Winkel_Achse{1}", "qd_Achse{1}", "Drehmoment_Achse{1}"),
}
SEPARATORS = [(",", "."), (";", "."), (";", ","), ("\t", ","), (" ", "."), ("|", "."), (" ", ",")]


def columns_of(style: Sequence[str]) -> list[str]:
    time, *templates = style
    names = [
        template.replace("{0}", str(k)).replace("{1}", str(k + 1)).replace("{name}", name)
        for template in templates
        for k, name in enumerate(JOINTS)
    ]
    return [time, *names]


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    style=st.sampled_from(sorted(STYLES)),
    order=st.permutations(range(10)),
    separators=st.sampled_from(SEPARATORS),
    knows_robot=st.booleans(),
    extra=st.booleans(),
    time=st.sampled_from([("s", 1.0), ("ms", 1e3), ("us", 1e6)]),
    angle=st.sampled_from([("rad", 1.0), ("deg", 180.0 / np.pi)]),
)
def test_the_mapping_that_a_refusal_prints_works_when_pasted(
    tmp_path: Path,
    style: str,
    order: list[int],
    separators: tuple[str, str],
    knows_robot: bool,
    extra: bool,
    time: tuple[str, float],
    angle: tuple[str, float],
) -> None:
    header = columns_of(STYLES[style])
    rows = np.column_stack([time[1] * TIME, angle[1] * Q, angle[1] * QD, TAU])
    header, rows = [header[index] for index in order], rows[:, order]
    if extra:
        header, rows = [*header, "actual_TCP_pose_0", "safety_mode"], np.column_stack([rows, TIME, TIME])
    path = write(tmp_path / "file.csv", header, rows, *separators)
    joints = JOINTS if knows_robot or "{name}" in STYLES[style][1] else None
    layout = guess_of(message_of(lambda: read_recording(path, joint_names=joints)))
    recording = read(path, replace(layout, units={"t": time[0], "q": angle[0]}), joints)
    names = ("t", *(f"{group}{k}" for group in ("q", "tau", "qd") for k in (1, 2, 3)))
    assert recording.table.names == names
    start = 0.0 if time[0] == "s" else TIME[0]
    assert np.allclose(rows_of(recording), np.column_stack([TIME - start, Q, TAU, QD]), atol=1e-9)


PRESETS = {
    "rtde": ("rtde",),
    "libfranka": ("franka", "franka state"),
    "plotjuggler": ("plotjuggler",),
    "mujoco": ("mujoco",),
    "isaac": ("isaac", "isaac by name"),
}


@pytest.mark.parametrize(("preset", "style"), [(preset, style) for preset in PRESETS for style in PRESETS[preset]])
def test_a_preset_reads_its_tool(tmp_path: Path, preset: str, style: str) -> None:
    path = write(tmp_path / "file.csv", columns_of(STYLES[style]), np.column_stack([TIME, Q, QD, TAU]))
    recording = read(path, read_layout(preset), JOINTS)
    assert np.array_equal(rows_of(recording), np.column_stack([TIME, Q, TAU, QD]))
    assert recording.notes == ()


def test_names_go_before_places(tmp_path: Path) -> None:
    path = write(tmp_path / "file.csv", columns_of(STYLES["plotjuggler"]), np.column_stack([TIME, Q, QD, TAU]))
    turned = (JOINTS[2], JOINTS[0], JOINTS[1])
    samples = read(path, read_layout("plotjuggler"), turned).samples()
    assert np.array_equal(samples.position, Q[:, [2, 0, 1]])
    assert np.array_equal(samples.effort, TAU[:, [2, 0, 1]])


def test_joints_of_another_robot_are_listed(tmp_path: Path) -> None:
    path = write(tmp_path / "file.csv", columns_of(STYLES["plotjuggler"]), np.column_stack([TIME, Q, QD, TAU]))
    message = message_of(lambda: read(path, read_layout("plotjuggler"), ("a", "b", "c")))
    assert "names 3 joints (shoulder_pan, elbow, wrist_1), the robot has 3 (a, b, c)" in message


def test_joints_that_a_recording_lacks_are_to_be_locked(tmp_path: Path) -> None:
    path = write(tmp_path / "file.csv", columns_of(STYLES["plotjuggler"]), np.column_stack([TIME, Q, QD, TAU]))
    message = message_of(lambda: read(path, read_layout("plotjuggler"), (*JOINTS, "finger")))
    assert "finger is missing; record them too, or state in a robot file locked: {finger: 0}" in message


def test_a_preset_of_another_tool_shows_the_mapping_that_would_do(tmp_path: Path) -> None:
    path = write(tmp_path / "file.csv", columns_of(STYLES["franka"]), np.column_stack([TIME, Q, QD, TAU]))
    message = message_of(lambda: read(path, read_layout("mujoco"), JOINTS))
    assert "no column holds the position, which mujoco calls qpos" in message
    assert np.array_equal(rows_of(read(path, guess_of(message), JOINTS)), np.column_stack([TIME, Q, TAU, QD]))


def test_measured_torque_goes_before_current_and_current_before_a_command(tmp_path: Path) -> None:
    header = ["timestamp", "actual_q_0", "target_moment_0", "actual_current_0"]
    path = write(tmp_path / "file.csv", header, np.column_stack([TIME, Q]))
    reading = Reading(columns="rtde", joint_names=("j",))
    current = read_recording(path, joint_names=["j"], reading=reading)
    assert current.effort_kind == "i"
    commanded = read_recording(path, joint_names=["j"], reading=replace(reading, prefers_torque=True))
    assert np.array_equal(commanded.samples().effort, Q[:, 1:2])
    assert [note.code for note in commanded.notes] == ["commanded-effort"]


def test_a_file_without_names_is_mapped_by_numbers(tmp_path: Path) -> None:
    path = write(tmp_path / "file.txt", None, np.column_stack([TIME, Q, QD, TAU]), " ")
    message = message_of(lambda: read_recording(path, joint_names=JOINTS))
    assert "the first row holds numbers where the column names are expected" in message
    assert "{t: 1, q: [2, 3, 4], qd: [5, 6, 7], tau: [8, 9, 10]}" in message
    assert np.array_equal(rows_of(read(path, guess_of(message), JOINTS)), np.column_stack([TIME, Q, TAU, QD]))
    assert "no column holds the time, which rtde calls timestamp" in message_of(
        lambda: read(path, read_layout("rtde"), JOINTS)
    )


def test_rows_are_counted_where_a_rate_is_stated(tmp_path: Path) -> None:
    path = write(tmp_path / "file.csv", ["q1", "q2", "q3", "tau1", "tau2", "tau3"], np.column_stack([Q, TAU]))
    recording = read_recording(path, reading=Reading({"t": "index"}, 50.0))
    assert np.allclose(recording.samples().time, np.arange(40) / 50.0)
    assert np.array_equal(recording.samples().position, Q)


def test_without_a_time_the_rate_makes_the_mapping_whole(tmp_path: Path) -> None:
    header = [f"{name}[{k}]" for name in ("qpos", "effort", "action") for k in range(3)]
    path = write(tmp_path / "file.csv", header, np.column_stack([Q, TAU, Q]))
    message = message_of(lambda: read_recording(path, joint_names=JOINTS))
    assert "without t, and with --units t=index --rate HZ" in message
    reading = Reading({"t": "index"}, 50.0, joint_names=JOINTS)
    layout = guess_of(message_of(lambda: read_recording(path, joint_names=JOINTS, reading=reading)))
    samples = read_recording(path, joint_names=JOINTS, reading=replace(reading, columns=layout.columns)).samples()
    assert np.allclose(samples.time, np.arange(40) / 50.0)
    assert np.array_equal(samples.position, Q)
    assert np.array_equal(samples.effort, TAU)


def test_a_preset_of_another_arm_is_refused(tmp_path: Path) -> None:
    path = write(tmp_path / "file.csv", columns_of(STYLES["rtde"]), np.column_stack([TIME, Q, QD, TAU]))
    message = ""
    for joints in (("a", "b", "c", "d"), ("a", "b")):
        message = message_of(lambda joints=joints: read(path, read_layout("rtde"), joints))
        assert f"the columns are of 3 joints, the robot has {len(joints)}; " in message
    assert np.array_equal(read(path, guess_of(message), ("a", "b")).samples().position, Q[:, :2])


def test_a_mapping_may_name_single_columns(tmp_path: Path) -> None:
    header = ["clock", "q1", "elbow", "q3", "tau1", "tau2", "tau3", "x"]
    path = write(tmp_path / "file.csv", header, np.column_stack([TIME, Q, TAU, TAU[:, 0]]))
    recording = read(path, layout_from_dict({"t": "clock", "q2": "elbow", "tau3": "x"}))
    assert np.array_equal(recording.samples().position, Q)
    assert np.array_equal(recording.samples().effort, TAU[:, [0, 1, 0]])


def test_a_mapping_may_name_a_part_of_the_columns(tmp_path: Path) -> None:
    header = ["clock", "q1", "q2", "q3", "tau1", "tau2", "tau3"]
    path = write(tmp_path / "file.csv", header, np.column_stack([TIME, Q, TAU]))
    recording = read(path, layout_from_dict({"t": "clock", "tau2": "tau3", "tau3": "tau2", "tau1": "tau1"}))
    assert np.array_equal(recording.samples().effort, TAU[:, [0, 2, 1]])


WRONG = {
    "no such column": ({"t": "tim", "q": "q{1}"}, "columns: t: no column is named tim; did you mean time?"),
    "twice": ({"t": "time", "q": ["q1", "q1", "q3"], "tau": "e{1}"}, "column q1 is mapped to q1 and q2; keep one"),
    "more joints than the robot": ({"t": "time", "q": "q{1}"}, "numbers 3 joints, the robot has 2; list the columns"),
    "no template": ({"t": "time", "q": "q"}, "columns: q: no column is named q"),
}


@pytest.mark.parametrize("name", WRONG)
def test_a_wrong_mapping_is_refused(tmp_path: Path, name: str) -> None:
    columns, words = WRONG[name]
    header = ["time", "q1", "q2", "q3", "e1", "e2", "e3"]
    path = write(tmp_path / "file.csv", header, np.column_stack([TIME, Q, TAU]))
    joints = ("a", "b") if "robot" in name else None
    assert words in message_of(lambda: read(path, layout_from_dict(columns), joints))


def test_layout_files(tmp_path: Path) -> None:
    layout = RecordingLayout(columns={"t": "time", "q": [2, 3]}, units={"q": "deg"}, decimal=",")
    block = "columns: {t: time, q: [2, 3]}\nunits: {q: deg}\ndecimal: ','\n"
    inside = "recording:\n" + "".join(f"  {line}\n" for line in block.splitlines())
    for text in (block, inside):
        (tmp_path / "map.yaml").write_text(text, encoding="utf-8")
        assert read_layout(str(tmp_path / "map.yaml")) == layout
    assert read_layout("{t: time}").columns == {"t": "time"}
    assert read_layout("rtde").columns == "rtde"
    with pytest.raises(RobotFileError, match=r"neither a preset \(rtde, .*\) nor a file"):
        read_layout("rtd")


def test_list_columns_and_episodes_of_lerobot(tmp_path: Path) -> None:
    arrow = pytest.importorskip("pyarrow")
    parquet = pytest.importorskip("pyarrow.parquet")
    episode = np.repeat([0, 1], 20)
    table = arrow.table(
        {
            "observation.state": np.degrees(Q).tolist(),
            "action": np.degrees(Q).tolist(),
            "observation.effort": TAU.tolist(),
            "timestamp": np.tile(TIME[:20] - 100.0, 2),
            "episode_index": episode,
        }
    )
    folder = tmp_path / "data" / "chunk-000"
    folder.mkdir(parents=True)
    path = folder / "file-000.parquet"
    parquet.write_table(table, path)
    recording = read(path, read_layout("lerobot"), JOINTS)
    samples = recording.samples()
    assert np.allclose(samples.position, Q)
    assert samples.reference is not None
    assert np.allclose(np.diff(samples.time)[[0, 19, 20]], [0.01, 60.0, 0.01])
    assert [note.code for note in recording.notes] == ["episodes"]
    (tmp_path / "meta").mkdir()
    names = ["wrist_1.pos", "shoulder_pan.pos", "elbow.pos"]
    feature = '{"names": ' + str(names).replace("'", '"') + "}"
    text = f'{{"features": {{"observation.state": {feature}, "observation.effort": {feature}}}}}'
    (tmp_path / "meta" / "info.json").write_text(text, encoding="utf-8")
    by_name = read(path, read_layout("lerobot"), JOINTS).samples()
    assert np.allclose(by_name.position, Q[:, [1, 2, 0]])
    assert "(wrist_1, shoulder_pan, elbow), the robot has 3 (a, b, c)" in message_of(
        lambda: read(path, read_layout("lerobot"), ("a", "b", "c"))
    )


def test_a_list_that_is_short_in_some_row_is_refused(tmp_path: Path) -> None:
    arrow = pytest.importorskip("pyarrow")
    parquet = pytest.importorskip("pyarrow.parquet")
    lists = Q.tolist()
    lists[7] = lists[7][:2]
    parquet.write_table(arrow.table({"t": TIME, "q": lists, "tau": TAU.tolist()}), tmp_path / "file.parquet")
    with pytest.raises(RecordingError, match="Parquet"):
        read(tmp_path / "file.parquet", layout_from_dict({"t": "t", "q": "q", "tau": "tau"}))


def test_every_preset_is_offered() -> None:
    from tauscope.recording.layout.presets import PRESET_OF
    from tauscope.robot.recording_layout import PRESETS as NAMES

    assert tuple(PRESET_OF) == NAMES
    assert SimpleNamespace(**dict.fromkeys(NAMES))


def test_what_a_preset_does_not_find_is_named(tmp_path: Path) -> None:
    header = ["timestamp", *(f"observation.state[{k}]" for k in range(3))]
    path = write(tmp_path / "file.csv", header, np.column_stack([TIME, Q]))
    message = message_of(lambda: read(path, read_layout("lerobot"), JOINTS))
    assert "no column holds the effort, which lerobot calls observation_effort or observation_torque or" in message


def test_lists_in_the_cells_of_a_csv(tmp_path: Path) -> None:
    lines = ["timestamp,observation.state,observation.effort"]
    rows = zip(TIME.tolist(), np.degrees(Q).tolist(), TAU.tolist(), strict=True)
    lines += [f'{t},"{q}",[{" ".join(map(repr, tau))}]' for t, q, tau in rows]
    path = tmp_path / "file.csv"
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    samples = read(path, read_layout("lerobot"), JOINTS).samples()
    assert np.allclose(samples.position, Q)
    assert np.array_equal(samples.effort, TAU)


@pytest.mark.parametrize(
    ("mark", "unit", "factor"), [("mNm", "mNm", 1e-3), ("percent", "drive", 1.0), ("%", "drive", 1.0)]
)
def test_units_of_torque_in_names(tmp_path: Path, mark: str, unit: str, factor: float) -> None:
    header = ["t", "q1", "q2", "q3", *(f"torque{k} [{mark}]" for k in (1, 2, 3))]
    path = write(tmp_path / "file.csv", header, np.column_stack([TIME, Q, TAU]))
    layout = guess_of(message_of(lambda: read_recording(path)))
    assert layout.units == {"tau": unit}
    recording = read(path, layout)
    assert np.allclose(recording.samples().effort, factor * TAU)
    assert recording.effort_kind == ("i" if unit == "drive" else "tau")


def test_a_delimiter_may_end_the_rows_or_the_header_alone(tmp_path: Path) -> None:
    header = ["t", *(f"{group}{k}" for group in ("q", "tau") for k in (1, 2, 3))]
    path = write(tmp_path / "file.csv", header, np.column_stack([TIME, Q, TAU]))
    first, rest = path.read_text(encoding="utf-8").split("\n", 1)
    for text in (f"{first}\n{rest.replace(chr(10), f',{chr(10)}')}", f"{first},\n{rest}"):
        path.write_text(text, encoding="utf-8")
        assert np.array_equal(rows_of(read_recording(path)), np.column_stack([TIME, Q, TAU]))


def test_structures_and_arrays_with_a_column_a_sample(tmp_path: Path) -> None:
    np.savez(tmp_path / "log.npz", time=TIME, qpos=Q.T, qfrc_actuator=TAU.T)
    samples = [read(tmp_path / "log.npz", read_layout("mujoco"), JOINTS).samples()]
    if importlib.util.find_spec("pyarrow"):
        from pyarrow import parquet, table

        columns = {
            name: [dict(zip(JOINTS, row, strict=True)) for row in rows] for name, rows in (("q", Q), ("tau", TAU))
        }
        parquet.write_table(table({"t": TIME, **columns}), tmp_path / "log.parquet")
        guess = guess_of(message_of(lambda: read_recording(tmp_path / "log.parquet", joint_names=JOINTS)))
        samples.append(read(tmp_path / "log.parquet", guess, JOINTS).samples())
    for each in samples:
        assert np.array_equal(each.position, Q)
        assert np.array_equal(each.effort, TAU)


def test_columns_that_only_their_unit_tells(tmp_path: Path) -> None:
    header = ["t [s]", *(f"A{k} [deg]" for k in (1, 2, 3)), *(f"M{k} [Nm]" for k in (1, 2, 3))]
    header += [*(f"error {k} [deg]" for k in (1, 2, 3)), *(f"F{k} [N]" for k in (1, 2, 3))]
    path = write(tmp_path / "file.csv", header, np.column_stack([TIME, np.degrees(Q), TAU, QD, QD]))
    layout = guess_of(message_of(lambda: read_recording(path, joint_names=JOINTS)))
    assert layout.columns == {"t": "t [s]", "q": "A{1} [deg]", "tau": "M{1} [Nm]"}
    samples = read(path, layout, JOINTS).samples()
    assert np.allclose(samples.position, Q)
    assert np.array_equal(samples.effort, TAU)


def test_words_go_before_units() -> None:
    header = [
        "t",
        *(f"q{k}" for k in (1, 2)),
        *(f"X{k} [Nm]" for k in (1, 2)),
        *(f"predicted torque {k}" for k in (1, 2)),
    ]
    layout = guess_layout(header, Reading(joint_names=("a", "b")))
    assert layout is not None
    assert layout == {"t": "t", "q": "q{1}", "tau": "predicted torque {1}"}


@pytest.mark.parametrize("has_joints", [True, False])
def test_names_on_two_lines_or_repeated(tmp_path: Path, has_joints: bool) -> None:
    joints = ["", *(f"Joint {k}" for k in (1, 2, 3) for _ in range(2))]
    names = ["Time", *["Position", "Torque"] * 3]
    head = [",".join(joints)] if has_joints else []
    values = np.column_stack([TIME, np.stack([Q, TAU], axis=2).reshape(len(TIME), 6)])
    lines = [*head, ",".join(names), *(",".join(map(repr, row)) for row in values.tolist())]
    path = tmp_path / "file.csv"
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    layout = guess_of(message_of(lambda: read_recording(path, joint_names=JOINTS)))
    by_place = {"t": "Time", "q": [2, 4, 6], "tau": [3, 5, 7]}
    by_name = {"t": "Time", "q": "Joint {1} Position", "tau": "Joint {1} Torque"}
    assert layout.columns == (by_name if has_joints else by_place)
    assert np.array_equal(rows_of(read(path, layout, JOINTS)), np.column_stack([TIME, Q, TAU]))


def test_units_in_names(tmp_path: Path) -> None:
    header = [
        "Time [ms]",
        *(f"J{k} Winkel position [°]" for k in (1, 2, 3)),
        *(f"J{k} current (mA)" for k in (1, 2, 3)),
    ]
    path = write(tmp_path / "file.csv", header, np.column_stack([1e3 * TIME, np.degrees(Q), 1e3 * TAU]))
    layout = guess_of(message_of(lambda: read_recording(path, joint_names=JOINTS)))
    assert layout.units == {"t": "ms", "q": "deg", "tau": "mA"}
    samples = read(path, layout, JOINTS).samples()
    assert np.allclose(samples.position, Q)
    assert np.allclose(samples.effort, TAU)


def test_seconds_and_nanoseconds_in_two_columns(tmp_path: Path) -> None:
    stamp = 1_700_000_000_999_000_000 + 10_000_000 * np.arange(40)
    seconds, nanoseconds = stamp // 10**9, stamp % 10**9
    rows = [
        [str(s), str(n), "base", *JOINTS, *map(repr, q), *map(repr, tau)]
        for s, n, q, tau in zip(seconds, nanoseconds, Q.tolist(), TAU.tolist(), strict=True)
    ]
    text = "\n".join(",".join(row) for row in rows)
    (tmp_path / "echo.csv").write_text(text + "\n", encoding="utf-8")
    np.savez(tmp_path / "log.npz", sec=seconds, nsec=nanoseconds, q=Q, tau=TAU)
    by_number = layout_from_dict({"t": [1, 2], "q": [7, 8, 9], "tau": [10, 11, 12]})
    by_name = layout_from_dict({"t": ["sec", "nsec"], "q": "q", "tau": "tau"})
    guess = guess_of(message_of(lambda: read_recording(tmp_path / "log.npz", joint_names=JOINTS)))
    assert guess.columns == {"t": ["sec", "nsec"], "q": "q[{0}]", "tau": "tau[{0}]"}
    recordings = [read(tmp_path / "echo.csv", by_number), read(tmp_path / "log.npz", by_name)]
    if importlib.util.find_spec("pyarrow"):
        from pyarrow import parquet, table

        columns = {"sec": seconds, "nsec": nanoseconds, "q": Q.tolist(), "tau": TAU.tolist()}
        parquet.write_table(table(columns), tmp_path / "log.parquet")
        recordings.append(read(tmp_path / "log.parquet", by_name))
    for recording in recordings:
        samples = recording.samples()
        assert np.allclose(np.diff(samples.time), 0.01, atol=1e-9)
        assert np.array_equal(samples.position, Q)
        assert np.array_equal(samples.effort, TAU)


def test_the_echo_of_a_topic_is_mapped_by_place(tmp_path: Path) -> None:
    rows = [
        [str(1_700_000_000 + k // 10), str(k % 10 * 10**8), "", *JOINTS, *map(repr, [*q, *qd, *tau])]
        for k, (q, qd, tau) in enumerate(zip(Q.tolist(), QD.tolist(), TAU.tolist(), strict=True))
    ]
    path = tmp_path / "echo.csv"
    path.write_text("\n".join(",".join(row) for row in rows) + "\n", encoding="utf-8")
    guess = guess_of(message_of(lambda: read_recording(path, joint_names=JOINTS)))
    expected = np.column_stack([np.arange(40) / 10, Q, TAU, QD])
    assert np.allclose(rows_of(read(path, guess, JOINTS)), expected, atol=1e-9)


def test_a_row_of_units_is_obeyed_and_options_go_before_it(tmp_path: Path) -> None:
    header = ["t", *(f"{group}{k}" for group in ("q", "tau", "qd") for k in (1, 2, 3))]
    rows = np.column_stack([1e3 * TIME, np.degrees(Q[:, 0]), Q[:, 1:], 1e3 * TAU, np.degrees(QD)])
    path = write(tmp_path / "file.csv", header, rows)
    lines = path.read_text(encoding="utf-8").splitlines()
    lines.insert(1, "[ms],deg,rad,rad,mA,mA,mA,°/s,deg/s,°/s")
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    recording = read_recording(path)
    samples = recording.samples()
    assert recording.effort_kind == "i"
    assert samples.velocity is not None
    for found, expected in ((samples.position, Q), (samples.effort, TAU), (samples.velocity, QD)):
        assert np.allclose(found, expected)
    assert np.allclose(np.diff(samples.time), 0.01)
    assert np.allclose(read_recording(path, reading=Reading({"tau": "Nm"})).samples().effort, 1e3 * TAU)


def test_a_rig_with_one_joint(tmp_path: Path) -> None:
    path = write(
        tmp_path / "file.csv", ["Time", "Position (rad)", "Torque"], np.column_stack([TIME, Q[:, 0], TAU[:, 0]])
    )
    for joints in (None, ("j",)):
        layout = guess_of(message_of(lambda joints=joints: read_recording(path, joint_names=joints)))
        samples = read(path, layout, joints).samples()
        assert np.array_equal(samples.position, Q[:, :1])
        assert np.array_equal(samples.effort, TAU[:, :1])


ECHOED = ["elbow", "shoulder_pan", "wrist_1"]  # as ROS sorts joints


@pytest.mark.parametrize("has_names", [True, False], ids=["rostopic echo -p", "ros2 topic echo --csv"])
def test_joints_that_rows_name_are_matched_by_name(tmp_path: Path, has_names: bool) -> None:
    order = [JOINTS.index(name) for name in ECHOED]
    stamps = [[int(time), round(time % 1 * 1e9)] for time in TIME]
    groups = (Q[:, order].tolist(), QD[:, order].tolist(), TAU[:, order].tolist())
    rows = [[*stamp, "base", *ECHOED, *q, *qd, *tau] for stamp, q, qd, tau in zip(stamps, *groups, strict=True)]
    fields = [f"field.{name}{k}" for name in ("name", "position", "velocity", "effort") for k in range(3)]
    names = ["secs", "nsecs", "field.header.frame_id", *fields]
    lines = [",".join(names)] if has_names else []
    path = tmp_path / "echo.csv"
    path.write_text("\n".join([*lines, *(",".join(map(str, row)) for row in rows)]) + "\n")
    layout = guess_of(message_of(lambda: read(path, RecordingLayout(), JOINTS)))
    found = rows_of(read(path, layout, JOINTS))
    np.testing.assert_allclose(found[:, 1:10], np.column_stack([Q, TAU, QD]))
    message = message_of(lambda: read(path, layout, ("a", "b", "c")))
    assert "the rows name 3 joints (elbow, shoulder_pan, wrist_1), the robot has 3 (a, b, c)" in message


@given(order=st.permutations([*JOINTS, "finger", "thumb"]))
@settings(suppress_health_check=[HealthCheck.function_scoped_fixture], max_examples=20)
def test_rows_that_name_more_joints_than_the_robot_has(tmp_path: Path, order: list[str]) -> None:
    places = [JOINTS.index(name) if name in JOINTS else -1 for name in order]
    groups = [np.column_stack([each, np.zeros(len(TIME))])[:, places].tolist() for each in (Q, TAU)]
    fields = [f"field.{name}{k}" for name in ("name", "position", "effort") for k in range(len(order))]
    rows = [[float(time), *order, *q, *tau] for time, q, tau in zip(TIME, *groups, strict=True)]
    path = tmp_path / "echo.csv"
    path.write_text("\n".join([",".join(["time", *fields]), *(",".join(map(str, row)) for row in rows)]) + "\n")
    layout = guess_of(message_of(lambda: read(path, RecordingLayout(), JOINTS)))
    assert np.array_equal(rows_of(read(path, layout, JOINTS)), np.column_stack([TIME, Q, TAU]))


def test_a_file_without_names_asks_for_the_numbers_of_its_columns(tmp_path: Path) -> None:
    path = write(tmp_path / "file.csv", None, np.column_stack([TIME, Q, TAU, TAU[:, :1]]))
    message = message_of(lambda: read_recording(path, joint_names=JOINTS))
    assert '{t: "?", q: ["?", "?", "?"], tau: ["?", "?", "?"]}' in message
    filled = message.replace('t: "?"', "t: 1").replace('q: ["?", "?", "?"]', "q: [2, 3, 4]")
    layout = guess_of(filled.replace('["?", "?", "?"]', "[5, 6, 7]"))
    assert np.array_equal(rows_of(read(path, layout, JOINTS)), np.column_stack([TIME, Q, TAU]))


@pytest.mark.parametrize(
    ("better", "worse"),
    [
        ("trq_fb_{}", "trq_sp_{}"), ("torque_meas_{}", "torque_ff_{}"), ("tau_meas_{}", "tau_est_{}"),
        ("Joint Torque J{}", "Motor Torque J{}"), ("torque_sensor_{}", "torque_model_{}"),
        ("torque_{}_mean", "torque_{}_std"),
        ("Istmoment A{} [Nm]", "Sollmoment A{} [Nm]"),
    ],
)  # fmt: skip
def test_what_is_measured_goes_before_what_is_not(tmp_path: Path, better: str, worse: str) -> None:
    header = [
        "time",
        *(f"pos_{k}" for k in (1, 2, 3)),
        *(each.format(k) for each in (worse, better) for k in (1, 2, 3)),
    ]
    path = write(tmp_path / "file.csv", header, np.column_stack([TIME, Q, 0.5 * TAU, TAU]))
    layout = guess_of(message_of(lambda: read(path, RecordingLayout(), JOINTS)))
    np.testing.assert_array_equal(rows_of(read(path, layout, JOINTS))[:, 4:7], TAU)


def test_each_signal_may_have_its_own_time(tmp_path: Path) -> None:
    header = [name for k in (1, 2, 3) for name in ("Time", f"Axis{k}.ActPos", "Time", f"Axis{k}.ActTorque")]
    rows = np.column_stack([column for k in range(3) for column in (TIME, Q[:, k], TIME, TAU[:, k])])
    path = write(tmp_path / "scope.csv", header, rows)
    layout = guess_of(message_of(lambda: read(path, RecordingLayout(), JOINTS)))
    np.testing.assert_allclose(rows_of(read(path, layout, JOINTS))[:, 1:], np.column_stack([Q, TAU]))


def test_an_index_without_a_name_is_the_time(tmp_path: Path) -> None:
    header = ["", *(f"q{k}" for k in (1, 2, 3)), *(f"tau{k}" for k in (1, 2, 3))]
    path = write(tmp_path / "pandas.csv", header, np.column_stack([TIME, Q, TAU]))
    layout = guess_of(message_of(lambda: read(path, RecordingLayout(), JOINTS)))
    np.testing.assert_allclose(rows_of(read(path, layout, JOINTS))[:, 1:], np.column_stack([Q, TAU]))
