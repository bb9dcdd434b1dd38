"""A model without missing physics but with wrong numbers: which links and joints have them."""

from collections.abc import Callable
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from diagnosis.diagnosed_arm import recordings
from diagnosis.loaded_arm import carrying
from identification.simulated import Array, paper_robot
from tauscope.diagnosis import Diagnosis, DiagnosisDocument, against_model, against_simulation, diagnose, document
from tauscope.identification import Options
from tauscope.robot import LinkInertia, Robot

SEEDS = (1, 2, 3)


@cache
def sound() -> Diagnosis:
    """Of an arm that lacks nothing."""
    return diagnose(paper_robot(), recordings(SEEDS, None, np.random.default_rng(8)))


def compared(robot: Robot) -> DiagnosisDocument:
    """The same with another robot file."""
    found = sound()
    return document(against_model(replace(found, identification=replace(found.identification, robot=robot))))


def with_link(number: int, change: Callable[[LinkInertia], LinkInertia]) -> Robot:
    """The paper's arm as a robot file states it with one link wrong."""
    robot = paper_robot()
    assert robot.model.links is not None
    links = list(robot.model.links)
    links[number - 1] = change(links[number - 1])
    return replace(robot, model=replace(robot.model, links=tuple(links)))


def with_viscous(joint: int, value: float) -> Robot:
    robot = paper_robot()
    assert robot.model.friction is not None
    friction = list(robot.model.friction)
    friction[joint] = replace(friction[joint], viscous=value)
    return replace(robot, model=replace(robot.model, friction=tuple(friction)))


def scaled(factor: float) -> Callable[[LinkInertia], LinkInertia]:
    return lambda link: LinkInertia.from_vector(factor * link.to_vector())


def shifted(by: Array) -> Callable[[LinkInertia], LinkInertia]:
    """The same body about another centre of mass, by the parallel-axis theorem written out."""

    def about(centre: Array, mass: float) -> Array:
        return mass * (centre @ centre * np.eye(3) - np.outer(centre, centre))

    def change(link: LinkInertia) -> LinkInertia:
        centre = link.first_moment / link.mass
        central = link.inertia - about(centre, link.mass)
        return LinkInertia(link.mass, link.mass * (centre + by), central + about(centre + by, link.mass))

    return change


def causes(found: DiagnosisDocument) -> set[tuple[int | str | None, str]]:
    return {
        (cause.link or cause.joint, cause.quantity)
        for entry in found.parameter_differences
        for cause in entry.explained_by
    }

if __name__ == "__main__":
    robots = {"right": paper_robot(), "scaled3": with_link(3, scaled(0.7)), "scaled2": with_link(2, scaled(1.4)),
      "viscous2": with_viscous(1, 0.1), "shift3": with_link(3, shifted(np.array([0.06, 0.0, 0.0]))),"shift2": with_link(2, shifted(np.array([0.06, 0.05, 0.0]))),
      "payload": None, "heavier3": with_link(3, scaled(1.3)), "massonly": with_link(3, lambda l: replace(l, mass=1.0)),
      "both": replace(with_link(3, scaled(.7)), model=replace(with_link(3, scaled(.7)).model, friction=with_viscous(1,.1).model.friction))}
    import time
    sound()
    for name, robot in robots.items():
        if robot is None: continue
        t=time.time(); f=compared(robot)
        print("==",name,f.verdict,round(time.time()-t,2),[x.effect for x in f.findings], f.next_experiment)
        for s in f.wrong_values: print("   ",s)
        for d in f.parameter_differences: print("      ",d.parameter,round(d.difference_in_std,1),[(c.link or c.joint,c.quantity) for c in d.explained_by])
