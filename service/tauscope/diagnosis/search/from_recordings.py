"""From an identification and its recordings to the effects that make them most probable.

It stands beside today's engine (`tauscope.diagnosis.selection`), which documents and verdicts still rest on.
"""

from collections.abc import Sequence

import numpy as np

from tauscope.diagnosis.evidence.rows import EvidenceRows
from tauscope.diagnosis.model.nominal import delivered_model, identified_rotors, setting_of
from tauscope.diagnosis.model.term import Term
from tauscope.diagnosis.noise.floor import band_share, white_noise, with_pure_error
from tauscope.diagnosis.observations.band import diagnosis_cutoff
from tauscope.diagnosis.observations.observations import Observations
from tauscope.diagnosis.search.held_out import HeldOut
from tauscope.diagnosis.search.hypothesis import Hypothesis, Laboratory, Prior
from tauscope.diagnosis.search.proposals import Proposer
from tauscope.diagnosis.search.search import Found, Search
from tauscope.effects import Effect, possible_effects
from tauscope.effects.rotor_inertia import RotorInertia
from tauscope.identification import Identification
from tauscope.recording.conditioning import Conditioner
from tauscope.recording.recording import Recording

ROTOR_SPREAD = 2.0
"""Standard deviation believed of a rotor that the identification found, relative to what it found."""


def search(
    identification: Identification, recordings: Sequence[Recording], held_out: Sequence[Recording] = ()
) -> Found:
    """The most probable effects beside what an identification delivers."""
    robot, base = identification.robot, identification.structure.base
    surveyed = [Conditioner.survey(recording, robot) for recording in recordings]
    unseen = [Conditioner.survey(recording, robot) for recording in held_out]
    model = delivered_model(identification)
    cutoff = diagnosis_cutoff(surveyed, identification, model.steepness)
    bare = Observations.prepare(surveyed, robot, base, cutoff, model.steepness)
    effects = possible_effects(setting_of(model, bare, surveyed, cutoff))
    white = bare.with_noise(white_noise(bare, model, band_share(bare)))
    rows = EvidenceRows.prepare(with_pure_error(bare, model) or white, model)
    laboratory = Laboratory(rows, Prior.of(identification, model))
    nominal = _with_rotors(laboratory.start(model), laboratory, identification, effects)
    confirming = None
    if unseen:
        prepared = Observations.prepare(unseen, robot, base, cutoff, model.steepness)
        confirming = HeldOut(prepared.with_noise(white_noise(prepared, model)))
    return Search(laboratory, Proposer(rows, effects), confirming).run(nominal)


def _with_rotors(
    nominal: Hypothesis, laboratory: Laboratory, identification: Identification, effects: Sequence[Effect]
) -> Hypothesis:
    """The nominal model with the rotors that the identification found: every geared joint has one."""
    of_joint = {effect.joint: effect for effect in effects if isinstance(effect, RotorInertia)}
    for joint, inertia in identified_rotors(identification).items():
        if joint in of_joint:
            term = Term(of_joint[joint], np.zeros(0), np.array([inertia]))
            nominal = laboratory.with_term(nominal, term, np.array([ROTOR_SPREAD * abs(inertia)]))
    return laboratory.settle(nominal, range(identification.robot.joint_count))
