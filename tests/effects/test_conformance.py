"""What every effect of the catalogue has to bring, plugins included: columns, bounds, words, code, scenario entries."""

import json
import math
import re
import shutil
import subprocess
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from effects.piece_of_motion import SIGNALS, Array, context
from tauscope.effects import Effect, Signals, catalogue, effect_class, possible_effects, registry
from tauscope.effects.effect import Coefficient, per_joint_columns
from tauscope.errors import IdentificationError
from tauscope.robot import LinkInertia, Robot
from tauscope.robot.robot import FrictionCoefficients, FrictionShape, Model
from tauscope_sim.scenario_file import scenario_from_yaml


class QuadraticSpring(Effect):
    """An effect as a plugin brings one: τ = k q |q|."""

    id = "quadratic_spring"
    arguments = frozenset({"position"})
    equation = "tau = k q |q|"
    meaning = "an elastic torque grows with the square of the angle"
    remedy = "add a quadratic spring to the joint"
    revealing_motion = "the joint's whole range"
    code = "{c[0]} * q * fabs(q)"
    no_scenario = "the simulated arm has no quadratic spring"
    coefficients = (Coefficient("k", "{tau}/{q}^2"),)

    def columns(self, signals: Signals, shapes: Array) -> Array:
        """The angle times its magnitude."""
        angle = signals.position[self.joint]
        return per_joint_columns((angle * np.abs(angle))[None, None])


EFFECTS = (*catalogue(), QuadraticSpring)
IN_CODE = [each for each in EFFECTS if each.code]
of_every_effect = pytest.mark.parametrize("kind", EFFECTS, ids=[each.id for each in EFFECTS])
K_V = float(SIGNALS.steepness[0])


def forms(kind: type[Effect]) -> Sequence[Effect]:
    """All forms on an arm that moves."""
    found = kind.forms(context())
    assert found
    return found


def sized(form: Effect) -> tuple[Array, Array]:
    """Coefficients within their bounds, and a shape of the grid."""
    sizes = [min(max(0.3, each.smallest), each.largest) for each in form.coefficients]
    return np.array(sizes), form.grid[len(form.grid) // 2]


@of_every_effect
def test_an_effect_states_its_law_and_its_words(kind: type[Effect]) -> None:
    assert re.fullmatch(r"[a-z]+(_[a-z]+)*", kind.id)
    assert [each.id for each in catalogue()].count(kind.id) == (kind is not QuadraticSpring)
    assert all([kind.equation, kind.meaning, kind.remedy, kind.revealing_motion, kind.coefficients])
    assert "\n" not in "".join([kind.equation, kind.meaning, kind.remedy, kind.revealing_motion])
    arguments = {"position", "velocity", "acceleration", "load", "time", "others"}
    assert kind.arguments is None or kind.arguments <= arguments


@of_every_effect
def test_columns_are_finite_and_shapes_lie_within_their_bounds(kind: type[Effect]) -> None:
    for form in forms(kind):
        count, samples = min(2, len(form.grid)), SIGNALS.position.shape[1]
        found = form.columns(SIGNALS, form.grid[:2])
        assert found.shape[:3] == (count, len(form.coefficients), len(form.touched(SIGNALS.robot.joint_count)))
        assert found.shape[3:] in ((samples,), (len(SIGNALS.time), samples))
        assert np.isfinite(found).all()
        assert form.grid.shape[1] == len(form.shapes) == len(form.lower) == len(form.upper)
        assert (form.grid >= form.lower - 1e-12).all()
        assert (form.grid <= form.upper + 1e-12).all()
        coefficients, shape = sized(form)
        covariance = np.eye(len(coefficients) + len(shape))
        for each in form.quantities(context(), coefficients, shape, covariance):
            assert np.isfinite([each.value, each.std]).all()
            assert "{" not in each.unit


@of_every_effect
def test_an_effect_has_code_or_a_reason_why_not(kind: type[Effect]) -> None:
    assert bool(kind.code) != bool(kind.no_code)


@pytest.mark.parametrize("kind", IN_CODE, ids=[each.id for each in IN_CODE])
def test_python_code_gives_the_torque_of_the_columns(kind: type[Effect]) -> None:
    names: dict[str, Any] = {name: getattr(math, name) for name in ("atan", "copysign", "cos", "exp", "fabs", "sin")}
    names |= {"pow": math.pow, "fmax": max}
    for form, code, states, expected in laws(kind):
        found = [eval(code, names, dict(zip(("q", "v", "load"), state, strict=True))) for state in states]
        np.testing.assert_allclose(found, expected, rtol=1e-9, atol=1e-9, err_msg=form.id)


@pytest.mark.skipif(shutil.which("cc") is None, reason="needs a C compiler")
def test_c_code_gives_the_torque_of_the_columns(tmp_path: Path) -> None:
    """All effects in one program: it prints the torque at every state."""
    lines, expected = ["#include <math.h>", "#include <stdio.h>", "int main(void) { double q, v, load;"], []
    for each in IN_CODE:
        for _, code, states, torques in laws(each):
            for state in states:
                lines.append("q = {!r}; v = {!r}; load = {!r}; (void)q; (void)v; (void)load;".format(*state))
                lines.append(f'printf("%.17g\\n", {code});')
            expected += torques.tolist()
    (tmp_path / "laws.c").write_text("\n".join([*lines, "return 0; }"]))
    flags = ["-std=c99", "-Wall", "-Wextra", "-Werror", "-o", str(tmp_path / "laws")]
    subprocess.run(["cc", *flags, str(tmp_path / "laws.c"), "-lm"], check=True, timeout=60)
    printed = subprocess.run([str(tmp_path / "laws")], check=True, timeout=60, capture_output=True, text=True).stdout
    np.testing.assert_allclose([float(each) for each in printed.split()], expected, rtol=1e-9, atol=1e-9)


def laws(kind: type[Effect]) -> Iterator[tuple[Effect, str, list[tuple[float, float, float]], Array]]:
    """Forms at the second joint, their code, some states (q, v, load), and the columns' torque there."""
    picked = slice(None, None, 397)
    rows = (each[1, picked].tolist() for each in (SIGNALS.position, SIGNALS.velocity, SIGNALS.load))
    states = list(zip(*rows, strict=True))
    for form in kind.forms(context()):
        if form.joint == 1:
            coefficients, shape = sized(form)
            torque = form.torque_of(SIGNALS, coefficients, shape)
            yield form, form.torque_code(coefficients.tolist(), shape.tolist(), K_V), states, torque[0, picked]


@of_every_effect
def test_a_scenario_takes_the_entries_of_an_effect_or_there_is_a_reason(kind: type[Effect]) -> None:
    arm, taken = described(SIGNALS.robot), 0
    for form in forms(kind):
        coefficients, _ = sized(form)
        place = {} if form.joint is None else {"joint": form.joint + 1}
        entries = [
            {"effect": form.id, **place, **entry}
            for shape in form.grid[:: max(1, len(form.grid) // 50)]
            for entry in form.scenario_entries(coefficients.tolist(), shape.tolist(), arm)
        ]
        for entry in entries[:3]:
            scenario_from_yaml(json.dumps({"effects": [entry]}).encode(), "scenario.yaml", arm)
        taken += len(entries)
    assert taken or kind.no_scenario


def described(robot: Robot) -> Robot:
    """The arm with links and friction in its file, which some entries of a scenario replace."""
    links = tuple(LinkInertia.from_vector(each) for each in SIGNALS.links.reshape(-1, 10))
    friction = tuple(FrictionCoefficients(2.0, -0.3, 0.5) for _ in robot.joints)
    joints = tuple(replace(each, friction_shape=FrictionShape(k_v=K_V, delta=10.0)) for each in robot.joints)
    return replace(robot, joints=joints, model=Model(links=links, friction=friction))


class EntryPoint:
    """An entry point of a plugin."""

    name, value = "quadratic", "plugin:QuadraticSpring"

    def __init__(self, loaded: Any) -> None:
        self.loaded = loaded

    def load(self) -> Any:
        if isinstance(self.loaded, Exception):
            raise self.loaded
        return self.loaded


@pytest.fixture
def plugged(monkeypatch: pytest.MonkeyPatch, request: pytest.FixtureRequest) -> Iterator[None]:
    """The catalogue with what a plugin brings."""
    monkeypatch.setattr(registry, "entry_points", lambda group: [EntryPoint(request.param)])
    catalogue.cache_clear()
    yield
    catalogue.cache_clear()


@pytest.mark.parametrize("plugged", [QuadraticSpring], indirect=True)
@pytest.mark.usefixtures("plugged")
def test_a_plugin_stands_behind_the_built_in_effects() -> None:
    assert catalogue()[-1] is effect_class("quadratic_spring") is QuadraticSpring
    assert sum(isinstance(each, QuadraticSpring) for each in possible_effects(context())) == SIGNALS.robot.joint_count


class SecondCogging(QuadraticSpring):
    """A plugin that takes an id of the catalogue."""

    id = "cogging"


@pytest.mark.parametrize(
    ("plugged", "reason"),
    [
        (dict, "is no subclass of Effect"),
        (ImportError("no module named x"), "cannot be loaded: no module named x"),
        (SecondCogging, "two effects have the id cogging"),
    ],
    indirect=["plugged"],
)
@pytest.mark.usefixtures("plugged")
def test_a_broken_plugin_is_told_by_its_name(reason: str) -> None:
    with pytest.raises(IdentificationError, match=reason):
        catalogue()
