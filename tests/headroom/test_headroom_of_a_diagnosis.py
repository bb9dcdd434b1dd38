"""Headroom of a whole diagnosis: its rows, its floor, the document, the terminal and the report."""

from dataclasses import replace
from datetime import UTC, datetime

import numpy as np
import pytest
from rich.console import Console

import tauscope
from diagnosis.diagnosed_arm import recordings
from diagnosis.held_out_residual import squares
from diagnosis.test_diagnosis_of_simulated_arms import spring
from identification.simulated import PAPER_NOISE, paper_robot
from tauscope.cli.diagnose_command import show_diagnosis
from tauscope.diagnosis import Diagnosis, DiagnosisDocument, Verdict, document
from tauscope.diagnosis.documents.result import HeadroomEntry
from tauscope.errors import IdentificationError
from tauscope.headroom.entries import headroom_entry, leaves_open, motion_rows
from tauscope.headroom.floor import NoiseFloor, noise_above_band, noise_between_periods, noise_floors
from tauscope.headroom.joint_headroom import JointHeadroom
from tauscope.report.diagnosis_report import diagnosis_report
from tauscope.report.provenance import Provenance
from tauscope.results import DiagnosisResult

pytestmark = pytest.mark.slow

FOUND = JointHeadroom(plain=0.5, explained=0.4, black_box=0.375, share=0.12, share_std=0.02, blocks=20)
FLOOR = NoiseFloor(0.3, "repetitions")
SAID = "A black box still predicts 12 % of joint2's held-out residual: something is left."


@pytest.fixture(scope="module")
def result() -> DiagnosisResult:
    """The paper's arm with a spring at its first joint, one motion held out."""
    train, held_out = recordings((1, 2), spring, np.random.default_rng(5))
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("tauscope.headroom.learners.TREES", (5, 20))  # how much they learn is not asked here
        return tauscope.diagnose(paper_robot(), train, held_out, headroom=True)


@pytest.fixture(scope="module")
def found(result: DiagnosisResult) -> Diagnosis:
    return result.diagnosis


@pytest.fixture(scope="module")
def entries(result: DiagnosisResult) -> list[HeadroomEntry]:
    assert result.headroom is not None
    return result.headroom


def test_residuals_are_those_of_the_diagnosis_in_its_band(found: Diagnosis, entries: list[HeadroomEntry]) -> None:
    assert found.held_out is not None
    observations = found.held_out.observations
    rows = np.array([np.concatenate([piece.used[j].ravel() for piece in observations]).sum() for j in range(3)])
    for name, fit in (("plain", found.selection.nominal), ("explained", found.selection.fit)):
        left, _ = squares(fit.model, observations)
        np.testing.assert_allclose([getattr(entry, name) for entry in entries], np.sqrt(left / rows))


def test_a_model_with_all_that_is_there_is_not_refuted(entries: list[HeadroomEntry]) -> None:
    assert [entry.joint for entry in entries] == ["joint1", "joint2", "joint3"]
    assert not any(entry.refuted for entry in entries)
    assert entries[0].explained < 0.8 * entries[0].plain


def test_the_floor_is_told_by_repetitions_and_else_by_what_is_above_the_band(found: Diagnosis) -> None:
    assert [each.kind for each in noise_floors(found, motion_rows(found)[0])] == ["repetitions"] * 3
    observations, model = found.fitter.observations, found.selection.fit.model
    floors = [
        noise_between_periods(observations, model),
        noise_above_band(observations, model, found.cutoff_hz),
    ]
    band = observations.pieces[0].prepared.motion.band
    passed = np.sqrt(np.mean(band.reduce(np.random.default_rng(0).standard_normal((20, 2000))) ** 2))
    for each in floors:  # white noise: both know it
        np.testing.assert_allclose(each, passed * PAPER_NOISE, rtol=0.2)


def test_repeated_motion_has_the_same_progress(found: Diagnosis) -> None:
    training, held_out = motion_rows(found)
    (rows,) = training
    once = rows.time < 9.0
    later = np.interp(rows.time[once] + 10.0, rows.time, rows.progress)
    inside = (rows.progress[once] > 0.1) & (rows.progress[once] < 0.8)
    np.testing.assert_allclose(later[inside], rows.progress[once][inside], atol=0.02)
    assert all(each.progress.min() >= 0.0 and each.progress.max() < 1.0 for each in held_out)


def test_a_verdict_leaves_open_what_it_says_is_left(found: Diagnosis) -> None:
    assert leaves_open(found) == [
        found.verdict is Verdict.PARTLY_EXPLAINED and own for own in found.misfit_after.significant
    ]
    nothing = replace(found, findings=(), misfit_before=found.misfit_after)
    assert nothing.verdict in (Verdict.CONSISTENT, Verdict.INCONCLUSIVE, Verdict.UNEXPLAINED)


@pytest.mark.parametrize(
    ("changed", "is_open", "refuted", "words"),
    [
        ({}, False, True, SAID),
        ({}, True, False, "A black box still predicts 12 % of joint2's held-out residual; the verdict leaves it open."),
        ({"share": 0.04}, False, False, "A black box predicts no more of joint2's held-out residual."),
        ({"share_std": 0.07}, False, False, "A black box predicts no more of joint2's held-out residual."),
        ({"blocks": 3, "share_std": 0.03}, False, False, "A black box predicts no more of joint2's held-out residual."),
        ({"share": np.nan}, False, False, "The recordings hold too few rows of joint2 for a black box."),
    ],
)
def test_a_verdict_is_refuted_by_a_significant_share_alone(
    changed: dict[str, float], is_open: bool, refuted: bool, words: str
) -> None:
    entry = headroom_entry("joint2", replace(FOUND, **changed), FLOOR, is_open=is_open)
    assert (entry.refuted, entry.statement) == (refuted, words)


def test_the_document_holds_it_where_it_was_asked_for(found: Diagnosis, result: DiagnosisResult) -> None:
    told = result.document
    assert DiagnosisDocument.model_validate_json(told.model_dump_json(by_alias=True)) == told
    assert {"joint", "plain", "explained", "black_box", "floor", "floor_kind"} < result.to_dict()["headroom"][0].keys()
    assert document(found).headroom is None
    few = headroom_entry("joint2", replace(FOUND, black_box=np.nan, share=np.nan), FLOOR, is_open=False)
    assert (few.black_box, few.share) == (None, None)


def test_a_refutation_is_on_the_terminal_and_in_the_report(found: Diagnosis) -> None:
    told = document(found, headroom=[headroom_entry("joint2", FOUND, FLOOR, is_open=False)])
    console = Console(width=200, record=True)
    show_diagnosis(console, told)
    shown = console.export_text()
    assert SAID in shown
    assert "Headroom: held-out residual below" in shown
    page = diagnosis_report(found, told, Provenance((), (), (), datetime(2026, 11, 28, tzinfo=UTC)))
    assert page.count(SAID.replace("'", "&#39;")) == 2  # as a caution, and in its section
    assert '<section id="headroom"' in page


def test_without_it_nothing_is_shown(found: Diagnosis) -> None:
    console = Console(width=200, record=True)
    show_diagnosis(console, document(found))
    assert "Headroom" not in console.export_text()
    page = diagnosis_report(found, document(found), Provenance((), (), (), datetime(2026, 11, 28, tzinfo=UTC)))
    assert "headroom" not in page


def test_without_held_out_motion_it_is_refused_before_anything_is_done() -> None:
    train = recordings((1,), None, np.random.default_rng(5))
    with pytest.raises(IdentificationError, match="no recording is held out; name recordings of other motion"):
        tauscope.diagnose(paper_robot(), train, headroom=True)
