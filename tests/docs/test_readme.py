"""The README: its example is what the program prints, it is short, and its links lead somewhere."""

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

from shared_data import REPOSITORY
from tauscope.runtime.record import child_environment

README = (REPOSITORY / "README.md").read_text(encoding="utf-8")
PAGES = sorted(
    page.relative_to(REPOSITORY).as_posix()
    for page in (*REPOSITORY.glob("*.md"), *REPOSITORY.glob("docs/**/*.md"), *REPOSITORY.glob("deploy/**/*.md"))
)
MOST_WORDS, MOST_COLUMNS = 900, 6


def section(heading: str) -> str:
    """Text of a section, up to the next heading."""
    return README.split(f"## {heading}\n")[1].split("\n## ")[0]


def blocks(text: str, language: str) -> list[str]:
    """Contents of the code blocks of a language."""
    return re.findall(rf"^```{language}\n(.*?)^```$", text, flags=re.MULTILINE | re.DOTALL)


def printed(command: str, folder: Path) -> list[str]:
    """Lines that a command prints, without blanks at their ends."""
    path = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
    environment = {**child_environment(), "PATH": path, "COLUMNS": "80"}
    done = subprocess.run(
        ["bash", "-c", command], cwd=folder, env=environment, capture_output=True, text=True, check=True
    )
    return [line.rstrip() for line in done.stdout.splitlines()]


@pytest.mark.slow
def test_the_example_is_what_the_program_prints(tmp_path: Path) -> None:
    (tmp_path / "sim_backend").symlink_to(REPOSITORY / "sim_backend")
    for command in blocks(section("Example"), "sh")[0].splitlines():
        printed(command, tmp_path)
    diagnose = blocks(README, "sh")[0].splitlines()[-1].split("#")[0]
    assert diagnose.startswith("tauscope diagnose ")
    found = printed(diagnose, tmp_path)
    shown = blocks(README, "text")[0].splitlines()
    table = shown.index("Residual at the recorded rate [Nm or N]")
    begin = found.index(shown[table])
    assert shown[:table] == found[:table]
    assert shown[table:] == found[begin : begin + len(shown) - table]


def test_it_is_short() -> None:
    assert len(README.split()) <= MOST_WORDS


def test_its_tables_are_narrow() -> None:
    rows = [line for line in README.splitlines() if line.startswith("|")]
    assert rows
    assert max(row.count("|") - 1 for row in rows) <= MOST_COLUMNS


def test_its_targets_and_files_are_there() -> None:
    targets = re.findall(r"^([a-z-]+):", (REPOSITORY / "Makefile").read_text(encoding="utf-8"), flags=re.MULTILINE)
    named = re.findall(r"(?:^|`|: )make ([a-z-]+)", README, flags=re.MULTILINE)
    assert {"demo", "prove", "bench"} <= set(named) <= set(targets)
    for path in re.findall(r"(?:tests|sim_backend)/[\w/.]+", README):
        assert (REPOSITORY / path).is_file(), path


@pytest.mark.parametrize("page", PAGES)
def test_links_lead_somewhere(page: str) -> None:
    file = REPOSITORY / page
    for target in re.findall(r"\]\(([^)\s]+)\)", file.read_text(encoding="utf-8")):
        path, _, anchor = target.partition("#")
        if re.match(r"\w+:", path):
            continue
        there = (file.parent / path) if path else file
        assert there.exists(), f"{page}: {target}"
        if anchor:
            assert anchor in anchors(there), f"{page}: {target}"


def anchors(page: Path) -> set[str]:
    """Names of a page's headings, as GitHub makes them."""
    headings = re.findall(r"^#+ (.+)$", page.read_text(encoding="utf-8"), flags=re.MULTILINE)
    return {re.sub(r"[^\w -]", "", heading).strip().lower().replace(" ", "-") for heading in headings}
