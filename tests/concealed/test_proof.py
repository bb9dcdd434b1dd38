"""The whole way of `tauscope prove` on a set of one trial: sealed, diagnosed apart, kept, shown, not tried again."""

import json
import sys
from pathlib import Path

import pytest

from concealed import proof, sets

SEED = 2


@pytest.fixture
def one_trial(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sets, "REDUCED", {"sound": 1})
    monkeypatch.setattr(proof, "QUICK", ())
    monkeypatch.setattr(proof, "QUICK_CONCEALED", 0)


def prove(monkeypatch: pytest.MonkeyPatch, folder: Path) -> None:
    monkeypatch.setattr(sys, "argv", ["prove", "--out", str(folder), "--first-seed", str(SEED), "--jobs", "1"])
    proof.main()


@pytest.mark.slow
@pytest.mark.timeout(1200)
@pytest.mark.usefixtures("one_trial")
def test_one_trial_from_draw_to_page(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    prove(monkeypatch, tmp_path)
    (told,) = [json.loads(line) for line in (tmp_path / "outcomes.jsonl").read_text().splitlines()]
    assert "error" not in told
    printed = capfd.readouterr().out
    assert printed.index(f"sealed {told['name']} {told['seal']}") < printed.index(f"] {told['name']}")
    assert {"correlation", "bic", "sparse"} == set(told["baselines"])
    assert not told["score"]["claimed"]
    page = (tmp_path / "proof.md").read_text()
    assert "(0 of 1)" in page
    # As if the machine had stopped in the middle of the next line: what is whole counts, and nothing is tried again.
    with (tmp_path / "outcomes.jsonl").open("a") as file:
        file.write('{"series": "sou')
    prove(monkeypatch, tmp_path)
    again = capfd.readouterr().out
    assert "was torn" in again
    assert "sealed" not in again
    assert (tmp_path / "proof.md").read_text() == page


@pytest.mark.parametrize(
    ("words", "until"),
    [([], 360.0), (["--minutes", "2"], 120.0), (["--full"], None), (["--full", "--minutes", "2"], 120.0)],
)
def test_only_the_reduced_set_ends_by_itself(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, words: list[str], until: float | None
) -> None:
    asked: list[float | None] = []

    def run(*_: object, until: float | None) -> int:
        asked.append(until)
        return 0

    monkeypatch.setattr(proof, "run", run)
    monkeypatch.setattr(sys, "argv", ["prove", "--out", str(tmp_path), "--jobs", "1", *words])
    proof.main()
    assert asked == [until]


@pytest.mark.usefixtures("one_trial")
def test_what_is_no_outcome_ends_in_one_line(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "outcomes.jsonl").write_text("nonsense\n")
    with pytest.raises(SystemExit, match=r"^tauscope prove: .*outcomes\.jsonl, line 1: no outcome of a trial"):
        prove(monkeypatch, tmp_path)
