"""Torque of contacts, carried bodies and displaced frames against Pinocchio, and the windows on them."""

from dataclasses import replace

import numpy as np
import pinocchio as pin  # pyright: ignore[reportMissingImports]
import pytest

from effects.piece_of_motion import RATE, SIGNALS, Array, context, torque
from pinocchio_arm import pinocchio_model
from tauscope.effects import TimeLocalEffect, possible_effects
from tauscope.effects.external_contact import ExternalContact, JointContact
from tauscope.effects.kinematic_error import KinematicError
from tauscope.effects.payload import Payload
from tauscope.effects.payload_change import PayloadChange, carried
from tauscope.effects.plain_terms import CoulombFriction, TorqueOffset, ViscousFriction
from tauscope.effects.time_local import EVERY, HALF_SINE, OUTSIDE, open_share, since
from tauscope.robot import LinkInertia

PICKED = slice(None, None, 200)


def form(kind: type, joint: int | None = None) -> TimeLocalEffect:
    (found,) = [each for each in possible_effects(context()) if type(each) is kind and each.joint == joint]
    assert isinstance(found, TimeLocalEffect)
    return found


def loaded(mass: float, place: Array) -> Array:
    """The links with a point mass on the last one."""
    body = LinkInertia(mass, mass * place, mass * (place @ place * np.eye(3) - np.outer(place, place)))
    links = SIGNALS.links.copy()
    links[-10:] += body.to_vector()
    return links


def states(picked: slice) -> list[Array]:
    return [each[:, picked] for each in (SIGNALS.position, SIGNALS.velocity, SIGNALS.acceleration)]


@pytest.mark.parametrize("kind", [PayloadChange, Payload])
def test_a_carried_body_is_the_torque_of_links_that_have_it_less_that_of_links_that_do_not(kind: type) -> None:
    place = np.array([0.05, -0.12, 0.2])
    expected = torque(SIGNALS.robot, loaded(0.7, place), *states(PICKED)) - SIGNALS.load[:, PICKED]
    if kind is Payload:
        (effect,) = Payload.forms(context())
        found = 0.7 * effect.columns(SIGNALS, place[None])[0, 0][:, PICKED]
    else:
        shape = np.array([[0.0, 2.0, 3.0, 0.0, *place]])
        whole = 0.7 * form(PayloadChange).columns(SIGNALS, shape)[0, 0]  # (n, P, N), four seconds a repetition
        carried = (SIGNALS.time > 2.0) & (SIGNALS.time < 3.0)
        assert np.abs(whole[:, ~((SIGNALS.time > 1.99) & (SIGNALS.time < 3.01))]).max() == 0.0
        assert not carried[1].any()
        found = np.where(carried[0], whole[:, 0], 0.0)[:, PICKED]
        expected = np.where(carried[0][PICKED], expected, 0.0)
    assert found == pytest.approx(expected, abs=1e-9)


def test_a_force_at_the_tool_does_the_power_of_its_point() -> None:
    """Power of the joints' torques is F · v of the last link's origin, v by differences of its place."""
    model = pinocchio_model(SIGNALS.robot, SIGNALS.links)
    data = model.createData()
    force = np.array([3.0, -2.0, 5.0])
    columns = form(ExternalContact).torque(SIGNALS, np.zeros(4))
    for sample in range(10, 3990, 400):
        places = []
        for q in (SIGNALS.position[:, sample - 1], SIGNALS.position[:, sample + 1]):
            pin.forwardKinematics(model, data, q)
            places.append(last_origin(model, data))
        velocity = (places[1] - places[0]) * RATE / 2.0
        power = (force @ columns[:, :, sample]) @ SIGNALS.velocity[:, sample]
        assert power == pytest.approx(force @ velocity, abs=2e-4)


def last_origin(model: pin.Model, data: pin.Data) -> Array:
    """Origin of the last link's frame: its inertia is given about it, in Pinocchio's joint frame or a frame beyond."""
    segment = SIGNALS.robot.segments[-1]
    placement = data.oMi[model.njoints - 1]
    return placement.translation + placement.rotation @ np.asarray(segment.after.translation)


def test_at_one_joint_a_contact_is_its_window() -> None:
    found = form(JointContact, 2).columns(SIGNALS, np.array([[0.0, 1.0, 3.0, HALF_SINE]]))[0, 0, 0]
    time = SIGNALS.time
    expected = np.where((time > 1.0) & (time < 3.0), np.sin(np.pi * (time - 1.0) / 2.0), 0.0)
    assert found == pytest.approx(expected, abs=1e-9)


def test_windows_belong_to_one_recording_to_all_or_to_all_from_one_on() -> None:
    time = np.arange(0.0, 10.0, 0.01)

    def seconds(shape: list[float], recording: int) -> float:
        return float(open_share(np.array(shape), recording, time, 0.01).sum() * 0.01)

    assert seconds([1.0, 2.0, 5.0, 0.0], 1) == pytest.approx(3.0)
    assert seconds([1.0, 2.0, 5.0, 0.0], 0) == seconds([1.0, 2.0, 5.0, 0.0], -2) == 0.0
    assert all(seconds([EVERY, 2.0, 5.0, 0.0], number) == pytest.approx(3.0) for number in (0, 1, -1))
    later = [since(1), 4.0, 0.0, 0.0]
    assert [round(seconds(later, number), 2) for number in (0, 1, 2, -1)] == [0.0, 6.0, 10.0, 0.0]
    # An edge between two samples counts the part of the interval that it leaves open.
    assert seconds([0.0, 2.003, 3.003, 0.0], 0) == pytest.approx(1.0, abs=1e-9)


@pytest.mark.parametrize("recording", [-1, 0, 1, 2])
def test_many_windows_at_once_are_the_same_one_by_one(recording: int) -> None:
    rng = np.random.default_rng(4)
    count, interval = 300, 0.05
    time = np.sort(rng.uniform(0.0, 4.0, 50))
    scopes = rng.choice([EVERY, 0.0, 1.0, 2.0, since(0), since(1), since(2)], count)
    start = rng.uniform(-1.0, 4.0, count)
    profile = rng.choice([0.0, HALF_SINE, OUTSIDE], count)
    shapes = np.stack([scopes, start, start + rng.exponential(1.0, count), profile], axis=1)
    opened = np.stack([open_share(shape, recording, time, interval) for shape in shapes])
    assert (opened > 0.0).any() == (recording >= 0 or EVERY in scopes)
    each = open_share(np.repeat(shapes, len(time), axis=0), recording, np.tile(time, count), interval)
    assert np.array_equal(each.reshape(opened.shape), opened)


def test_a_displaced_frame_is_the_difference_of_two_arms() -> None:
    (effect,) = KinematicError.forms(context())
    thinned = replace(
        SIGNALS,
        position=SIGNALS.position[:, PICKED],
        velocity=SIGNALS.velocity[:, PICKED],
        acceleration=SIGNALS.acceleration[:, PICKED],
        _memory={},
    )
    link_2_along_x = np.array([2.0, 1.0])
    found = effect.columns(thinned, link_2_along_x[None])[0, 0]
    segments = list(SIGNALS.robot.segments)
    by = np.array([0.03, 0.0, 0.0])
    after = replace(segments[1].after, translation=segments[1].after.translation + by)
    segments[1] = replace(segments[1], after=after)
    longer = replace(SIGNALS.robot, segments=tuple(segments))
    change = torque(longer, SIGNALS.links, *states(PICKED)) - SIGNALS.load[:, PICKED]
    assert effect.torque_of(thinned, np.array([0.03]), link_2_along_x) == pytest.approx(change, abs=1e-9)
    assert 0.03 * found == pytest.approx(change, abs=0.1 * np.abs(change).max())  # to first order


def test_plain_terms_are_the_nominal_columns() -> None:
    expected = {
        ViscousFriction: SIGNALS.velocity[3],
        CoulombFriction: SIGNALS.step[3],
        TorqueOffset: np.ones_like(SIGNALS.velocity[3]),
    }
    for kind, column in expected.items():
        assert kind(3).columns(SIGNALS, np.zeros((1, 0)))[0, 0, 0] == pytest.approx(column)


@pytest.mark.parametrize(
    ("mass", "window", "sign", "edges"),
    [
        (0.3, (0.0, 6.0, 20.9), 1.0, {"t_on": 1}),
        (-0.3, (0.0, 6.0, 20.9), -1.0, {"t_off": 1}),
        (0.3, (EVERY, 0.0, 6.0), 1.0, {"t_off": 2}),
        (-0.3, (EVERY, 0.0, 6.0), -1.0, {"t_on": 2}),
        (0.3, (EVERY, 5.0, 6.0), 1.0, {"t_on": 1, "t_off": 2}),
        (-0.3, (EVERY, 5.0, 6.0), -1.0, {"t_off": 1, "t_on": 2}),
        (-0.3, (EVERY, 0.0, 20.9), 1.0, {}),
        (0.3, (since(1), 5.0, 0.0), 1.0, {"t_on": 1}),
        (-0.3, (since(1), 5.0, 0.0), -1.0, {"t_off": 1}),
    ],
)
def test_what_is_missing_in_one_part_is_carried_in_the_rest(
    mass: float, window: tuple[float, float, float], sign: float, edges: dict[str, int]
) -> None:
    shape = np.array([*window, 0.0, 0.0, 0.0, 0.0])
    assert carried(mass, shape, (20.0, 20.0)) == (sign, edges)


@pytest.mark.parametrize("window", [(0.0, 6.0, 9.0), (since(0), 7.0, 0.0)])
def test_what_is_let_go_is_the_opposite_outside_the_window_and_not_there_later(
    window: tuple[float, float, float],
) -> None:
    """Outside and inside make the whole of the training recordings; held-out ones are without."""
    effect = form(PayloadChange)
    inside = np.array([*window, 0.0, 0.1, 0.2, 0.3])
    assert isinstance(effect, PayloadChange)
    ((turn, outside),) = effect.twins(inside, 2)
    assert turn == -1.0
    time = np.arange(0.0, 20.0, 0.005)
    for recording in (0, 1):
        both = [open_share(shape, recording, time, 0.005) for shape in (inside, outside)]
        assert both[0] + both[1] == pytest.approx(1.0)
    assert not open_share(outside, -1, time, 0.005).any()
    sign, edges = carried(-0.3, inside, (20.0, 20.0))
    assert carried(0.3, outside, (20.0, 20.0)) == (-sign, edges)


def test_one_training_recording_leaves_open_whether_others_have_its_window() -> None:
    effect = form(ExternalContact)
    assert isinstance(effect, ExternalContact)
    window, every = np.array([0.0, 6.0, 9.0, 0.0]), np.array([EVERY, 6.0, 9.0, 0.0])
    ((sign, twin),) = effect.twins(window, 1)
    assert (sign, twin.tolist()) == (1.0, every.tolist())
    assert not effect.twins(window, 2)
    assert not effect.twins(every, 1)
    time = np.arange(0.0, 20.0, 0.005)
    assert np.array_equal(open_share(window, 0, time, 0.005), open_share(every, 0, time, 0.005))
    assert open_share(every, -1, time, 0.005).any()
    assert not open_share(window, -1, time, 0.005).any()


def test_a_half_sine_of_no_length_is_nothing() -> None:
    """Not the rounding error of sin π, which a fit would multiply by whatever it takes."""
    time = np.arange(0.0, 2.0, 0.005)
    for start in (0.0, 0.7):
        assert not open_share(np.array([0.0, start, start, HALF_SINE]), 0, time, 0.005).any()
    window = open_share(np.array([0.0, 0.5, 1.0, HALF_SINE]), 0, time, 0.005)
    assert np.flatnonzero(window).tolist() == list(range(101, 200))
    assert window[150] == pytest.approx(1.0)
