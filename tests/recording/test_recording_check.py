import dataclasses
import json

import numpy as np
import pytest

from recording.recording_files import csv_text, message_of
from tauscope.recording import Recording, check_recording, checks, report_recording
from tauscope.robot.messages import Severity

SAMPLES = 4000


def motion(**changes):
    """Two joints on a smooth path at 250 Hz, with noise on the efforts."""
    rng = np.random.default_rng(5)
    time = np.arange(SAMPLES) * 0.004
    position = np.column_stack([np.sin(time), 0.5 * np.cos(2 * time)])
    return {"time": time, "position": position, "effort": rng.normal(size=(SAMPLES, 2)), **changes}


def report(**changes):
    return report_recording(Recording.from_arrays("made", **motion(**changes)))


def remarks(made):
    return [(finding.severity, finding.where, finding.text) for finding in made.findings]


def test_a_sound_recording_has_figures_and_no_findings():
    made = report(period=np.repeat(np.arange(4.0), 1000))
    assert made.samples == SAMPLES
    assert made.duration_s == pytest.approx(15.996)
    assert made.rate_hz == pytest.approx(250)
    assert made.steps.minimum == pytest.approx(made.steps.maximum)
    assert made.gaps.count == 0
    assert made.periods is not None
    assert (made.periods.count, made.periods.shortest, made.periods.longest) == (4, 1000, 1000)
    assert made.joints[0].position == (motion()["position"][:, 0].min(), motion()["position"][:, 0].max())
    assert made.joints[1].effort == (motion()["effort"][:, 1].min(), motion()["effort"][:, 1].max())
    assert made.missed == {}
    assert made.findings == ()
    json.dumps(dataclasses.asdict(made))


def test_gaps():
    keep = np.ones(SAMPLES, dtype=bool)
    keep[[100, 2000, 2001, 2002]] = False
    whole = motion()
    made = report(**{name: array[keep] for name, array in whole.items()})
    assert (made.gaps.count, made.gaps.longest) == (2, pytest.approx(0.016))
    assert made.gaps.longest_at == pytest.approx(1999 * 0.004)
    assert remarks(made) == [
        (Severity.WARNING, "t", "2 gaps in the clock; the longest, 0.016 s, begins at t = 7.996 s")
    ]


def test_missed_samples():
    position = motion()["position"]
    position[5:8, 1] = np.nan
    made = report(position=position)
    assert made.missed == {"q2": 3}
    assert remarks(made) == [(Severity.INFO, "q2", "3 samples missed (NaN)")]


def test_silent_and_stuck_channels():
    position, effort = motion()["position"], motion()["effort"]
    position[:, 0] = 0.3
    effort[:, 0] = 0
    effort[:, 1] = np.nan
    assert remarks(report(position=position, effort=effort))[:3] == [
        (Severity.ERROR, "tau2", "NaN throughout: no effort was recorded; record torques or currents of every joint"),
        (Severity.WARNING, "q1", "never changes: the joint stood still or its encoder was not read"),
        (Severity.WARNING, "tau1", "is zero throughout: was it recorded?"),
    ]
    effort[:, 0] = 1.5
    assert (Severity.WARNING, "tau1", "never changes from 1.5: was it recorded?") in remarks(report(effort=effort))


def test_wrapped_angles():
    time = motion()["time"]
    position = motion()["position"]
    position[:, 1] = np.mod(2 * time, 2 * np.pi)
    wraps = int(2 * time[-1] / (2 * np.pi))
    first = time[np.argmax(np.diff(position[:, 1]) < 0) + 1]
    expected = f"wraps by 2π {wraps} times, first at t = {first:.6g} s; unwrapped"
    assert remarks(report(position=position)) == [(Severity.WARNING, "q2", expected)]


def test_degrees():
    assert report(position=np.rad2deg(motion()["position"])).findings == ()  # no limits, no gravity: nothing tells
    position = np.rad2deg(np.repeat(motion()["position"], 2, axis=1))
    made = report(position=position, effort=np.repeat(motion()["effort"], 2, axis=1))
    assert (made.findings[0].severity, made.findings[0].where) == (Severity.ERROR, "q1")
    assert "4 of 4 joints are beyond two turns" in made.findings[0].text
    assert "--units q=deg" in made.findings[0].text
    assert "--trust-units" in message_of(made.require_usable)


def test_encoder_steps():
    step = 2 * np.pi / 4096
    position = motion()["position"]
    position[:, 0] = np.round(position[:, 0] / step) * step
    made = report(position=position)
    assert made.joints[0].position_step == pytest.approx(step)
    assert made.joints[1].position_step is None
    assert remarks(made) == [(Severity.INFO, "q1", "moves in steps of 0.00153 (encoder resolution)")]


def test_clipped_efforts():
    time = motion()["time"]
    effort = motion()["effort"]
    effort[:, 0] = np.clip(3 * np.sin(time), -2, 2.5)
    made = report(effort=effort)
    for level, share in made.joints[0].clipped:
        assert share == (effort[:, 0] == level).sum()
    assert [level for level, _ in made.joints[0].clipped] == [-2, 2.5]
    assert made.joints[1].clipped == ()
    assert "stays at exactly -2 for" in made.findings[0].text


def test_an_effort_that_rests_at_its_lower_end_is_not_clipped():
    effort = motion()["effort"]
    effort[:, 0] = np.abs(effort[:, 0]) + 0.1
    effort[:500, 0] = 0.1
    assert report(effort=effort).findings == ()


def test_columns_that_are_not_read(tmp_path):
    lines = csv_text().splitlines()
    path = tmp_path / "file.csv"
    path.write_text("\n".join(line + (",i1,speed" if line == lines[0] else ",1,2") for line in lines))
    made = check_recording(path, 2)
    assert made.ignored_columns == ("i1", "speed")
    assert made.columns == ("t", "q1", "q2", "tau1", "tau2")
    assert remarks(made)[:2] == [
        (Severity.INFO, "i1", "currents are not read where torques are there"),
        (Severity.INFO, "speed", "not read: no column of this name is known"),
    ]


def test_what_cannot_be_read_is_an_error(tmp_path):
    assert "no such file" in message_of(lambda: check_recording(tmp_path / "gone.csv"))


def test_blocks_do_not_show(monkeypatch):
    whole = motion(period=np.array([np.nan] * 90 + [0.0] * 1500 + [1.0] * 1500 + [np.nan] * 910))
    whole["position"][:, 1] = np.mod(2 * whole["time"], 2 * np.pi)
    whole["time"][2000:] += 0.1
    expected = report(**whole)
    assert expected.periods is not None
    assert (expected.periods.count, expected.periods.shortest) == (2, 1500)
    monkeypatch.setattr(checks, "_ROWS_AT_ONCE", 500)
    in_blocks = report(**whole)
    assert in_blocks.findings == expected.findings
    assert in_blocks.periods == expected.periods
    assert in_blocks.gaps == expected.gaps
    assert in_blocks.steps == expected.steps
