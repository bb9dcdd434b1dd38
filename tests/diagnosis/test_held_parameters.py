"""A nominal parameter that is held: the fit is that of a model without its column."""

import numpy as np

from diagnosis.diagnosed_arm import at_joint, recordings
from identification.simulated import paper_robot
from tauscope.diagnosis.findings.finding import without_nominal
from tauscope.diagnosis.fitting.fit import Fitter
from tauscope.diagnosis.model.nominal import nominal_model
from tauscope.diagnosis.noise.floor import with_noise
from tauscope.diagnosis.observations.observations import Observations
from tauscope.identification import identify
from tauscope.recording.conditioning import Conditioner


def test_without_its_constant_a_joint_with_one_fits_worse_by_the_constants_share() -> None:
    """c = 0.6 Nm on every row of joint 3: the energy grows by c² over the constant's own variance, and Θ moves."""
    robot = paper_robot()
    made = recordings((1, 2), lambda arm, rigid: at_joint(2, np.full(len(rigid), 0.6)), np.random.default_rng(3))
    identification = identify(robot, made)
    model = nominal_model(identification)
    conditioners = [Conditioner.survey(each, robot) for each in made]
    rows = Observations.prepare(conditioners, robot, identification.structure.base, 8.0, model.steepness)
    rows, _ = with_noise(rows, model, [])
    fitter = Fitter(rows)
    fit = fitter.fit(model)
    place = fit.model.structure.coefficient(2, "offset")
    assert place is not None
    without = without_nominal(fit, place, fitter)
    assert abs(without.model.parameters[place]) < 1e-9
    expected = fit.model.parameters[place] ** 2 / fit.covariance[place, place]
    assert 0.8 * expected < without.energy - fit.energy < 1.2 * expected
    others = np.delete(without.model.parameters - fit.model.parameters, place)
    assert np.abs(others).max() > 1e-3
