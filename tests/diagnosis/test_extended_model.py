"""The model with its findings: saved and read again, as code that is compiled and run, and in the simulated arm."""

import ctypes
import shutil
import subprocess
from dataclasses import replace
from datetime import UTC, datetime
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from diagnosis.diagnosed_arm import EffectTorque, at_joint, only_effects, recordings
from effects.piece_of_motion import SIGNALS, context
from identification.simulated import Array, SimulatedArm, paper_robot
from tauscope.diagnosis import Diagnosis, compare_with_saved, diagnose, document
from tauscope.diagnosis.extended_model import ModelDocument, _entry, _term, model_document, restore_model
from tauscope.diagnosis.model.extended import with_terms
from tauscope.diagnosis.model.residual import raw_squares
from tauscope.diagnosis.model.term import Term
from tauscope.effects import Effect, TimeLocalEffect, catalogue, possible_effects
from tauscope.errors import IdentificationError
from tauscope.export.extended_compensation import compensation_code
from tauscope.export.model_file import read_extended_model
from tauscope.export.simulation_files import improved_robot, scenario_text
from tauscope.recording import EffortKind
from tauscope.robot import read_robot
from tauscope_sim.examples import example_robot
from tauscope_sim.plant import Plant
from tauscope_sim.scenario_file import read_scenario, scenario_from_yaml

CODED = {effect.id for effect in catalogue() if effect.code}


def pulled(arm: SimulatedArm, rigid: Array) -> Array:
    """A cable at joint 1 and a cogging motor at joint 3, by formulas of their own."""
    q = arm.exact.exact.position
    cable = 6.0 * np.maximum(q[:, 0] - 0.3, 0.0) ** 1.5
    return at_joint(0, cable) + at_joint(2, 0.8 * np.sin(9.0 * q[:, 2] + 0.5))


@cache
def found(effect: EffectTorque = pulled) -> Diagnosis:
    return diagnose(paper_robot(), recordings((1, 2, 3), effect, np.random.default_rng(4)))


@cache
def sound() -> Diagnosis:
    with only_effects([]):
        return diagnose(paper_robot(), recordings((1,), None, np.random.default_rng(4)))


@cache
def forms() -> list[Effect]:
    return list(possible_effects(context()))


def terms(rng: np.random.Generator, ids: set[str]) -> list[Term]:
    """One form of each of these effects with a shape of its grid and some coefficients, at the paper arm's joints."""
    made: dict[str, Term] = {}
    for effect in forms():
        if effect.id in ids and effect.id not in made and effect.joint in (None, 1):
            coefficients = rng.uniform(0.1, 0.4, len(effect.coefficients))
            made[effect.id] = Term(effect, effect.grid[len(effect.grid) // 2], coefficients)
    assert set(made) == ids
    return list(made.values())


def test_every_form_of_every_effect_is_the_same_after_a_file() -> None:
    names = [joint.name for joint in SIGNALS.robot.joints]
    rng = np.random.default_rng(1)
    for effect in forms():
        shape = effect.grid[rng.integers(len(effect.grid))]
        term = Term(effect, shape, rng.standard_normal(len(effect.coefficients)))
        again = _term(type(_entry(term, names)).model_validate_json(_entry(term, names).model_dump_json()), names)
        for one, other in ((term, again),):
            columns = [each.effect.columns(SIGNALS, each.shape[None])[0] for each in (one, other)]
            torques = [np.tensordot(t.coefficients, c, axes=1) for t, c in zip((one, other), columns, strict=True)]
            np.testing.assert_array_equal(torques[0], torques[1], err_msg=effect.id)


@pytest.mark.slow
def test_a_saved_model_predicts_the_same_and_finds_nothing_missing_again(tmp_path: Path) -> None:
    names = {(finding.effect, finding.joint) for finding in document(found()).findings}
    assert names == {("cable_force", "joint1"), ("cogging", "joint3")}
    path = tmp_path / "model.json"
    path.write_text(model_document(found()).model_dump_json(by_alias=True))
    again = read_extended_model(path, paper_robot())
    observations = found().fitter.observations
    np.testing.assert_allclose(
        raw_squares(again, observations)[0], raw_squares(found().selection.fit.model, observations)[0], rtol=1e-12
    )
    compared = document(compare_with_saved(found(), again))
    assert not compared.findings
    assert not compared.parameter_differences
    assert compared.fit.train.rms_before == pytest.approx(compared.fit.train.rms_after)
    (cable,) = (each for each in again.terms if each.effect.id == "cable_force")
    (cogging,) = (each for each in again.terms if each.effect.id == "cogging")
    weaker = with_terms(again, [replace(cable, coefficients=0.5 * cable.coefficients)])
    told = document(compare_with_saved(found(), weaker))
    assert [(each.effect, each.joint) for each in told.findings] == [(cogging.effect.id, "joint3")]
    assert len(told.parameter_differences) == 1


def test_a_model_of_another_arm_or_of_nothing_is_refused_in_one_line(tmp_path: Path) -> None:
    plain = model_document(sound())
    with pytest.raises(IdentificationError, match="other joints or links"):
        restore_model(ModelDocument.model_validate(plain.model_dump(by_alias=True) | {"joints": ["a"]}), paper_robot())
    with pytest.raises(IdentificationError, match="covariance: is not square"):
        restore_model(
            ModelDocument.model_validate(plain.model_dump(by_alias=True) | {"covariance": [[1.0]]}), paper_robot()
        )
    path = tmp_path / "model.json"
    path.write_text('{"schema": "something/1"}')
    with pytest.raises(IdentificationError, match=r"model\.json") as refused:
        read_extended_model(path, paper_robot())
    assert "\n" not in str(refused.value)


def with_all(ids: set[str]) -> tuple[Diagnosis, list[Term]]:
    """The diagnosis of a sound arm as if it had found all of these."""
    added = terms(np.random.default_rng(2), ids)
    fit = sound().selection.fit
    selection = replace(sound().selection, fit=replace(fit, model=with_terms(fit.model, added)))
    return replace(sound(), selection=selection), added


def code(diagnosis: Diagnosis, suffix: str) -> str:
    given: dict[str, Any] = {"sources": [], "created": datetime(2026, 1, 1, tzinfo=UTC), "version": "0"}
    return compensation_code(diagnosis, suffix, effort_kind=EffortKind.TORQUE, **given)


def expected(diagnosis: Diagnosis, added: list[Term]) -> tuple[Array, Array, Array, Array]:
    """Instants of a recorded motion, and the effects' torque at joint 2 there by their columns."""
    model = diagnosis.selection.fit.model
    signals = model.signals(diagnosis.fitter.observations.pieces[0])
    rows = [model.term_torque(term, signals).reshape(-1, signals.position.shape[1])[0] for term in added]
    total = np.sum(rows, axis=0)
    picked = slice(None, None, 97)
    return signals.position[1, picked], signals.velocity[1, picked], signals.load[1, picked], total[picked]


def test_python_code_gives_the_torque_of_the_effects() -> None:
    diagnosis, added = with_all(CODED)
    space: dict[str, Any] = {}
    exec(code(diagnosis, ".py"), space)
    effect_torque = next(value for name, value in space.items() if name.endswith("_effect_torque"))
    for q, v, load, torque in zip(*expected(diagnosis, added), strict=True):
        assert effect_torque(2, q, v, load) == pytest.approx(torque, rel=1e-9, abs=1e-9)
        assert effect_torque(1, q, v, load) == 0.0


def test_code_gives_the_arms_own_torque_where_the_recorded_one_is_scaled() -> None:
    diagnosis, added = with_all({"cogging", "torque_gain_error"})
    teeth, scale = sorted(added, key=lambda term: term.effect.id)
    space: dict[str, Any] = {}
    exec(code(diagnosis, ".py"), space)
    effect_torque = next(value for name, value in space.items() if name.endswith("_effect_torque"))
    for q, v, load, torque in zip(*expected(diagnosis, [teeth]), strict=True):
        assert effect_torque(2, q, v, load) * (1.0 + scale.coefficients[0]) == pytest.approx(torque, rel=1e-9)


@pytest.mark.skipif(shutil.which("cc") is None, reason="needs a C compiler")
def test_c_code_compiles_without_warnings_and_gives_the_same(tmp_path: Path) -> None:
    diagnosis, added = with_all({*CODED, "time_delay"})
    added = [term for term in added if term.effect.id in CODED]
    text = code(diagnosis, ".h")
    assert "time_delay" in text  # said to be left out
    (tmp_path / "model.h").write_text(text)
    name = text.split("_effect_torque")[0].split()[-1]
    wrapper = '#include "model.h"\n'
    wrapper += f"double f(int j, double q, double v, double l) {{ return {name}_effect_torque(j, q, v, l); }}\n"
    (tmp_path / "model.c").write_text(wrapper)
    flags = ["-std=c99", "-Wall", "-Wextra", "-Werror", "-Wno-unused-function", "-fPIC", "-shared"]
    library = tmp_path / "model.so"
    subprocess.run(["cc", *flags, "-o", str(library), str(tmp_path / "model.c"), "-lm"], check=True, timeout=60)
    function = ctypes.CDLL(str(library)).f
    function.restype, function.argtypes = ctypes.c_double, [ctypes.c_int, *[ctypes.c_double] * 3]
    for q, v, load, torque in zip(*expected(diagnosis, added), strict=True):
        assert function(2, q, v, load) == pytest.approx(torque, rel=1e-9, abs=1e-9)


def test_a_scenario_can_say_every_effect_that_it_has_entries_for(tmp_path: Path) -> None:
    robot = tmp_path / "improved.yaml"
    robot.write_text(improved_robot(sound(), example_robot("paper_arm"), robot))
    arm = read_robot(robot)
    lasting = [each for each in catalogue() if each.screened and not issubclass(each, TimeLocalEffect)]
    said = {each.id for each in lasting if each.scenario_entries is not Effect.scenario_entries}
    diagnosis, _ = with_all(said)
    text = scenario_text(diagnosis)
    scenario = scenario_from_yaml(text.encode(), "scenario.yaml", arm)
    names = {effect.effect_id for effect in (*scenario.effects, *scenario.sensor_effects)}
    assert names >= said


SAMPLES, FINE = 400, 10


def followed(robot_file: Path, scenario_file: Path | None, arm: SimulatedArm, torque: Array) -> Array:
    """Positions of the arm under a recorded torque and a weak spring to the recorded motion, (N, n)."""
    robot = read_robot(robot_file)
    plant = Plant(robot, () if scenario_file is None else read_scenario(scenario_file, robot).effects)
    position, velocity = arm.exact.exact.position, arm.exact.exact.velocity
    plant.place(position[0])
    step = float(arm.exact.time[1] - arm.exact.time[0]) / FINE
    seen = []
    for sample in range(SAMPLES):
        seen.append(plant.state.link_position)
        for part in range(FINE):  # between samples straight lines, so that torque is not late by half of one
            share, state = (part + 0.5) / FINE, plant.state
            q, v, u = ((1.0 - share) * each[sample] + share * each[sample + 1] for each in (position, velocity, torque))
            plant.advance(u + 20.0 * (q - state.link_position) + 2.0 * (v - state.link_velocity), step)
    return np.array(seen)


@pytest.mark.slow
def test_the_simulated_motion_comes_closer_to_the_recorded_one(tmp_path: Path) -> None:
    """Four seconds of the recorded torque: the scenario leaves less than half of the error in position."""
    from diagnosis.diagnosed_arm import motions

    arm, rigid = motions((1, 2))[0]
    torque = arm.exact.torque_exact + pulled(arm, rigid)
    robot, scenario = tmp_path / "improved.yaml", tmp_path / "scenario.yaml"
    robot.write_text(improved_robot(found(), example_robot("paper_arm"), robot))
    scenario.write_text(scenario_text(found()))
    recorded = arm.exact.exact.position[:SAMPLES]
    errors = [
        np.sqrt(np.mean((followed(robot, each, arm, torque) - recorded) ** 2, axis=0)) for each in (None, scenario)
    ]
    assert errors[1].max() < 0.5 * errors[0].max()
