"""What is committed: nothing of one machine, locked versions, every package and every error page in its place."""

import re
import subprocess
import tomllib
from collections.abc import Iterator
from itertools import chain, pairwise
from pathlib import Path

import pytest
from ruamel.yaml import YAML

import tauscope.errors
from shared_data import REPOSITORY
from tauscope.server.problems import KINDS

PACKAGES = [
    *(f"service/tauscope/{name}" for name in ("robot", "recording", "dynamics", "trajectory", "excitation")),
    *(f"service/tauscope/{name}" for name in ("identification", "effects", "diagnosis", "export", "report", "runtime")),
    *(
        f"service/tauscope/server/{name}"
        for name in ("http", "auth", "queue", "control", "history", "schedules", "store")
    ),
    "drivers/tauscope_drivers",
    "sim_backend/tauscope_sim",
]
TOP_LEVEL = [
    *("pyproject.toml", "Makefile", ".ci/run"),
    *("README.md", "CHANGELOG.md", "CONTRIBUTING.md", "CITATION.cff", "LICENSE"),
]

# Written so that no pattern matches this file itself.
MACHINE_PATH = re.compile(r"(?<![\w.])/(?:wor[k]|roo[t]|opt/pyp[i])/")
REGISTRY = re.compile(r"(?:pyp[i]\.org|pythonhoste[d]\.org|registry\.npmj[s]\.org|deb\.debia[n]\.org|/simpl[e]/)")

CONSTRAINTS = ["constraints.txt", "constraints-dev.txt", "constraints-demo.txt"]
DEMO_EXTRAS = ["service", "hardware", "sim"]
REQUIREMENT = re.compile(r"^(?P<name>[a-z0-9-]+)==(?P<version>\S+)(?: ; (?P<marker>[^\\]+?))? \\$")
HASH = re.compile(r"^    --hash=sha256:[0-9a-f]{64}(?: \\)?$")


def committed_texts() -> Iterator[tuple[Path, str]]:
    """Every text file that git keeps, or would keep with the next commit."""
    if not (REPOSITORY / ".git").exists():
        pytest.skip("not a git work tree")
    listing = ["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard"]
    names = subprocess.run(listing, cwd=REPOSITORY, check=True, capture_output=True, text=True).stdout
    for name in filter(None, names.split("\0")):
        file = REPOSITORY / name
        if not file.is_file():
            continue
        try:
            yield Path(name), file.read_text(encoding="utf-8")
        except UnicodeDecodeError:
            continue


def locked(file: str) -> set[tuple[str, str, str]]:
    """Name, version and marker of each requirement of a constraints file."""
    lines = (REPOSITORY / file).read_text(encoding="utf-8").splitlines()
    found = (REQUIREMENT.match(line) for line in lines)
    return {(match["name"], match["version"], match["marker"] or "") for match in found if match}


def error_codes() -> list[str]:
    def leaves(error: type[tauscope.errors.TauscopeError]) -> Iterator[str]:
        for child in error.__subclasses__():
            if child.__module__ == tauscope.errors.__name__:
                yield child.code
                yield from leaves(child)

    return sorted(leaves(tauscope.errors.TauscopeError))


@pytest.mark.parametrize("pattern", [MACHINE_PATH, REGISTRY], ids=["machine path", "registry address"])
def test_nothing_of_one_machine_is_committed(pattern: re.Pattern[str]) -> None:
    hits = [
        f"{name}:{number}: {line.strip()[:100]}"
        for name, text in committed_texts()
        for number, line in enumerate(text.splitlines(), start=1)
        if pattern.search(line)
    ]
    assert not hits, "\n" + "\n".join(hits)


def test_the_patterns_find_what_they_are_for() -> None:
    assert MACHINE_PATH.search('path = "/wor' + 'k/main/x.csv"')
    assert not MACHINE_PATH.search("a frame/wor" + "k/pair")
    assert REGISTRY.search("--index-url https://pyp" + "i.org/simp" + "le")


@pytest.mark.parametrize("file", CONSTRAINTS)
def test_constraints_are_exact_versions_with_hashes_only(file: str) -> None:
    lines = (REPOSITORY / file).read_text(encoding="utf-8").splitlines()
    odd = [line for line in lines if not REQUIREMENT.match(line) and not HASH.match(line)]
    assert not odd, f"{file}: neither `name==version` nor a hash:\n" + "\n".join(odd)
    for line, following in pairwise([*lines, ""]):
        if REQUIREMENT.match(line):
            assert HASH.match(following), f"{file}: no hash below `{line}`"


def test_the_constraints_files_agree() -> None:
    assert locked("constraints.txt") <= locked("constraints-dev.txt")
    versions = {file: {(name, version) for name, version, _ in locked(file)} for file in CONSTRAINTS}
    assert versions["constraints-demo.txt"] < versions["constraints.txt"]  # markers follow from who needs a package


@pytest.mark.parametrize("file", CONSTRAINTS)
def test_every_dependency_is_locked(file: str) -> None:
    configuration = tomllib.loads((REPOSITORY / "pyproject.toml").read_text(encoding="utf-8"))
    project, groups = configuration["project"], configuration["dependency-groups"]
    extras = {name: needs for name, needs in project["optional-dependencies"].items() if name != "all"}
    chosen = DEMO_EXTRAS if file == "constraints-demo.txt" else list(extras)
    wanted = [*project["dependencies"], *chain(*(extras[name] for name in chosen)), *groups["build"]]
    if file == "constraints-dev.txt":
        wanted += [requirement for requirement in groups["dev"] if isinstance(requirement, str)]
    names = {re.split(r"[\[<>=!~; ]", requirement)[0].lower().replace(".", "-") for requirement in wanted}
    assert names <= {name for name, _, _ in locked(file)}, f"{file} is behind pyproject.toml: run `make lock`"


def test_the_citation_is_of_this_version() -> None:
    project = tomllib.loads((REPOSITORY / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    citation = YAML(typ="safe").load((REPOSITORY / "CITATION.cff").read_text(encoding="utf-8"))
    assert [citation[key] for key in ("version", "license")] == [project[key] for key in ("version", "license")]
    assert citation["references"][0]["journal"] == "Acta IMEKO"


@pytest.mark.parametrize("package", PACKAGES)
def test_every_package_stands_in_its_place(package: str) -> None:
    assert (REPOSITORY / package / "__init__.py").is_file()


@pytest.mark.parametrize("file", TOP_LEVEL)
def test_every_top_level_file_is_there(file: str) -> None:
    assert (REPOSITORY / file).read_text(encoding="utf-8").strip()


def all_codes() -> list[str]:
    """Codes of the error tree, and of what only the service meets."""
    return sorted({*error_codes(), *KINDS})


@pytest.mark.parametrize("code", all_codes())
def test_every_error_code_has_a_page(code: str) -> None:
    page = REPOSITORY / "docs" / "errors" / f"{code}.md"
    assert page.is_file(), f"write docs/errors/{code}.md: cause, example message, remedy"
    text = page.read_text(encoding="utf-8")
    for heading in (f"# `{code}`", "## What it means", "## Examples", "## What to do"):
        assert f"{heading}\n" in text, f"docs/errors/{code}.md has no heading `{heading}`"
    examples = text.split("## Examples\n")[1].split("## What to do\n")[0]
    assert re.fullmatch(r"```\n(?:(?!```|@@).+\n)+```\n\n", examples), f"docs/errors/{code}.md shows no example message"
    assert set(re.findall(r"HTTP status (\d{3})", text)) <= {str(int(KINDS[code].status))}


def test_no_page_of_a_code_that_is_gone() -> None:
    pages = {page.stem for page in (REPOSITORY / "docs" / "errors").glob("*.md")} - {"README"}
    assert pages == set(all_codes())


def test_every_error_code_is_listed_with_its_status() -> None:
    listing = (REPOSITORY / "docs" / "errors" / "README.md").read_text(encoding="utf-8")
    listed = re.findall(r"^\| \[`([a-z-]+)`\]\(([a-z-]+)\.md\) \| (\d{3}) \|", listing, flags=re.MULTILINE)
    assert listed == [(code, code, status) for code, _, status in listed]
    assert sorted((code, status) for code, _, status in listed) == sorted(
        (kind.code, str(int(kind.status))) for kind in KINDS.values()
    )


def test_error_codes_are_unique() -> None:
    assert len(error_codes()) == len(set(error_codes()))


def test_links_in_the_documentation_lead_somewhere() -> None:
    broken = [
        f"{name}: {target}"
        for name, text in committed_texts()
        if name.suffix == ".md"
        for target in re.findall(r"\]\(([^)#]+)[^)]*\)", text)
        if not target.startswith(("http://", "https://")) and not (REPOSITORY / name.parent / target).exists()
    ]
    assert not broken, "\n" + "\n".join(broken)


UNSAFE = re.compile(r"^\s*(?:import|from) (?:pickle|dill|shelve|marshal|joblib|cloudpickle)\b|allow_pickle=True", re.M)


def test_nothing_that_arrives_is_unpickled() -> None:
    sources = [path for name in ("service", "drivers", "sim_backend") for path in (REPOSITORY / name).rglob("*.py")]
    assert len(sources) > 300
    assert not [path for path in sources if UNSAFE.search(path.read_text(encoding="utf-8"))]
    assert UNSAFE.search("import pick" + "le\n")


NAMED_TEST = re.compile(r"`(tests/[\w/]+\.py)::(\w+)`")


def promises() -> list[str]:
    """Rows of the table of what is promised."""
    text = (REPOSITORY / "docs" / "reliability.md").read_text(encoding="utf-8")
    _, *rows = [line for line in text.split("\n## ")[0].splitlines() if line.startswith("| ")]
    return rows


def test_every_promise_names_a_test() -> None:
    assert len(promises()) > 25
    assert not [row for row in promises() if not NAMED_TEST.search(row.split(" | ")[-1])]


def test_every_test_that_a_promise_names_is_there() -> None:
    named = NAMED_TEST.findall("\n".join(promises()))
    assert len(named) > 60
    missing = [
        f"{file}::{test}"
        for file, test in named
        if not (REPOSITORY / file).is_file() or f"def {test}(" not in (REPOSITORY / file).read_text(encoding="utf-8")
    ]
    assert not missing
