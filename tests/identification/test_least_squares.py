"""LS and WLS from orthogonal factors: against numpy.linalg.lstsq on Pinocchio's columns, in pieces, without rank."""

from dataclasses import replace

import numpy as np
import pytest

from identification.simulated import PAPER_NOISE, Array, SimulatedArm, paper_robot, simulate, standard_errors, z_scores
from pinocchio_arm import pinocchio_regressor
from tauscope.dynamics.regressor import TorqueRegressor
from tauscope.errors import IdentificationError, RecordingMismatchError
from tauscope.identification import Estimator, Identification, Options, dataset, document, identify, least_squares
from tauscope.identification.dataset import Dataset, PreparedMotion
from tauscope.identification.least_squares import JointFactor, condition_number, factorise, restrict, solve
from tauscope.identification.structure import JointTerms, ModelStructure
from tauscope.recording import Recording
from tauscope.recording.conditioning import Conditioner
from tauscope.robot import FrictionShape
from tauscope.robot.robot import STANDARD_PARAMETERS
from tauscope_sim.motion import random_fourier_motion


@pytest.fixture(scope="module")
def arm() -> SimulatedArm:
    return simulate(paper_robot(), seed=2)


@pytest.fixture(scope="module")
def recording(arm: SimulatedArm) -> Recording:
    return arm.recording(arm.white(PAPER_NOISE, np.random.default_rng(7)))


@pytest.fixture(scope="module")
def result(arm: SimulatedArm, recording: Recording) -> Identification:
    return identify(arm.robot, [recording])


def prepared(arm: SimulatedArm, recording: Recording, structure: ModelStructure) -> list[PreparedMotion]:
    return list(Dataset([Conditioner.survey(recording, arm.robot)], arm.robot, structure.base, None))


def stacked_equations(arm: SimulatedArm, recording: Recording, structure: ModelStructure) -> tuple[list[Array], Array]:
    """Every joint's equations of one averaged period, (N, p) a joint, and their right-hand side, (N, n)."""
    count = round(10.0 * 100.0)
    exact = arm.exact.exact
    q, qd, qdd = (signal[:count] for signal in (exact.position, exact.velocity, exact.acceleration))
    standard = [f"{name}{link}" for link in (1, 2, 3) for name in STANDARD_PARAMETERS]
    leading = [standard.index(next(iter(terms))) for terms in structure.base.terms]
    phi = pinocchio_regressor(arm.robot, q, qd, qdd)[:, :, leading]
    matrices = []
    for joint, terms in enumerate(structure.terms):
        matrix = np.zeros((count, structure.size))
        matrix[:, : len(leading)] = phi[:, joint]
        velocity = qd[:, joint]
        own = {
            "stiction": 2 / np.pi * np.arctan(terms.k_v * velocity),
            "stribeck": 2 / np.pi * np.arctan((terms.delta or 0.0) * velocity),
            "viscous": velocity,
            "offset": np.ones(count),
            "rotor_inertia": qdd[:, joint],
        }
        for name in terms.names:
            column = structure.coefficient(joint, name)
            assert column is not None
            matrix[:, column] = own[name]
        matrices.append(matrix)
    return matrices, recording.samples().effort.reshape(3, count, 3).mean(axis=0)


def test_ls_is_numpys_least_squares(arm: SimulatedArm, recording: Recording) -> None:
    ls = identify(arm.robot, [recording], options=Options(estimator=Estimator.LS))
    matrices, target = stacked_equations(arm, recording, ls.structure)
    expected = np.linalg.lstsq(np.vstack(matrices), target.T.ravel())[0]
    np.testing.assert_allclose(ls.free_parameters, expected, rtol=0, atol=1e-8)


def test_wls_is_numpys_least_squares_of_weighted_rows(arm: SimulatedArm, recording: Recording, result) -> None:
    matrices, target = stacked_equations(arm, recording, result.structure)
    for std in (PAPER_NOISE, np.array([3.0, 0.01, 0.4])):
        factors = factorise(prepared(arm, recording, result.structure), result.structure)
        solution = solve(factors, result.structure.size, std)
        rows = np.vstack([matrix / s for matrix, s in zip(matrices, std, strict=True)])
        expected = np.linalg.lstsq(rows, (target / std).T.ravel())[0]
        np.testing.assert_allclose(solution.parameters, expected, rtol=0, atol=1e-8)
        # S Sᵀ = (LᵀWL)⁻¹: three periods were averaged, so a row counts √3.
        np.testing.assert_allclose(
            solution.spread @ solution.spread.T, np.linalg.inv(3.0 * rows.T @ rows), rtol=1e-6, atol=1e-12
        )
        assert not solution.undetermined.any()


def test_wls_takes_its_weights_from_the_residual(arm: SimulatedArm, recording: Recording, result) -> None:
    """Fed back with the σ that its own residual has, the estimate stays where it is."""
    matrices, target = stacked_equations(arm, recording, result.structure)
    residual = np.stack([target[:, j] - matrices[j] @ result.free_parameters for j in range(3)])
    std = np.sqrt(np.mean(residual**2, axis=1))
    rows = np.vstack([matrix / s for matrix, s in zip(matrices, std, strict=True)])
    expected = np.linalg.lstsq(rows, (target / std).T.ravel())[0]
    assert np.abs((result.free_parameters - expected) / standard_errors(result)).max() < 0.02


def test_squared_residuals_are_those_of_the_rows(arm: SimulatedArm, recording: Recording, result) -> None:
    matrices, target = stacked_equations(arm, recording, result.structure)
    factors = factorise(prepared(arm, recording, result.structure), result.structure)
    parameters = np.random.default_rng(0).normal(size=result.structure.size)
    for joint, factor in enumerate(factors):
        assert factor.rows == len(target)
        expected = 3.0 * np.sum((matrices[joint] @ parameters - target[:, joint]) ** 2)
        assert factor.squared_residual(parameters) == pytest.approx(expected, rel=1e-8)


def test_the_condition_number_is_that_of_the_stacked_regressor(arm: SimulatedArm, recording: Recording, result) -> None:
    matrices, _ = stacked_equations(arm, recording, result.structure)
    assert result.condition_number == pytest.approx(np.linalg.cond(np.vstack(matrices)), rel=1e-6)
    without_rank = JointFactor(np.arange(2), np.diag([1.0, 0.0, 1.0]), 10)
    assert 1e15 < condition_number((without_rank,), 2) < np.inf


@pytest.mark.parametrize("dropped", [[16], [0, 5, 26], [15, 16, 17, 18]])
def test_restricted_factors_are_those_of_the_smaller_model(arm, recording, result, dropped: list[int]) -> None:
    matrices, target = stacked_equations(arm, recording, result.structure)
    keep = np.setdiff1d(np.arange(result.structure.size), dropped)
    factors = restrict(factorise(prepared(arm, recording, result.structure), result.structure), keep)
    solution = solve(factors, len(keep), PAPER_NOISE)
    rows = np.vstack([matrix[:, keep] / s for matrix, s in zip(matrices, PAPER_NOISE, strict=True)])
    expected = np.linalg.lstsq(rows, (target / PAPER_NOISE).T.ravel())[0]
    np.testing.assert_allclose(solution.parameters, expected, rtol=0, atol=1e-8)


@pytest.mark.parametrize("deficiency", ["none", "combination", "zero but for rounding"])
def test_a_joint_alone_leaves_what_its_equations_leave(deficiency: str) -> None:
    """Columns that are none of their own explain nothing, though rounding leaves a direction of them."""
    rng = np.random.default_rng(8)
    matrix, target = rng.normal(size=(25, 6)), rng.normal(size=25)
    expected = np.linalg.lstsq(matrix, target)[1][0]
    if deficiency == "combination":
        matrix = np.insert(matrix, 2, matrix[:, :3] @ [0.3, -0.7, 0.2], axis=1)
    elif deficiency == "zero but for rounding":
        matrix = np.insert(matrix, 2, 1e-17 * rng.normal(size=25), axis=1)
    triangle = np.asarray(np.linalg.qr(np.column_stack([matrix, target]), mode="r"))
    factor = JointFactor(np.arange(matrix.shape[1]), triangle, len(target))
    assert factor.least_squared_residual == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize("rows_at_once", [1, 17, 400, 10**6])
def test_the_size_of_blocks_changes_nothing(
    arm, recording, result, rows_at_once: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    expected = solve(factorise(prepared(arm, recording, result.structure), result.structure), 27, PAPER_NOISE)
    monkeypatch.setattr(least_squares, "ROWS_AT_ONCE", rows_at_once)
    found = solve(factorise(prepared(arm, recording, result.structure), result.structure), 27, PAPER_NOISE)
    np.testing.assert_allclose(found.parameters, expected.parameters, rtol=0, atol=1e-10)


def test_several_recordings_are_one_set_of_equations(arm: SimulatedArm, result) -> None:
    """Two recordings weigh as one of twice the length: standard errors fall by √2."""
    rng = np.random.default_rng(3)
    pair = [arm.recording(arm.white(PAPER_NOISE, rng), name=name) for name in ("first", "second")]
    both = identify(arm.robot, pair)
    each = [identify(arm.robot, [one]) for one in pair]
    assert [summary.recording for summary in both.conditioning] == ["first", "second"]
    np.testing.assert_allclose(standard_errors(both) * np.sqrt(2), standard_errors(each[0]), rtol=0.06)
    mean = (each[0].free_parameters + each[1].free_parameters) / 2
    assert np.abs((both.free_parameters - mean) / standard_errors(both)).max() < 0.15
    assert np.abs(z_scores(both, arm.robot)).max() < 4.5


@pytest.mark.slow
@pytest.mark.parametrize("cutoff_hz", ["auto", 8.0])
@pytest.mark.parametrize("periods", [True, False])
def test_equations_that_do_not_fit_into_memory_are_made_again(
    arm: SimulatedArm, cutoff_hz, periods: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    rng = np.random.default_rng(5)
    recordings = [arm.recording(arm.white(PAPER_NOISE, rng), periods=periods) for _ in range(2)]
    robot = replace(
        arm.robot, joints=tuple(replace(joint, friction_shape=FrictionShape()) for joint in arm.robot.joints)
    )
    calls: list[int] = []
    write = TorqueRegressor.write_shares

    def counted(regressor: TorqueRegressor, *arguments) -> None:
        calls.append(1)
        write(regressor, *arguments)

    monkeypatch.setattr(dataset.TorqueRegressor, "write_shares", counted)
    kept = identify(robot, recordings, recordings[:1], Options(cutoff_hz=cutoff_hz))
    kept_calls = len(calls)
    monkeypatch.setattr(dataset, "MEMORY_LIMIT", 1000)
    remade = identify(robot, recordings, recordings[:1], Options(cutoff_hz=cutoff_hz))
    assert len(calls) - kept_calls > 2 * kept_calls
    assert document(remade) == document(kept)


def held_still(reach: float) -> SimulatedArm:
    """The paper's arm, joint 3 moving by this much of its usual motion."""
    robot = paper_robot()
    moving = random_fourier_motion(robot.joints, np.random.default_rng(2))
    scale = np.array([1.0, 1.0, reach])[:, None]
    return simulate(robot, motion=replace(moving, cosine=moving.cosine * scale, sine=moving.sine * scale))


@pytest.mark.parametrize("periods", [True, False], ids=["periods", "one motion"])
@pytest.mark.parametrize("reach", [0.0, 1e-8])
def test_a_joint_held_still_leaves_its_friction_undetermined(reach: float, periods: bool) -> None:
    """The rounding of its velocity is no motion: else 1e6 to 1e13 Nm of friction are found, and predicted held out."""
    arm, other = held_still(reach), simulate(paper_robot(), seed=2)
    recording = arm.recording(arm.white(PAPER_NOISE, np.random.default_rng(0)), periods=periods)
    held_out = other.recording(other.white(PAPER_NOISE, np.random.default_rng(1)))
    result = identify(arm.robot, [recording], [held_out])
    found = document(result)
    assert {"stiction joint3", "stribeck joint3", "viscous joint3"} <= set(found.undetermined)
    assert [found.friction[2].std[name] for name in ("stiction", "stribeck", "viscous")] == [None, None, None]
    assert not any(found.friction[2].identifiable[name] for name in ("stiction", "stribeck", "viscous"))
    assert "offset joint3" not in found.undetermined
    determined = ~result.undetermined
    assert np.abs(z_scores(result, arm.robot)[determined]).max() < 4.5
    assert np.abs(result.parameters[~determined]).max() < 1.0  # what has no information takes its smallest value
    assert found.fit.held_out is not None
    assert found.fit.held_out.rms[2] < 5.0  # joint 3's friction is 2 Nm


@pytest.mark.parametrize("periods", [True, False], ids=["periods", "one motion"])
def test_a_joint_that_moves_a_millionth_has_honest_errors(periods: bool) -> None:
    """What the solution keeps of a nearly singular factor, the covariance has to keep too: else -1e9 Nm ± 20 Nm."""
    arm = held_still(1e-6)
    recording = arm.recording(arm.white(PAPER_NOISE, np.random.default_rng(0)), periods=periods)
    result = identify(arm.robot, [recording])
    determined = ~result.undetermined
    assert np.abs(z_scores(result, arm.robot)[determined]).max() < 4.5
    assert not any(document(result).friction[2].identifiable[name] for name in ("stiction", "stribeck", "viscous"))


def test_two_columns_that_are_one_are_both_undetermined(arm: SimulatedArm, recording: Recording, result) -> None:
    """A Stribeck term as steep as the step: only their sum is known."""
    terms = tuple(JointTerms(k_v=500.0, delta=500.0) for _ in range(3))
    structure = result.structure.with_terms(terms)
    solution = solve(factorise(prepared(arm, recording, structure), structure), structure.size, PAPER_NOISE)
    names = [name for name, open_ in zip(structure.names, solution.undetermined, strict=True) if open_]
    assert names == [f"{term} joint{joint}" for joint in (1, 2, 3) for term in ("stiction", "stribeck")]
    smaller = result.structure.with_terms(tuple(JointTerms(k_v=500.0) for _ in range(3)))
    other = solve(factorise(prepared(arm, recording, smaller), smaller), smaller.size, PAPER_NOISE)
    for joint in range(3):
        pair = [structure.coefficient(joint, name) for name in ("stiction", "stribeck")]
        level = sum(solution.parameters[column] for column in pair if column is not None)
        assert level == pytest.approx(other.parameters[smaller.coefficient(joint, "stiction")], abs=1e-9)


def test_too_few_samples_are_refused_by_name(arm: SimulatedArm) -> None:
    exact = arm.exact
    torque = exact.torque_exact[:200].copy()
    torque[8:, 1] = np.nan
    short = Recording.from_arrays("short.csv", exact.time[:200], exact.exact.position[:200], torque)
    with pytest.raises(IdentificationError, match=r"joint2: .* usable samples for .* parameters") as caught:
        identify(arm.robot, [short])
    assert "\n" not in str(caught.value)


def test_a_recording_of_another_robot_is_refused(arm: SimulatedArm, recording: Recording) -> None:
    samples = recording.samples()
    other = Recording.from_arrays("two.csv", samples.time, samples.position[:, :2], samples.effort[:, :2])
    for train, held_out in (([other], []), ([recording], [other])):
        with pytest.raises(RecordingMismatchError, match=r"two\.csv: has 2 joints, robot paper-arm has 3"):
            identify(arm.robot, train, held_out)


def test_a_recording_without_motion_is_refused(arm: SimulatedArm) -> None:
    exact = arm.exact
    position = np.tile(exact.exact.position[:1], (len(exact.time), 1))
    for noise in (0.0, 1e-5):
        drawn = position + noise * np.random.default_rng(0).standard_normal(position.shape)
        still = Recording.from_arrays("still.csv", exact.time, drawn, exact.torque)
        with pytest.raises(IdentificationError, match=r"still\.csv.*no joint moves"):
            identify(arm.robot, [still])
