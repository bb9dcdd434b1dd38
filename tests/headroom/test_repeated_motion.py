"""Recordings of one motion tell the noise, whenever each begins; recordings of others tell nothing."""

from dataclasses import replace

import numpy as np

from headroom.black_box_rows import RATE_HZ, motion, with_torque
from tauscope.headroom.floor import noise_between
from tauscope.headroom.motion_rows import MotionRows
from tauscope.recording.recording import Array

NOISE = 0.1


def spring(rows: MotionRows) -> Array:
    return 3.0 * rows.position[0]


def later(rows: MotionRows, rows_later: float) -> MotionRows:
    """The same motion, begun later by some rows."""
    instants = rows.time + rows_later / RATE_HZ
    inside = instants <= rows.time[-1]
    position = np.stack([np.interp(instants[inside], rows.time, each) for each in rows.position])
    empty = np.zeros_like(position)
    return replace(
        rows,
        recording=rows.recording + 1,
        time=rows.time[inside],
        position=position,
        torque=empty,
        plain=empty,
        explained=empty,
        used=np.ones(position.shape, dtype=bool),
    )


def test_the_same_motion_tells_the_noise_beside_any_law() -> None:
    rng = np.random.default_rng(0)
    first = motion(1, 0)
    for shift in (0.0, 7.4, 200.0):
        second = later(first, shift)
        noisy = [with_torque(each, spring, NOISE * rng.standard_normal(len(each.time))) for each in (first, second)]
        for pair in (noisy, noisy[::-1]):
            found = noise_between(pair)
            # Between rows, interpolation smooths white noise a little.
            assert 0.8 * NOISE < found[0] < 1.05 * NOISE
            assert found[1] == 0.0


def test_other_motion_tells_nothing() -> None:
    assert np.isnan(noise_between([motion(1, 0), motion(2, 1)])).all()
    assert np.isnan(noise_between([motion(1, 0)])).all()


def test_rows_that_were_not_measured_do_not_count() -> None:
    rng = np.random.default_rng(0)
    first, second = (
        with_torque(replace(motion(1, 0), recording=number), spring, NOISE * rng.standard_normal(1200))
        for number in (0, 1)
    )
    used, torque = first.used.copy(), first.torque.copy()
    used[0, 300:400], torque[0, 300:400] = False, 50.0
    found = noise_between([replace(first, used=used, torque=torque), second])
    assert 0.9 * NOISE < found[0] < 1.1 * NOISE
