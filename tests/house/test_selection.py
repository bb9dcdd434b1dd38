"""Every slow test is run after some change of the product, and every part of the product has its tests."""

import re
import subprocess
from pathlib import Path

import pytest

from selection import MARKS, NEEDED, find_changes, is_selected, select_tests
from shared_data import REPOSITORY

SLOW = re.compile(rf"mark\.(?:{'|'.join(MARKS)})\b")
NO_SLOW_TEST = {
    "tests/databases.py",  # marks a fixture of tests/server
    "tests/kills.py",  # marks series in other files
    "tests/house/test_standstill.py",  # writes tests with marks, and runs them
    "tests/house/test_selection.py",
}


def slow_test_files() -> list[str]:
    """Files with slow tests; a mark in a folder's conftest.py counts for all of the folder's tests."""
    marked = [path for path in (REPOSITORY / "tests").rglob("*.py") if SLOW.search(path.read_text(encoding="utf-8"))]
    return sorted({path.relative_to(REPOSITORY).as_posix() for path in marked} - NO_SLOW_TEST)


def product_parts() -> list[str]:
    """Folders of the product: the packages of `tauscope`, and the folders beside `service`."""
    packages = [path.parent for path in (REPOSITORY / "service" / "tauscope").glob("*/__init__.py")]
    names = [path.relative_to(REPOSITORY).as_posix() for path in packages]
    return [f"{name}/" for name in sorted([*names, "drivers", "sim_backend", "deploy"])]


@pytest.mark.parametrize("test_file", slow_test_files())
def test_every_slow_test_is_reached_by_a_change_of_the_product(test_file: str) -> None:
    assert any(is_selected(test_file, set(tests)) for tests in NEEDED.values())


@pytest.mark.parametrize("part", product_parts())
def test_every_part_of_the_product_is_placed(part: str) -> None:
    assert any(prefix.startswith(part) or part.startswith(prefix) for prefix in NEEDED)


def test_every_test_that_is_named_is_there() -> None:
    for test in {each for tests in NEEDED.values() for each in tests}:
        assert (REPOSITORY / test).exists(), test


@pytest.mark.parametrize(
    ("changed", "needed", "unneeded"),
    [
        ("drivers/tauscope_drivers/canopen/sdo.py", "tests/hardware_emulated/test_canopen_kill.py", "tests/diagnosis"),
        ("service/tauscope/runtime/guard.py", "tests/runtime/test_kill.py", "tests/diagnosis"),
        ("sim_backend/tauscope_sim/canopen_bus/bus.py", "tests/hardware_emulated", "tests/browser"),
        ("service/tauscope/diagnosis/fit.py", "tests/concealed/test_proof.py", "tests/hardware_emulated"),
        ("service/tauscope/effects/spring.py", "tests/diagnosis/test_springs.py", "tests/runtime/test_kill.py"),
        ("service/tauscope/server/store/index.py", "tests/reliability/test_fault_campaign.py", "tests/concealed"),
        ("deploy/systemd/tauscope.service", "tests/deploy/test_systemd_units.py", "tests/diagnosis"),
        ("tests/diagnosis/diagnosed_arm.py", "tests/diagnosis/test_springs.py", "tests/runtime/test_kill.py"),
        ("tests/diagnosis/test_fit.py", "tests/diagnosis/test_fit.py", "tests/diagnosis/test_springs.py"),
        (
            "tests/diagnosis/test_repetitions.py",
            "tests/diagnosis/test_lack_of_fit.py",
            "tests/diagnosis/test_springs.py",
        ),
        ("service/tauscope/library.py", "tests/examples/test_examples.py", "tests/diagnosis"),
    ],
)
def test_a_change_runs_the_slow_tests_of_its_neighbours(changed: str, needed: str, unneeded: str) -> None:
    selected = select_tests([changed])
    assert is_selected(needed, selected)
    assert not is_selected(unneeded, selected)


@pytest.mark.parametrize(
    "changed", ["pyproject.toml", "constraints.txt", ".ci/run", "Makefile", "tests/conftest.py", "service/new/part.py"]
)
def test_a_change_of_the_tools_or_of_an_unknown_place_runs_everything(changed: str) -> None:
    assert select_tests(["README.md", changed]) is None
    assert is_selected("tests/runtime/test_kill.py", None)


def test_changes_are_those_since_the_last_landing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def git(*words: str) -> None:
        who = ["-c", "user.name=n", "-c", "user.email=e"]
        subprocess.run(["git", *who, *words], cwd=tmp_path, check=True, capture_output=True)

    def commit(name: str, hour: int) -> None:
        (tmp_path / name).write_text(name)
        git("add", name)
        monkeypatch.setenv("GIT_COMMITTER_DATE", f"2026-01-01T{hour:02}:00:00Z")
        git("commit", "--message", name)

    assert find_changes(tmp_path) is None
    git("init", "--initial-branch", "main")
    commit("first", hour=1)
    assert find_changes(tmp_path) is None
    commit("second", hour=10)
    commit("part", hour=12)
    assert find_changes(tmp_path) == ["part", "second"]
    git("switch", "--create", "branch")
    commit("third", hour=13)
    git("mv", "first", "moved")
    (tmp_path / "new").write_text("new")
    assert find_changes(tmp_path) == ["first", "moved", "third", "new"]
