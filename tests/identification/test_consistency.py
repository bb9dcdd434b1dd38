"""Physically consistent parameters: the conic program against an independent formulation, truths, and bad input."""

import itertools
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from identification.mass_bounds import centre_of_mass_inequalities, mass_inequalities, total_mass_inequalities
from tauscope.errors import IdentificationError
from tauscope.identification.consistency import Prior, nearest_consistent_parameters, plausible_prior, program
from tauscope.identification.consistency.inequalities import FrictionColumns, LinearInequalities, friction_inequalities
from tauscope.identification.consistency.nearest import MARGIN
from tauscope.identification.consistency.triangle import UPPER_TRIANGLE, triangle_of_parameters
from tauscope.robot import Joint, JointType, LinkInertia, Model, Placement, Robot, Segment, pseudo_inertia

WIDTH = 60.0
"""Of a prior that decides nothing which the data say."""


def ellipsoid(rng: np.random.Generator, thickness: float = 0.02) -> LinkInertia:
    """A random solid ellipsoid, turned and moved away from the link frame's origin."""
    mass = float(np.exp(rng.uniform(np.log(0.3), np.log(6.0))))
    rotation = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    centre = rng.uniform(-0.15, 0.15, 3)
    spread = rotation @ np.diag(rng.uniform(thickness, 0.3, 3) ** 2 / 5.0) @ rotation.T + np.outer(centre, centre)
    return LinkInertia(mass, mass * centre, mass * (np.trace(spread) * np.eye(3) - spread))


def chain(count: int, kind: JointType = JointType.REVOLUTE, model: Model | None = None) -> Robot:
    """A straight chain of 0.3 m links."""
    segment = Segment(kind, Placement(), Placement(np.eye(3), np.array([0.3, 0.0, 0.0])))
    joints = tuple(Joint(f"joint{j + 1}", kind) for j in range(count))
    return Robot("chain", joints, (segment,) * count, model=model or Model())


def columns(count: int) -> FrictionColumns:
    """Stiction, Stribeck, viscous, offset of each joint, after the standard parameters."""
    first = [10 * count + 4 * j for j in range(count)]
    return FrictionColumns(tuple(first), tuple(c + 1 for c in first), tuple(c + 2 for c in first))


def names(count: int) -> list[str]:
    return [f"joint{j + 1}" for j in range(count)]


def information(rng: np.random.Generator, truth: np.ndarray, rank: int, noise: float) -> tuple[np.ndarray, np.ndarray]:
    """A factor R with singular values over three decades and rank as given, and its z."""
    size = truth.size
    left = np.linalg.qr(rng.normal(size=(size, size)))[0]
    right = np.linalg.qr(rng.normal(size=(size, size)))[0]
    values = np.concatenate([np.geomspace(3000.0, 3.0, rank), np.zeros(size - rank)])
    factor = (left * values) @ right.T
    return factor, factor @ truth + noise * rng.normal(size=size)


def wide(prior: Prior) -> Prior:
    return replace(prior, root=prior.root / WIDTH)


def link_scale(prior: Prior) -> list[tuple[float, float]]:
    """Mass and length that a link's parameters are scaled by."""
    inertia = prior.scale[: 10 * prior.link_count : 10]
    return [(float(mass), float(np.sqrt(each / mass))) for mass, each in zip(prior.masses, inertia, strict=True)]


def cvxpy_optimum(factor, target, prior: Prior, inequalities: LinearInequalities, margin: float) -> float:
    """The same problem written with matrices, solved through cvxpy: optimal value of the criterion."""
    cp = pytest.importorskip("cvxpy")
    x = cp.Variable(prior.mean.size)
    u = prior.root @ (x - prior.mean)
    constraints = [inequalities.matrix @ x <= inequalities.bound] if len(inequalities.bound) else []
    for j, (mass, length) in enumerate(link_scale(prior)):
        xx, yy, zz, xy, xz, yz, m, hx, hy, hz = (x[10 * j + k] for k in range(10))
        trace = 0.5 * (xx + yy + zz)
        rows = [
            [trace - xx, -xy, -xz, hx],
            [-xy, trace - yy, -yz, hy],
            [-xz, -yz, trace - zz, hz],
            [hx, hy, hz, m],
        ]
        weight = np.outer([1 / length] * 3 + [1.0], [1 / length] * 3 + [1.0]) / mass
        scaled = cp.bmat([[weight[a, b] * rows[a][b] for b in range(4)] for a in range(4)])
        variable = cp.Variable((4, 4), symmetric=True)
        constraints += [variable == scaled, variable >> margin * np.eye(4)]
    problem = cp.Problem(cp.Minimize(cp.sum_squares(factor @ x - target) + cp.sum_squares(u)), constraints)
    problem.solve(solver=cp.CLARABEL, tol_gap_abs=1e-9, tol_gap_rel=1e-9, tol_feas=1e-9)
    return float(problem.value)


def smallest_scaled_eigenvalues(result, prior: Prior) -> list[float]:
    """Smallest eigenvalue of each pseudo-inertia in units of its link's mass and size."""
    found = []
    for link, (mass, length) in zip(result.links, link_scale(prior), strict=True):
        unit = np.diag([1.0 / length] * 3 + [1.0]) / np.sqrt(mass)
        found.append(float(np.linalg.eigvalsh(unit @ pseudo_inertia(link) @ unit)[0]))
    return found


def test_scaled_triangle_keeps_the_inner_product():
    rng = np.random.default_rng(1)
    a, b = ellipsoid(rng), ellipsoid(rng)
    triangle = triangle_of_parameters()
    product = (triangle @ a.to_vector()) @ (triangle @ b.to_vector())
    assert product == pytest.approx(np.trace(pseudo_inertia(a) @ pseudo_inertia(b)), rel=1e-12)
    assert UPPER_TRIANGLE[:4] == ((0, 0), (0, 1), (1, 1), (0, 2))


@pytest.mark.parametrize(("seed", "count", "noise"), list(itertools.product(range(4), (1, 3), (1.0, 30.0))))
def test_same_optimum_as_cvxpy(seed: int, count: int, noise: float):
    rng = np.random.default_rng(seed)
    friction = np.tile([2.0, -0.3, 0.5, 0.1], count)
    truth = np.concatenate([*(ellipsoid(rng).to_vector() for _ in range(count)), friction])
    factor, target = information(rng, truth, rank=int(0.7 * truth.size), noise=noise)
    prior = wide(plausible_prior(chain(count), factor, target, columns(count)))
    inequalities = friction_inequalities(columns(count), truth.size, names(count))
    inequalities += centre_of_mass_inequalities(0, np.full(3, -0.1), np.full(3, 0.1), truth.size)
    inequalities += total_mass_inequalities(count, 0.5 * count, 3.0 * count, truth.size)
    result = nearest_consistent_parameters(factor, target, prior, inequalities)
    expected = cvxpy_optimum(factor, target, prior, inequalities, margin=MARGIN)
    assert result.objective == pytest.approx(expected, rel=1e-5)
    assert min(smallest_scaled_eigenvalues(result, prior)) >= 0.5 * MARGIN * (1 - 1e-6)
    assert np.all(inequalities.matrix @ result.parameters <= inequalities.bound + 1e-9)
    assert any(result.active_links)


@pytest.mark.parametrize("seed", range(5))
def test_consistent_truth_is_recovered_from_noise_free_information(seed: int):
    rng = np.random.default_rng(seed)
    truth = np.concatenate([*(ellipsoid(rng).to_vector() for _ in range(3)), np.tile([2.0, -0.3, 0.5, 0.1], 3)])
    factor, target = information(rng, truth, rank=truth.size, noise=0.0)
    prior = wide(plausible_prior(chain(3), factor, target, columns(3)))
    result = nearest_consistent_parameters(
        factor, target, prior, friction_inequalities(columns(3), truth.size, names(3))
    )
    # In every direction the error stays well below the standard deviation of that direction.
    assert np.abs(factor @ (result.parameters - truth)).max() < 0.02
    assert result.residual_increase < 1e-3


def test_interior_optimum_is_the_regularised_least_squares():
    rng = np.random.default_rng(2)
    truth = np.concatenate([*(ellipsoid(rng, thickness=0.2).to_vector() for _ in range(2))])
    factor, target = information(rng, truth, rank=truth.size, noise=0.1)
    prior = wide(plausible_prior(chain(2), 10 * factor, 10 * target))
    result = nearest_consistent_parameters(10 * factor, 10 * target, prior)
    stacked = np.vstack([10 * factor, prior.root])
    expected = np.linalg.lstsq(stacked, np.concatenate([10 * target, prior.root @ prior.mean]), rcond=None)[0]
    assert result.status == "interior"
    assert not any(result.active_links)
    np.testing.assert_allclose(result.parameters, expected, rtol=1e-9, atol=1e-12)
    # The plausible point pulls no identified direction by more than a few hundredths of its standard deviation.
    free = np.linalg.solve(factor, target)
    assert np.abs(10 * factor @ (result.parameters - free)).max() < 0.03


def test_slender_rods_on_the_boundary_are_recovered():
    mass, length = np.sqrt(2.0), 0.5
    inertia = np.diag([0.0, mass * length**2 / 3.0, mass * length**2 / 3.0])
    rod = LinkInertia(mass, np.array([-0.5 * mass * length, 0.0, 0.0]), inertia)
    truth = np.concatenate([rod.to_vector(), rod.to_vector()])
    factor, target = information(np.random.default_rng(3), truth, rank=20, noise=0.0)
    prior = wide(plausible_prior(chain(2), factor, target))
    result = nearest_consistent_parameters(factor, target, prior)
    assert result.active_links == (True, True)
    assert np.abs(factor @ (result.parameters - truth)).max() < 0.02
    for link in result.links:
        np.linalg.cholesky(pseudo_inertia(link))
        assert link.mass == pytest.approx(mass, rel=1e-3)


def test_impossible_estimate_is_brought_back_and_its_cost_is_told():
    truth = ellipsoid(np.random.default_rng(4)).to_vector()
    truth[6] = -1.0
    factor, target = information(np.random.default_rng(4), truth, rank=10, noise=0.0)
    prior = wide(plausible_prior(chain(1), factor, target))
    result = nearest_consistent_parameters(factor, target, prior)
    assert result.links[0].mass > 0.0
    assert result.free_squared_residual < 1e-6
    assert result.residual_increase > 1.0
    assert result.active_links == (True,)


def test_prismatic_axis_with_only_its_mass_identifiable():
    size = 12
    factor = np.zeros((3, size))
    factor[0, [6, 10, 11]] = 300.0, 10.0, 2.0
    factor[1, [10, 11]] = 200.0, 30.0
    factor[2, 11] = 150.0
    truth = np.zeros(size)
    truth[[6, 10, 11]] = 95.11, 20.4, 203.5
    friction = FrictionColumns((10,), (None,), (11,))
    prior = wide(plausible_prior(chain(1, JointType.PRISMATIC), factor, factor @ truth, friction))
    result = nearest_consistent_parameters(
        factor, factor @ truth, prior, friction_inequalities(friction, size, ["joint1"])
    )
    assert np.abs(factor @ (result.parameters - truth)).max() < 0.02
    np.linalg.cholesky(pseudo_inertia(result.links[0]))
    centre = result.links[0].first_moment / result.links[0].mass
    assert np.all(np.abs(centre) < 0.5)


def test_link_without_any_information_takes_the_model_of_the_robot_file():
    rng = np.random.default_rng(5)
    believed = (ellipsoid(rng), ellipsoid(rng))
    truth = np.concatenate([1.1 * believed[0].to_vector(), believed[1].to_vector()])
    factor, target = information(rng, truth, rank=20, noise=0.0)
    factor[:, 10:] = 0.0
    target = factor @ truth
    prior = wide(plausible_prior(chain(2, model=Model(links=believed)), factor, target))
    result = nearest_consistent_parameters(factor, target, prior)
    np.testing.assert_allclose(result.links[1].to_vector(), believed[1].to_vector(), rtol=1e-6, atol=1e-9)
    assert np.abs(factor @ (result.parameters - truth)).max() < 0.02


def test_friction_that_would_drive_the_joint_is_set_to_zero():
    truth = np.concatenate([ellipsoid(np.random.default_rng(6), 0.2).to_vector(), [1.0, -1.5, -0.2, -3.0]])
    factor, target = information(np.random.default_rng(6), truth, rank=14, noise=0.0)
    inequalities = friction_inequalities(columns(1), 14, ["elbow"])
    result = nearest_consistent_parameters(
        factor, target, wide(plausible_prior(chain(1), factor, target, columns(1))), inequalities
    )
    stiction, stribeck, viscous, offset = result.friction
    assert viscous >= 0.0
    assert viscous < 1e-6
    assert stiction + stribeck >= -1e-9
    assert offset < -1.0
    assert "viscous friction of elbow ≥ 0" in result.active_inequalities


def test_rotor_inertia_is_not_negative():
    rotor = FrictionColumns((None,), (None,), (10,), (11,))
    rows = friction_inequalities(rotor, 12, ["wrist"])
    assert rows.names == ("viscous friction of wrist ≥ 0", "rotor inertia of wrist ≥ 0")
    np.testing.assert_array_equal(rows.matrix[:, 10:], [[-1.0, 0.0], [0.0, -1.0]])


def test_what_cannot_be_told_from_the_link_is_credited_to_the_link():
    factor = np.zeros((1, 11))
    factor[0, [6, 10]] = 100.0
    friction = FrictionColumns((None,), (None,), (None,), (10,))
    prior = wide(plausible_prior(chain(1, JointType.PRISMATIC), factor, np.array([9500.0]), friction))
    result = nearest_consistent_parameters(
        factor, np.array([9500.0]), prior, friction_inequalities(friction, 11, ["axis"])
    )
    assert result.links[0].mass == pytest.approx(95.0, rel=0.01)
    assert result.links[0].mass + result.friction[0] == pytest.approx(95.0, rel=1e-5)


def test_known_mass_is_met_exactly():
    rng = np.random.default_rng(7)
    truth = ellipsoid(rng).to_vector()
    factor, target = information(rng, truth, rank=7, noise=1.0)
    result = nearest_consistent_parameters(
        factor, target, plausible_prior(chain(1), factor, target), mass_inequalities(0, 2.5, 2.5, 10)
    )
    assert result.links[0].mass == pytest.approx(2.5, abs=1e-8)


def test_contradicting_bounds_are_named():
    rng = np.random.default_rng(8)
    factor, target = information(rng, ellipsoid(rng).to_vector(), rank=10, noise=0.0)
    bounds = mass_inequalities(0, 3.0, None, 10, "forearm") + total_mass_inequalities(1, None, 2.0, 10)
    with pytest.raises(IdentificationError, match="together: mass of forearm ≥ 3 kg, mass of all links ≤ 2 kg; widen"):
        nearest_consistent_parameters(factor, target, plausible_prior(chain(1), factor, target), bounds)


class PanicException(BaseException):
    """What a panic of the solver looks like from Python."""


@pytest.mark.parametrize("panics", [1, 100])
def test_a_solver_that_breaks_down_is_asked_otherwise(panics: int, monkeypatch: pytest.MonkeyPatch):
    truth = ellipsoid(np.random.default_rng(4)).to_vector()
    truth[6] = -1.0
    factor, target = information(np.random.default_rng(4), truth, rank=10, noise=0.0)
    prior = wide(plausible_prior(chain(1), factor, target))
    expected = nearest_consistent_parameters(factor, target, prior)
    left = iter(range(panics))
    whole = program.clarabel.DefaultSolver

    class Panicking:
        def __init__(self, *arguments: Any) -> None:
            self._solver = whole(*arguments)

        def solve(self) -> object:
            if next(left, None) is not None:
                raise PanicException("Eigval error: Eigen(1)")
            return self._solver.solve()

    monkeypatch.setattr(program.clarabel, "DefaultSolver", Panicking)
    if panics > 1:
        with pytest.raises(IdentificationError, match="was not solved"):
            nearest_consistent_parameters(factor, target, prior)
        return
    found = nearest_consistent_parameters(factor, target, prior)
    assert found.objective == pytest.approx(expected.objective, rel=1e-6)
    np.testing.assert_allclose(found.parameters, expected.parameters, rtol=1e-4, atol=1e-6)


def test_information_that_is_not_finite_is_refused():
    rng = np.random.default_rng(9)
    factor, target = information(rng, ellipsoid(rng).to_vector(), rank=10, noise=0.0)
    prior = wide(plausible_prior(chain(1), factor, target))
    broken = factor.copy()
    broken[0, 3] = np.nan
    with pytest.raises(IdentificationError, match="parameter 4 is not finite"):
        nearest_consistent_parameters(broken, target, prior)
    with pytest.raises(IdentificationError, match="the torque is not finite"):
        nearest_consistent_parameters(factor, target * np.inf, prior)
    with pytest.raises(IdentificationError, match="shape"):
        nearest_consistent_parameters(factor[:, :9], target, prior)


@pytest.mark.parametrize("seed", range(3))
def test_seven_joint_arm_under_realistic_information(seed: int):
    """A Pinocchio regressor with friction, noise, and an information content that spans many decades."""
    pin = pytest.importorskip("pinocchio")
    rng = np.random.default_rng(seed)
    count, std = 7, 0.3 * np.geomspace(1.0, 0.05, 7)
    model, parent = pin.Model(), 0
    links = [ellipsoid(rng) for _ in range(count)]
    for j in range(count):
        rotation = np.linalg.qr(rng.normal(size=(3, 3)))[0]
        placement = pin.SE3(rotation * np.linalg.det(rotation), rng.uniform(-0.3, 0.3, 3))
        parent = model.addJoint(parent, pin.JointModelRZ(), placement, f"joint{j}")
    data = model.createData()
    order = [4, 6, 9, 5, 7, 8, 0, 1, 2, 3]
    friction = np.tile([2.0, -0.3, 0.5, 0.1], count)
    truth = np.concatenate([*(link.to_vector() for link in links), friction])
    rows = []
    for _ in range(500):
        q, qd, qdd = rng.uniform(-2, 2, count), rng.normal(size=count), 3 * rng.normal(size=count)
        rigid = pin.computeJointTorqueRegressor(model, data, q, qd, qdd).reshape(count, count, 10)[:, :, order]
        shape = np.stack([2 / np.pi * np.arctan(500 * qd), 2 / np.pi * np.arctan(10 * qd), qd, np.ones(count)], 1)
        own = np.zeros((count, count, 4))
        own[range(count), range(count)] = shape
        rows.append(np.hstack([rigid.reshape(count, -1), own.reshape(count, -1)]) / std[:, None])
    regressor = np.vstack(rows)
    orthogonal, factor = np.linalg.qr(regressor)
    target = orthogonal.T @ (regressor @ truth + rng.normal(size=len(regressor)))
    prior = wide(plausible_prior(chain(count), factor, target, columns(count)))
    inequalities = friction_inequalities(columns(count), truth.size, names(count))
    result = nearest_consistent_parameters(factor, target, prior, inequalities)
    assert min(smallest_scaled_eigenvalues(result, prior)) >= 0.5 * MARGIN * (1 - 1e-6)
    assert result.duality_gap < 1e-6
    # The truth is feasible, so the consistent optimum fits at least as well as the truth, but for the prior.
    true_fit = float(np.sum((factor @ truth - target) ** 2))
    true_distance = float(np.sum(((truth - prior.mean) / (10.0 * prior.scale)) ** 2))
    assert result.objective <= true_fit + true_distance + 1e-6
    # Consistency costs the fit less than the truth itself does.
    assert result.residual_increase < true_fit
    expected = cvxpy_optimum(factor, target, prior, inequalities, margin=MARGIN)
    assert result.objective == pytest.approx(expected, rel=1e-5)


@pytest.mark.parametrize("seed", range(6))
def test_long_recording_of_an_arm_that_is_far_from_rigid(seed: int):
    """The consistent optimum lies 1e5 standard deviations and more from the free one, and is still certified."""
    rng = np.random.default_rng(seed)
    count = 1 + seed
    truth = np.concatenate([*(ellipsoid(rng).to_vector() for _ in range(count)), np.tile([2.0, -0.3, 0.5, 0.1], count)])
    factor, target = information(rng, truth, rank=truth.size, noise=100.0)
    factor, target = 1e3 * factor, 1e3 * target
    prior = wide(plausible_prior(chain(count), factor, target, columns(count)))
    inequalities = friction_inequalities(columns(count), truth.size, names(count))
    result = nearest_consistent_parameters(factor, target, prior, inequalities)
    assert result.residual_increase > 1e6
    assert result.duality_gap < 1e-6
    assert min(smallest_scaled_eigenvalues(result, prior)) >= 0.4 * MARGIN
    assert np.all(inequalities.matrix @ result.parameters <= inequalities.bound + 1e-9)
