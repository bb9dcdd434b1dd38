"""What is installed: the wheel's packages, the core without its extras, and what the core verbs load."""

import json
import subprocess
import sys
import tomllib
import zipfile
from pathlib import Path
from typing import Any

import pytest
from hatchling.builders.wheel import WheelBuilder

from cli.simulated_files import SimulatedFiles, write_files
from shared_data import REPOSITORY
from tauscope.errors import MissingExtraError
from tauscope.extras import EXTRAS, POSIX_ONLY, require_extra

PACKAGES = {
    "tauscope": REPOSITORY / "service/tauscope",
    "tauscope_drivers": REPOSITORY / "drivers/tauscope_drivers",
    "tauscope_sim": REPOSITORY / "sim_backend/tauscope_sim",
}
ABSENT = [module for modules in EXTRAS.values() for module in modules]
FOREIGN = ["tauscope.server", "tauscope.runtime", "tauscope.headroom", "tauscope_drivers", "tauscope_sim"]

CHILD = """
import contextlib, io, json, sys
blocked, commands = json.loads(sys.stdin.read())
sys.modules.update(dict.fromkeys(blocked))
from tauscope.cli import main
from tauscope.diagnosis.search import from_recordings
possible_effects = from_recordings.possible_effects
from_recordings.possible_effects = lambda context: [each for each in possible_effects(context) if each.id == "cogging"]
from_recordings.farther_effects = lambda _: []
ended = []
for words in commands:
    err = io.StringIO()
    with contextlib.redirect_stderr(err), contextlib.redirect_stdout(io.StringIO()):
        ended.append([main(words)])
    ended[-1].append(err.getvalue())
print(json.dumps([ended, [name for name, module in sys.modules.items() if module is not None]]))
"""


def run_without(blocked: list[str], commands: list[list[str]], folder: Path) -> tuple[list[Any], list[str]]:
    """How each command ends, and the modules that are loaded after all of them."""
    child = subprocess.run(
        [sys.executable, "-c", CHILD],
        input=json.dumps([blocked, commands]),
        cwd=folder,
        check=False,
        capture_output=True,
        text=True,
    )
    assert child.returncode == 0, child.stderr
    ended, modules = json.loads(child.stdout)
    return ended, modules


@pytest.fixture(scope="module")
def arm(tmp_path_factory: pytest.TempPathFactory) -> SimulatedFiles:
    return write_files(tmp_path_factory.mktemp("arm"))


@pytest.fixture(scope="module")
def core(arm: SimulatedFiles) -> tuple[Path, list[Any], list[str]]:
    """The core verbs in one process without extras and without the modules that only POSIX systems have."""
    folder = arm.robot.parent
    robot, train, held_out = (str(path) for path in (arm.robot, arm.train[0], arm.held_out[0]))
    identify = ["identify", robot, train, "--held-out", held_out, "--json", "i.json", "--report", "i.html"]
    diagnose = ["diagnose", robot, train, "--held-out", held_out, "--json", "d.json", "--report", "d.html"]
    excite = ["excite", robot, "--duration", "2", "--harmonics", "2", "--no-slow-reversals", "--csv", "e.csv"]
    exports = ("i.h", "i.py", "i.xml", "i.yaml")
    commands = [
        ["--help"],
        [*identify, *(word for name in exports for word in ("--export", name))],
        [*diagnose, "--model", "m.json", "--export", "d.h"],
        excite,
    ]
    return (folder, *run_without([*ABSENT, *POSIX_ONLY], commands, folder))


def test_the_wheel_holds_three_packages_and_all_of_them(tmp_path: Path) -> None:
    (wheel,) = WheelBuilder(str(REPOSITORY)).build(directory=str(tmp_path), versions=["standard"])
    with zipfile.ZipFile(wheel) as file:
        names = set(file.namelist())
    assert {name.partition("/")[0] for name in names if ".dist-info/" not in name} == set(PACKAGES)
    ours = {
        f"{package}/{path.relative_to(folder).as_posix()}"
        for package, folder in PACKAGES.items()
        for path in folder.rglob("*")
        if path.is_file() and "__pycache__" not in path.parts
    }
    assert ours <= names


@pytest.mark.slow
def test_the_core_answers_without_extras_and_without_posix(core: tuple[Path, list[Any], list[str]]) -> None:
    folder, ended, _ = core
    assert [status for status, _ in ended] == [0, 0, 0, 0], ended
    for name in ("i.json", "i.html", "i.h", "i.py", "i.xml", "i.yaml", "d.json", "d.html", "m.json", "d.h", "e.csv"):
        assert (folder / name).stat().st_size > 0


@pytest.mark.slow
def test_core_verbs_load_nothing_of_server_hardware_simulator_and_black_box(
    core: tuple[Path, list[Any], list[str]],
) -> None:
    loaded = [name for name in core[2] if name.startswith(tuple(FOREIGN))]
    assert not loaded


def test_a_missing_extra_is_one_line(arm: SimulatedFiles) -> None:
    wanted = {
        "serve": (["serve"], "service"),
        "store": (["store", "check"], "service"),
        "key": (["key", "list"], "service"),
        "doctor": (["doctor", "--backend", "dynamixel"], "hardware"),
        "diagnose --headroom": (["diagnose", str(arm.robot), str(arm.train[0]), "--headroom"], "headroom"),
    }
    ended, _ = run_without(ABSENT, [words for words, _ in wanted.values()], arm.robot.parent)
    for (verb, (_, extra)), (status, err) in zip(wanted.items(), ended, strict=True):
        assert (status, err) == (1, f"tauscope {verb} needs the {extra} extra: pip install 'tauscope[{extra}]'\n")


def test_moving_and_serving_name_the_system_that_they_need(arm: SimulatedFiles) -> None:
    verbs = {"run": ["run", str(arm.robot)], "serve": ["serve", "--port", "0"]}
    ended, _ = run_without([*POSIX_ONLY], list(verbs.values()), arm.robot.parent)
    for verb, (status, err) in zip(verbs, ended, strict=True):
        reason = "moving arms and serving need a POSIX system, such as Linux"
        assert (status, err) == (1, f"tauscope {verb} cannot run on this system: {reason}\n")


def test_any_other_missing_module_stays_a_fault() -> None:
    with pytest.raises(ModuleNotFoundError) as caught, require_extra("this"):
        raise ModuleNotFoundError("no", name="tauscope.gone")
    assert not isinstance(caught.value, MissingExtraError)


def test_extras_are_those_of_the_project() -> None:
    project = tomllib.loads((REPOSITORY / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    assert {*EXTRAS, "all"} == set(project["optional-dependencies"])


def test_a_backend_names_the_extra_that_it_needs(arm: SimulatedFiles, monkeypatch: pytest.MonkeyPatch) -> None:
    from tauscope.robot import read_robot
    from tauscope.runtime.drivers import make_backend

    monkeypatch.setitem(sys.modules, "mujoco", None)
    for loaded in [name for name in sys.modules if name.startswith("tauscope_sim.")]:
        monkeypatch.delitem(sys.modules, loaded)
    with pytest.raises(MissingExtraError, match=r"^backend sim needs the sim extra: pip install 'tauscope\[sim\]'$"):
        make_backend("sim", read_robot(arm.robot), {})
