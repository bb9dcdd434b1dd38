"""Which slow tests a change needs: `NEEDED` maps a path that changed to the tests that guard it.

``pytest --changed-only`` compares the work tree with the merge base of the main branch, and runs what `NEEDED` names.
Without a base, or after a change of a path that no entry names, it runs everything.
"""

import subprocess
from collections.abc import Iterable
from functools import cache
from pathlib import Path

import pytest

REPOSITORY = Path(__file__).resolve().parents[1]

EMULATORS = ("tests/drivers", "tests/hardware_emulated", "tests/sim_backend")
KILLS = ("tests/runtime", "tests/hardware_emulated")
CAMPAIGNS = tuple(f"tests/hardware_emulated/test_{bus}_campaign.py" for bus in ("canopen", "dynamixel", "feetech"))
SERVICE = ("tests/server", "tests/reliability", "tests/browser", "tests/client")
QUICK_PROOF = (
    "tests/docs/test_readme.py",
    "tests/concealed/test_proof.py",
    "tests/concealed/baselines",
    "tests/concealed/publishing",
    "tests/concealed/test_reduced_bench.py",
    "tests/concealed/real",
)

NEEDED: dict[str, tuple[str, ...]] = {
    # moving the arm
    "drivers/": (*EMULATORS, *KILLS),
    "service/tauscope/runtime/": (*KILLS, "tests/drivers", "tests/cli"),
    "sim_backend/tauscope_sim/": (*EMULATORS, *KILLS, "tests/concealed/running", "tests/concealed/generator"),
    "sim_backend/tauscope_sim/effects/": ("tests/sim_backend", *QUICK_PROOF),
    # from recordings to models and findings
    "service/tauscope/robot/": ("tests/robot", "tests/identification", "tests/excitation"),
    "service/tauscope/recording/": ("tests/recording", "tests/identification"),
    "service/tauscope/dynamics/": ("tests/identification", "tests/diagnosis"),
    "service/tauscope/actuation/": ("tests/actuation",),
    "service/tauscope/trajectory/": ("tests/excitation", *CAMPAIGNS),
    "service/tauscope/excitation/": ("tests/excitation", "tests/diagnosis/test_next_experiment.py"),
    "service/tauscope/identification/": ("tests/identification", "tests/diagnosis", *QUICK_PROOF),
    "service/tauscope/effects/": ("tests/effects", "tests/diagnosis", *QUICK_PROOF),
    "service/tauscope/diagnosis/": ("tests/effects", "tests/diagnosis", "tests/report", *QUICK_PROOF),
    "service/tauscope/headroom/": ("tests/headroom",),
    "service/tauscope/export/": ("tests/identification", "tests/diagnosis/test_extended_model.py"),
    "service/tauscope/closed_loop/": ("tests/closed_loop",),
    "service/tauscope/number_text.py": ("tests/report",),
    "service/tauscope/report/": ("tests/report", "tests/browser/test_report_on_paper.py"),
    "service/tauscope/library.py": ("tests/library", "tests/examples"),
    "service/tauscope/results.py": ("tests/library", "tests/examples"),
    # serving it
    "service/tauscope/tasks/": (
        "tests/tasks",
        "tests/examples",
        "tests/cli",
        "tests/house/test_installation.py",
        "tests/server",
        "tests/hardware_emulated/test_canopen_campaign.py",
    ),
    "service/tauscope/cli/": ("tests/cli", "tests/hardware_emulated/test_canopen_commands.py"),
    "service/tauscope/client/": ("tests/client", "tests/server"),
    "service/tauscope/server/": SERVICE,
    "service/tauscope/server/page/": ("tests/browser",),
    "service/tauscope/server/history/": ("tests/server", "tests/browser/test_over_time.py"),
    "service/tauscope/server/schedules/": ("tests/server",),
    "deploy/": ("tests/deploy",),
    # words
    "docs/": ("tests/server/http/test_handbook.py",),
    "docs/examples/": ("tests/examples",),
    "typings/": (),
    "README.md": ("tests/docs/test_readme.py",),
    "CHANGELOG.md": (),
    "CONTRIBUTING.md": (),
    "CITATION.cff": (),
    "LICENSE": (),
}
"""Path prefix to test files and folders; the longest prefix of a path decides. A quick test is never deselected."""

SITTING_S = 4 * 3600
"""Longest time over which the commits of one landing are made [s]."""

OPTION = "--changed-only"
MARKS = ("slow", "system", "realtime", "proof")


def select_tests(changed: Iterable[str]) -> set[str] | None:
    """Test files and folders that these changed paths need; None means all of them."""
    selected: set[str] = set()
    for path in changed:
        prefix = max((each for each in NEEDED if path.startswith(each)), key=len, default=None)
        if prefix is not None:
            selected.update(NEEDED[prefix])
        elif path.startswith("tests/") and path.count("/") > 1:
            is_test = Path(path).name.startswith("test_")
            selected.update((path, *_test_files_that_import(path)) if is_test else ("/".join(path.split("/")[:2]),))
        else:
            return None
    return selected


def _test_files_that_import(path: str) -> list[str]:
    """Test files that take something from this one."""
    module = ".".join(Path(path).relative_to("tests").with_suffix("").parts)
    tests = REPOSITORY / "tests"
    importing = (each for each in tests.rglob("test_*.py") if f"from {module} import" in each.read_text("utf-8"))
    return [each.relative_to(REPOSITORY).as_posix() for each in importing]


def is_selected(test_file: str, selected: set[str] | None) -> bool:
    """Whether a test file, named from the repository's root, is one of these or lies in one of them."""
    return selected is None or any(test_file == each or test_file.startswith(f"{each}/") for each in selected)


def find_changes(repository: Path) -> list[str] | None:
    """Paths that differ from the merge base with the main branch, files of no commit included; None without a base.

    On the main branch itself the base is the newest commit that is `SITTING_S` older than the last one: what lands
    together was committed together.
    """
    head = _git(repository, "rev-parse", "HEAD")
    for main in ("origin/main", "main", "origin/master", "master"):
        base = _git(repository, "merge-base", "HEAD", main)
        if base and base == head:
            last = int(_git(repository, "log", "-1", "--format=%ct") or 0)
            base = _git(repository, "rev-list", "-1", f"--before={last - SITTING_S}", "HEAD")
        if base:
            break
    else:
        return None
    # Without --no-renames a moved file would be missing under its old name.
    tracked = _git(repository, "diff", "--name-only", "--no-renames", base)
    others = _git(repository, "ls-files", "--others", "--exclude-standard")
    return None if tracked is None or others is None else [*tracked.splitlines(), *others.splitlines()]


def _git(repository: Path, *words: str) -> str | None:
    try:
        done = subprocess.run(["git", *words], cwd=repository, check=False, capture_output=True, text=True)
    except FileNotFoundError:
        return None
    return done.stdout.strip() if done.returncode == 0 else None


@cache
def _selected_here() -> set[str] | None:
    changed = find_changes(REPOSITORY)
    return None if changed is None else select_tests(changed)


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption(OPTION, action="store_true", help="of the slow tests, run those that the change needs")


def pytest_report_header(config: pytest.Config) -> str | None:
    if not config.getoption(OPTION):
        return None
    selected = _selected_here()
    return f"slow tests for this change: {'all' if selected is None else ', '.join(sorted(selected)) or 'none'}"


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    if not config.getoption(OPTION):
        return
    selected = _selected_here()
    kept, dropped = [], []
    for item in items:
        is_slow = any(item.get_closest_marker(mark) for mark in MARKS)
        test_file = item.path.relative_to(REPOSITORY).as_posix()
        (kept if not is_slow or is_selected(test_file, selected) else dropped).append(item)
    if dropped:
        config.hook.pytest_deselected(items=dropped)
        items[:] = kept
