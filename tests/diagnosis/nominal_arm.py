"""The paper's arm with nothing missing: its white rows beside the nominal model, before any search."""

from dataclasses import replace
from functools import cache

import numpy as np

from diagnosis.diagnosed_arm import recordings
from identification.simulated import paper_robot
from tauscope.diagnosis.model.extended import ExtendedModel
from tauscope.diagnosis.model.nominal import delivered_model
from tauscope.diagnosis.noise.floor import with_pure_error
from tauscope.diagnosis.observations.observations import Observations
from tauscope.identification import Identification, identify
from tauscope.recording import Recording
from tauscope.recording.conditioning import Conditioner

CUTOFF_HZ = 8.0


def _record() -> list[Recording]:
    return recordings((1,), None, np.random.default_rng(3))


@cache
def identify_arm() -> Identification:
    """What the motion's recording says of the arm."""
    return identify(paper_robot(), _record())


@cache
def nominal_rows() -> tuple[Observations, ExtendedModel]:
    """Rows of one motion, whitened by what its two periods differ by."""
    identification = identify_arm()
    robot, model = identification.robot, delivered_model(identification)
    surveyed = [Conditioner.survey(each, robot) for each in _record()]
    bare = Observations.prepare(surveyed, robot, identification.structure.base, CUTOFF_HZ, model.steepness)
    known = with_pure_error(bare, model)
    assert known is not None
    return known, model


def stopping(rows: Observations, joint: int, *stops: slice) -> Observations:
    """The same as if a joint stood still in some rows of each period."""
    pieces = []
    for piece in rows:
        at_rest = np.zeros_like(piece.prepared.at_rest)
        for stop in stops:
            at_rest[joint, stop] = 1.0
        pieces.append(replace(piece, prepared=replace(piece.prepared, at_rest=at_rest)))
    return replace(rows, pieces=tuple(pieces))
