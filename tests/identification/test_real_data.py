"""Recordings of real arms: the figures that issue 2 asks for, by our own measure and by the data README's recipe.

Bounds are the README's, none is widened. The recipe (zero-phase Butterworth on q and τ, central differences) is worked
out here with Pinocchio's regressor, so that neither our filter nor our regressor judges itself. The README does not say
what it did with irregular stamps and with the filter's edges: here signals are interpolated onto a uniform grid, and
1.5 periods of the cut-off are left out at both ends.
"""

from collections.abc import Iterable
from functools import cache

import numpy as np
import pytest
from _pytest.mark import ParameterSet
from numpy.typing import NDArray
from scipy import signal

from identification.residual_ratios import ratios, within
from pinocchio_arm import pinocchio_regressor
from shared_data import SHARED_DATA, needs_shared_data
from tauscope.identification import Identification, IdentificationDocument, Options, document, identify
from tauscope.identification.dataset import Dataset
from tauscope.identification.residuals import evaluate
from tauscope.recording import Recording, read_recording
from tauscope.recording.conditioning import Conditioner
from tauscope.robot import LinkInertia, Robot, pseudo_inertia, read_robot

pytestmark = needs_shared_data

Array = NDArray[np.float64]

HELD_OUT_BOUNDS = {
    "emps": (100.0, 4.78),
    "kuka-lwr4": (8.0, 4.3),
    "franka-panda": (10.0, 1.81),
    "double-pendulum": (8.0, 10.1),
    "bam-xl330": (12.0, 29.7),
    "staubli-tx40": (30.0, 21.1),
}
"""Cut-off [Hz] and held-out relative error [%] of the data README (LWR4+: its physically consistent figure)."""

LESS_LEFT_OUT = "the recipe leaves out less of the edges than our conditioning, and counts rows it never learnt from"

STANDARD = ("Ixx", "Iyy", "Izz", "Ixy", "Ixz", "Iyz", "m", "msx", "msy", "msz")

ALL_SETS = (*HELD_OUT_BOUNDS, "odrive-cogging")
LARGE_SETS = ("kuka-lwr4", "franka-panda", "staubli-tx40")
"""Arms of six and seven joints: seconds each, and small ones show the same."""


def each_of(names: Iterable[str]) -> list[ParameterSet]:
    return [pytest.param(name, marks=pytest.mark.slow if name in LARGE_SETS else ()) for name in names]


@cache
def real_set(name: str) -> tuple[Robot, list[Recording], list[Recording]]:
    """Robot, training recordings, held-out recordings."""
    folder = SHARED_DATA / name
    kinds = ("train-*.csv", "held-out-*.csv")
    train, held_out = ([read_recording(path) for path in sorted(folder.glob(kind))] for kind in kinds)
    return read_robot(folder / "robot.yaml"), train, held_out


@cache
def identified(name: str, cutoff_hz: float | None = None) -> Identification:
    """The set identified in a band, or in the band that the data ask for where None."""
    robot, train, held_out = real_set(name)
    return identify(robot, train, held_out, Options(cutoff_hz="auto" if cutoff_hz is None else cutoff_hz))


def filtered(values: Array, stamps: Array, time: Array, sections: Array) -> Array:
    """Signals interpolated onto a uniform grid and low-passed without phase."""
    uniform = np.stack([np.interp(time, stamps, column) for column in values.T], axis=1)
    return signal.sosfiltfilt(sections, uniform, axis=0)


def relative_error_by_recipe(result: Identification, parameters: Array, recordings: list[Recording]) -> float:
    """‖τ - τ̂‖ / ‖τ‖ [%] over all recordings after the README's own filter and differences."""
    assert result.cutoff_hz is not None
    robot, squares, total = result.robot, 0.0, 0.0
    names = [f"{name}{link + 1}" for link in range(robot.joint_count) for name in STANDARD]
    leading = [names.index(next(iter(terms))) for terms in result.structure.base.terms]
    for recording in recordings:
        samples = recording.samples()
        time = np.linspace(samples.time[0], samples.time[-1], len(samples.time))
        rate = 1.0 / (time[1] - time[0])
        sections = signal.butter(4, result.cutoff_hz, output="sos", fs=rate)
        torque = filtered(recording.joint_torque(samples.effort, robot), samples.time, time, sections)
        q = filtered(samples.position, samples.time, time, sections)
        qd = np.gradient(q, time, axis=0)
        qdd = np.gradient(qd, time, axis=0)
        phi = pinocchio_regressor(robot, q, qd, qdd)[:, :, leading]
        modelled = phi @ parameters[: len(leading)]
        for joint, terms in enumerate(result.structure.terms):
            velocity = qd[:, joint]
            own = {
                "stiction": 2 / np.pi * np.arctan(terms.k_v * velocity),
                "stribeck": 2 / np.pi * np.arctan((terms.delta or 0.0) * velocity),
                "viscous": velocity,
                "offset": np.ones_like(velocity),
                "rotor_inertia": qdd[:, joint],
            }
            for name in terms.names:
                column = result.structure.coefficient(joint, name)
                assert column is not None
                modelled[:, joint] += parameters[column] * own[name]
        edge = int(1.5 * rate / result.cutoff_hz)
        squares += float(np.sum((torque - modelled)[edge:-edge] ** 2))
        total += float(np.sum(torque[edge:-edge] ** 2))
    return 100.0 * np.sqrt(squares / total)


def held_out_error(result: Identification, name: str, parameters: Array, cutoff_hz: float | None) -> float:
    """Held-out relative error [%] of an estimate in any band."""
    robot, _, held_out = real_set(name)
    conditioners = [Conditioner.survey(recording, robot) for recording in held_out]
    motions = Dataset(conditioners, robot, result.structure.base, cutoff_hz)
    (residuals,) = evaluate(motions, result.structure, [parameters])
    return 100.0 * residuals.fit.relative_error


def links_of(found: IdentificationDocument) -> list[LinkInertia]:
    """The links that the document states."""
    links = []
    for entry in found.links:
        i = entry.inertia
        inertia = np.array([[i.xx, i.xy, i.xz], [i.xy, i.yy, i.yz], [i.xz, i.yz, i.zz]])
        links.append(LinkInertia(entry.mass, np.array(entry.first_moment), inertia))
    return links


@pytest.mark.parametrize("name", each_of(HELD_OUT_BOUNDS))
def test_held_out_error_is_no_worse_than_the_readmes(name: str) -> None:
    cutoff, bound = HELD_OUT_BOUNDS[name]
    result = identified(name, cutoff)
    assert result.cutoff_hz == cutoff
    assert result.held_out is not None
    assert 100.0 * result.held_out.relative_error <= bound


@pytest.mark.parametrize(
    "name",
    [
        *each_of(("emps", "kuka-lwr4", "franka-panda", "double-pendulum")),
        pytest.param("bam-xl330", marks=pytest.mark.xfail(reason=f"30.1 %: {LESS_LEFT_OUT}", strict=True)),
        pytest.param(
            "staubli-tx40",
            marks=[pytest.mark.slow, pytest.mark.xfail(reason=f"21.2 %: {LESS_LEFT_OUT}", strict=True)],
        ),
    ],
)
def test_held_out_error_by_the_readmes_own_recipe(name: str) -> None:
    cutoff, bound = HELD_OUT_BOUNDS[name]
    result = identified(name, cutoff)
    assert relative_error_by_recipe(result, result.parameters, real_set(name)[2]) <= bound


@pytest.mark.parametrize("name", each_of(HELD_OUT_BOUNDS))
def test_links_are_possible_and_nearly_as_good(name: str) -> None:
    result = identified(name, HELD_OUT_BOUNDS[name][0])
    found = document(result)
    for number, link in enumerate(links_of(found), 1):
        assert np.linalg.eigvalsh(pseudo_inertia(link)).min() > 0.0, f"link {number}"
    for entry in found.links_friction:
        assert entry.stiction >= 0.0
        assert entry.viscous >= 0.0
        assert entry.stiction + entry.stribeck >= 0.0
    assert result.held_out is not None
    free = held_out_error(result, name, result.free_parameters, result.cutoff_hz)
    assert 100.0 * result.held_out.relative_error <= free + 1.0


@pytest.mark.parametrize("name", each_of(HELD_OUT_BOUNDS))
def test_the_stated_links_are_the_model_that_was_judged(name: str) -> None:
    result = identified(name, HELD_OUT_BOUNDS[name][0])
    found = document(result)
    standard = np.concatenate([link.to_vector() for link in links_of(found)])
    names = [f"{parameter}{link + 1}" for link in range(result.robot.joint_count) for parameter in STANDARD]
    values = dict(zip(names, standard, strict=True))
    base = [sum(factor * values[term] for term, factor in terms.items()) for terms in result.structure.base.terms]
    np.testing.assert_allclose(base, result.consistent_parameters[: len(base)], rtol=0, atol=1e-9 * np.abs(base).max())


@pytest.mark.parametrize("name", each_of(HELD_OUT_BOUNDS))
def test_the_stated_fit_is_the_recipes(name: str) -> None:
    result = identified(name, HELD_OUT_BOUNDS[name][0])
    assert result.held_out is not None
    by_recipe = relative_error_by_recipe(result, result.parameters, real_set(name)[2])
    assert 100.0 * result.held_out.relative_error == pytest.approx(by_recipe, rel=0.08)


def test_emps_finds_the_published_values() -> None:
    found = document(identified("emps", HELD_OUT_BOUNDS["emps"][0]))
    (mass,), (friction,) = found.base_parameters, found.friction
    assert mass.name == "m1"
    assert mass.value == pytest.approx(95.11, rel=0.01)
    assert friction.viscous == pytest.approx(203.5, rel=0.02)
    assert friction.stiction + friction.stribeck == pytest.approx(20.39, rel=0.02)
    assert friction.offset == pytest.approx(-3.16, rel=0.05)


def test_emps_noise_is_the_scatter_between_its_periods() -> None:
    found = document(identified("emps", HELD_OUT_BOUNDS["emps"][0]))
    assert found.noise_method == "periods"
    assert found.noise_std == pytest.approx([0.33], rel=0.05)


def test_the_double_pendulum_has_its_published_moments() -> None:
    """m2·r2 and m1·r1 + m2·l1, which gravity shows: the README's own fit is off by 1 and 2 %."""
    found = document(identified("double-pendulum", HELD_OUT_BOUNDS["double-pendulum"][0]))
    first, second = found.links
    # About the joint's axis: the link frame lies at the link's far end, its x axis along the link.
    assert second.first_moment[0] + 0.2 * second.mass == pytest.approx(0.1111, rel=0.05)
    assert first.first_moment[0] + 0.3 * (first.mass + second.mass) == pytest.approx(0.3491, rel=0.05)


@pytest.mark.parametrize("name", each_of(ALL_SETS))
def test_the_automatic_band_suits_the_data(name: str) -> None:
    robot, train, _ = real_set(name)
    result = identified(name)
    rate = max(summary.rate_hz for summary in result.conditioning)
    assert result.cutoff_hz is None or 0.5 < result.cutoff_hz < rate / 2
    assert len(result.conditioning) == len(train)
    assert np.isfinite(result.free_parameters).all()
    assert np.isfinite(result.covariance).all()
    assert result.held_out is not None
    if name in HELD_OUT_BOUNDS:
        cutoff, bound = HELD_OUT_BOUNDS[name]
        assert held_out_error(result, name, result.parameters, cutoff) <= bound, "in the README's own band"
    assert robot.joint_count == len(result.shapes)


@pytest.mark.slow
def test_the_residual_that_a_result_predicts_is_the_one_that_shows() -> None:
    assert within(np.concatenate([ratios(document(identified(name))) for name in ALL_SETS])) >= 0.95
