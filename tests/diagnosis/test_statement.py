"""What a finding's statement says: the physics as the sign has it, numbers with intervals, and no more than is so."""

import re
from collections.abc import Sequence
from typing import Any

import numpy as np
import pytest

from diagnosis.made_up_findings import JOINTS, NAMES, finding, form, rival, words_of
from tauscope.diagnosis import Finding
from tauscope.diagnosis.documents.statement import Statement, numbers_text, state_finding, state_unknown
from tauscope.effects import Effect, Quantity, catalogue
from tauscope.effects.asymmetric_coulomb import AsymmetricCoulomb
from tauscope.effects.asymmetric_viscous import AsymmetricViscous
from tauscope.effects.backlash import Backlash
from tauscope.effects.base_tilt import BaseTilt
from tauscope.effects.cable_force import CableForce
from tauscope.effects.external_contact import ExternalContact, JointContact
from tauscope.effects.friction_coupling import FrictionCoupling
from tauscope.effects.friction_drift import FrictionDrift
from tauscope.effects.joint_elasticity import JointElasticity
from tauscope.effects.joint_spring import JointSpring
from tauscope.effects.kinematic_error import KinematicError
from tauscope.effects.load_dependent_friction import LoadDependentFriction
from tauscope.effects.nonlinear_viscous import NonlinearViscous
from tauscope.effects.payload import Payload
from tauscope.effects.payload_change import PayloadChange
from tauscope.effects.periodic_torque import Cogging, TorqueRipple
from tauscope.effects.plain_terms import CoulombFriction, StribeckTerm, TorqueOffset, ViscousFriction
from tauscope.effects.position_dependent_friction import PositionDependentFriction
from tauscope.effects.presliding_hysteresis import PreslidingHysteresis
from tauscope.effects.rotor_inertia import RotorInertia
from tauscope.effects.stribeck_friction import StribeckFriction
from tauscope.effects.time_delay import Lag, TimeDelay
from tauscope.effects.torque_gain_error import TorqueGainError
from tauscope.effects.torque_saturation import TorqueSaturation

AT = f" at {NAMES[1]}"


def stated(found: Finding, *, tentative: bool = False) -> Statement:
    """The statement of a finding made by hand."""
    term, (covariance,) = found.terms[0], found.covariances
    diagnosis = words_of(found)
    quantities = term.effect.quantities(diagnosis.setting, term.coefficients, term.shape, covariance)
    return state_finding(found, quantities, diagnosis, tentative=tentative)


CLAIMS: list[tuple[Effect, Sequence[float], Sequence[float], str]] = [
    (form(JointSpring), [0.6], [], f"A 0.60 Nm/rad spring is missing{AT}"),
    (form(JointSpring), [-0.6], [], f"A counterbalance of 0.60 Nm/rad (a spring of negative stiffness) is missing{AT}"),
    (form(CableForce), [2.0], [-0.5, 1.5], f"An elastic force above -0.50 rad is missing{AT}"),
    (form(CableForce, side=-1), [2.0], [0.5, 1.5], f"An elastic force below 0.50 rad is missing{AT}"),
    (form(StribeckFriction), [0.3], [0.1, 1.0], f"Friction rises by 0.30 Nm towards zero velocity{AT}"),
    (form(StribeckFriction), [-0.3], [0.1, 1.0], f"Friction falls by 0.30 Nm towards zero velocity{AT}"),
    (form(StribeckTerm), [0.3], [10.0], f"Friction falls by 0.30 Nm towards zero velocity{AT}"),
    (form(StribeckTerm), [-0.3], [10.0], f"Friction rises by 0.30 Nm towards zero velocity{AT}"),
    (form(LoadDependentFriction), [0.079], [], f"Friction rises by 7.9 % of the transmitted torque{AT}"),
    (form(LoadDependentFriction), [-0.079], [], f"Friction falls by 7.9 % of the transmitted torque{AT}"),
    (
        form(AsymmetricCoulomb),
        [0.1],
        [],
        f"Coulomb friction is 0.20 Nm larger in positive than in negative direction{AT}",
    ),
    (
        form(AsymmetricCoulomb),
        [-0.1],
        [],
        f"Coulomb friction is 0.20 Nm larger in negative than in positive direction{AT}",
    ),
    (
        form(AsymmetricViscous),
        [-0.1],
        [],
        f"Viscous friction is 0.20 Nm s/rad larger in negative than in positive direction{AT}",
    ),
    (form(NonlinearViscous), [0.1], [2.0], f"Friction grows faster than in proportion to speed{AT}"),
    (form(NonlinearViscous), [-0.1], [2.0], f"Friction grows more slowly than in proportion to speed{AT}"),
    (form(NonlinearViscous), [0.1], [0.5], f"Friction grows more slowly than in proportion to speed{AT}"),
    (form(NonlinearViscous), [-0.1], [0.5], f"Friction grows faster than in proportion to speed{AT}"),
    (form(PositionDependentFriction), [0.3, 0.4], [1.0], f"Friction varies by ±0.50 Nm with position{AT}"),
    (
        form(PreslidingHysteresis),
        [1.0],
        [0.03],
        f"Friction rises over 0.030 rad after each reversal instead of at once{AT}",
    ),
    (form(FrictionDrift), [-0.2, 0.0], [10.0], f"Friction falls by 0.20 Nm during a recording{AT}"),
    (form(FrictionDrift), [0.2, 0.0], [10.0], f"Friction rises by 0.20 Nm during a recording{AT}"),
    (form(FrictionDrift, by_heat=True), [-0.2, 0.0], [10.0], f"Friction falls by 0.20 Nm per watt of its own heat{AT}"),
    (
        form(FrictionCoupling, partner=0, sign=-1),
        [0.3, 0.1],
        [30.0],
        f"0.30 Nm of Coulomb friction on the difference of two speeds is missing at {NAMES[0]} and {NAMES[1]}",
    ),
    (form(Cogging), [0.3, 0.4], [17.0], f"A cogging torque of 0.50 Nm and order 17 is missing{AT}"),
    (form(TorqueRipple), [0.03, 0.04], [17.0], f"Torque ripples by 5.0 % of the load with order 17{AT}"),
    (form(Backlash), [0.002], [0.002, 10.0], f"The transmission has 0.0020 rad of backlash{AT}"),
    (form(JointElasticity), [0.001], [10.0, 0.0], f"A transmission stiffness of 1000 Nm/rad is missing{AT}"),
    (form(RotorInertia), [0.2], [], f"A rotor inertia of 0.20 Nm s^2/rad is missing{AT}"),
    (form(RotorInertia), [-0.2], [], f"A rotor inertia of 0.20 Nm s^2/rad is too much{AT}"),
    (form(TorqueOffset), [-0.2], [], f"The torque has an offset of -0.20 Nm{AT}"),
    (form(CoulombFriction), [0.2], [], f"Coulomb friction of 0.20 Nm is missing{AT}"),
    (form(ViscousFriction), [-0.2], [], f"Viscous friction of 0.20 Nm s/rad is too much{AT}"),
    (form(TorqueGainError), [0.08], [], f"The recorded torque is 8.0 % too large{AT}"),
    (form(TorqueGainError), [-0.08], [], f"The recorded torque is 8.0 % too small{AT}"),
    (form(TorqueGainError), [-2.01], [], f"The recorded torque has the wrong sign{AT}"),
    (form(TorqueGainError), [-1.5], [], f"The recorded torque has the wrong sign and is 50 % too small{AT}"),
    (form(TorqueGainError, None), [-2.0], [], "The recorded torque has the wrong sign at every joint"),
    (form(TorqueSaturation), [1.0], [8.0], f"The recorded torque saturates near 8.0 Nm{AT}"),
    (form(TimeDelay), [0.0009], [], f"Torque lags position by 0.90 ms{AT}"),
    (form(TimeDelay), [-0.0009], [], f"Torque leads position by 0.90 ms{AT}"),
    (form(TimeDelay, None), [-0.0009], [], "Torque leads position by 0.90 ms at every joint"),
    (form(Lag), [1.0], [0.02], f"A low-pass filter delays torque by 20 ms{AT}"),
    (form(Payload, None), [0.3], [0.0, 0.0, 0.1], "A 0.30 kg payload is missing"),
    (form(Payload, None), [-0.3], [0.0, 0.0, 0.1], "The model's tool is 0.30 kg too heavy"),
    (
        form(PayloadChange, None),
        [0.3],
        [0.0, 2.0, 5.0, 0.0, 0.0, 0.0, 0.1],
        "A 0.30 kg mass is picked up at 2.00 s and is dropped at 5.00 s of motion.csv",
    ),
    (
        form(ExternalContact, None),
        [3.0, 0.0, 4.0],
        [0.0, 1.0, 2.0, 0.0],
        "A force of 5.0 N acts on the tool from 1.00 to 2.00 s of motion.csv",
    ),
    (
        form(JointContact),
        [-0.6],
        [0.0, 1.0, 2.0, 0.0],
        f"An outside torque of -0.60 Nm acts{AT} from 1.00 to 2.00 s of motion.csv",
    ),
    (form(BaseTilt, None), [0.03, -0.04], [], "Gravity in the base frame is off by 0.050 rad"),
    (form(KinematicError, None), [-0.01], [2.0, 3.0], "The frame of link 2 is off by 0.010 m along -z"),
]


@pytest.mark.parametrize(("effect", "coefficients", "shape", "expected"), CLAIMS, ids=lambda each: str(each)[:40])
def test_the_claim_follows_the_sign_and_has_the_size(
    effect: Effect, coefficients: Sequence[float], shape: Sequence[float], expected: str
) -> None:
    assert stated(finding(effect, coefficients, shape)).headline == f"{expected} (58 %)"


def test_every_effect_of_the_catalogue_claims_something_of_its_own() -> None:
    assert {each.id for each in catalogue()} == {effect.id for effect, *_ in CLAIMS}


def test_a_statement_is_short_sentences_with_interval_and_advice() -> None:
    text = stated(finding(form(JointSpring), [0.6], alternatives=(rival(form(CableForce)),))).text
    assert text == (
        f"A 0.60 Nm/rad spring is missing{AT} (58 %; or cable force). k = 0.600 ± 0.020 Nm/rad (95 %)."
        " Add a spring to the joint."
    )


def test_rivals_elsewhere_have_their_place_and_many_are_counted() -> None:
    rivals = [rival(form(CableForce, joint)) for joint in (1, 2, 3)] + [rival(form(BaseTilt, None))]
    headline = stated(finding(form(JointSpring), [0.6], alternatives=tuple(rivals))).headline
    assert headline.endswith(f"(58 %; or cable force or cable force at {NAMES[2]} or 2 more)")


@pytest.mark.parametrize(
    ("effect", "coefficients", "advice"),
    [
        (form(TorqueGainError), [-2.0], "Invert the joint's sign."),
        (form(TorqueGainError), [0.25], "Divide the joint's torque_constant by 1.25."),
        (form(TorqueGainError), [-1.5], "Invert the joint's sign and divide the joint's torque_constant by 0.500."),
        (form(TimeDelay), [0.002], "Shift the torque channel 2.0 ms earlier."),
        (form(TimeDelay), [-0.002], "Shift the torque channel 2.0 ms later."),
        (form(JointSpring), [-0.6], "Add a spring of negative stiffness to the joint."),
        (form(StribeckFriction), [-0.1], "Lower friction near zero velocity by a Stribeck term."),
        (form(RotorInertia), [-0.1], "Lower the joint's armature inertia."),
    ],
)
def test_advice_follows_the_sign(effect: Effect, coefficients: Sequence[float], advice: str) -> None:
    assert stated(finding(effect, coefficients, effect.grid[0])).text.endswith(advice)


def held_out(*after: float, before: Sequence[float] = (1.0,) * JOINTS, **more: Any) -> Finding:
    """A spring at the second joint with residuals before and after, on held-out motion too."""
    return finding(form(JointSpring), [0.6], before=before, after=after, rng=np.random.default_rng(4), **more)


def test_a_confirmed_finding_says_by_how_much_held_out_motion_improves() -> None:
    text = stated(held_out(1.0, 0.8, 1.0, 1.0, 1.0, 1.0, confirmed=True)).text
    change = re.search(rf"The held-out rms of {NAMES[1]} changes by (-[0-9.]+) ± ([0-9.]+) % \(95 %\)\.", text)
    assert change is not None
    assert float(change[1]) == pytest.approx(-20.0, abs=0.5)


def test_a_tentative_finding_advises_nothing_and_names_the_joint_that_loses() -> None:
    text = stated(held_out(1.0, 0.8, 1.0, 1.3, 1.0, 1.0, confirmed=False), tentative=True).text
    assert f"Held-out motion does not confirm it: the held-out rms of {NAMES[3]} changes by +30." in text
    assert "Add a spring" not in text


def test_a_finding_less_likely_than_something_else_advises_nothing() -> None:
    text = stated(finding(form(JointSpring), [0.6], probability=0.4)).text
    assert "(40 %)" in text
    assert text.endswith("Something else is likelier: do not act on this alone.")


def test_numbers_without_an_error_have_no_interval() -> None:
    assert numbers_text([Quantity("n", 2.0, 0.0, "1")]) == "n = 2"
    assert numbers_text([Quantity("d", 0.0123, 0.001, "s")]) == "d = 12.3 ± 2.0 ms (95 %)"


def test_a_mismatch_without_a_name_has_place_and_size() -> None:
    assert state_unknown("elbow", 0.3123, "Nm").text == (
        "A mismatch of 0.31 Nm rms at elbow has no known cause (100 %). Look at the residual where it concentrates."
    )
