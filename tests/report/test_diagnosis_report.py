"""The page of a diagnosis: the story in its order, every number where it belongs, deaf to hostile names."""

import re
from dataclasses import replace
from datetime import UTC, datetime

import numpy as np
import pytest

from diagnosis.diagnosed_arm import only_effects, recordings
from diagnosis.test_diagnosis_of_simulated_arms import spring
from excitation.excited_arms import short_search
from report.conftest import HOSTILE, JOINTS
from report.test_identification_report import LOADING, Reading
from shared_data import SHARED_DATA, needs_shared_data
from tauscope.diagnosis import Diagnosis, DiagnosisDocument, diagnose, document
from tauscope.diagnosis.next_experiment import PlannedExperiment, plan_experiment
from tauscope.recording import read_recording
from tauscope.report.diagnosis_report import diagnosis_report
from tauscope.report.provenance import InputFile, Provenance
from tauscope.report.words import doubts, summary_sentences
from tauscope.robot import Model, read_robot
from tauscope_sim.examples import example_robot

STORY = ["where", "what", "how-much", "proof", "next", "detectable", "reproduce"]
PROVENANCE = Provenance(
    ("tauscope", "diagnose", "robot.yaml", f"{HOSTILE}.csv"),
    (InputFile("recording", f"{HOSTILE}.csv", 12, "ab" * 32),),
    (("Python", "3.11"),),
    datetime(2026, 11, 22, tzinfo=UTC),
)


@pytest.fixture(scope="module")
def found() -> Diagnosis:
    """The paper's arm with a spring at its first joint, names that want to be HTML, one motion held out."""
    arm = read_robot(example_robot("paper_arm"))
    joints = tuple(replace(joint, name=name) for joint, name in zip(arm.joints, JOINTS, strict=True))
    robot = replace(arm, name=HOSTILE, joints=joints, model=Model())
    train, held_out = recordings((1, 2), spring, np.random.default_rng(5))
    with only_effects(["joint_spring"]):
        return diagnose(robot, [replace(train, name=f"{HOSTILE}.csv")], [held_out])


@pytest.fixture(scope="module")
def planned(found: Diagnosis) -> PlannedExperiment:
    with short_search():
        return plan_experiment(found)


@pytest.fixture(scope="module")
def told(found: Diagnosis, planned: PlannedExperiment) -> DiagnosisDocument:
    return document(found, planned, "next.json")


@pytest.fixture(scope="module")
def page(found: Diagnosis, told: DiagnosisDocument, planned: PlannedExperiment) -> str:
    return diagnosis_report(found, told, PROVENANCE, planned)


@pytest.fixture(scope="module")
def reading(page: str) -> Reading:
    return Reading(page)


def test_the_story_is_told_in_its_order(reading: Reading) -> None:
    sections = [value for tag, name, value in reading.attributes if tag == "section" and name == "id"]
    assert sections == ["result", *STORY]


def test_nothing_is_asked_of_any_network_and_nothing_runs(page: str, reading: Reading) -> None:
    assert re.findall(r"https?:|//[a-z]", page) == []
    assert [value for _, name, value in reading.attributes if name in LOADING and not value.startswith("#")] == []
    assert {"script", "img", "iframe", "object", "link", "b"}.isdisjoint(reading.tags)
    assert [name for _, name, _ in reading.attributes if name.startswith("on")] == []
    assert "<script" not in page
    assert "<img" not in page


def test_references_lead_somewhere_and_ids_are_unique(reading: Reading) -> None:
    ids = [value for _, name, value in reading.attributes if name == "id"]
    assert len(ids) == len(set(ids))
    assert {value[1:] for _, name, value in reading.attributes if name == "href"} <= set(ids)


def test_the_finding_is_stated_with_interval_and_evidence(reading: Reading, told: DiagnosisDocument) -> None:
    text = " ".join(reading.text)
    finding = told.findings[0]
    assert finding.effect == "joint_spring"
    assert finding.statement in text
    assert "Joint spring" in text
    assert told.headline in text
    assert f"confirmed: the rms of {JOINTS[0]} changes by -" in text
    assert "from differences between repeated periods" in text
    value = finding.parameters[0]
    shown = re.search(rf"([0-9.]+) ± ([0-9.]+) {re.escape(value.unit)} \(95 %\)", text)
    assert shown is not None
    assert float(shown[1]) == pytest.approx(value.value, abs=2.0 * value.std)
    assert float(shown[2]) == pytest.approx(1.96 * value.std, rel=0.1)


def test_every_joint_has_its_row_its_proof_and_its_numbers(reading: Reading) -> None:
    labels = [value for tag, name, value in reading.attributes if tag == "div" and name == "aria-label"]
    for joint in JOINTS:
        assert any(label.startswith(f"Torque of {joint}, measured and modelled") for label in labels)
        assert f"Numbers of {joint}" in reading.text
    text = "".join(reading.text)
    assert text.count("time,measured,before,after") == text.count("frequency,before,after,noise") == len(JOINTS)
    assert reading.tags.count("figure") == 2 + 1 + len(JOINTS) + 1


def test_hashes_and_the_command_are_there(reading: Reading) -> None:
    text = "".join(reading.text)
    assert "ab" * 32 in text
    assert "tauscope diagnose robot.yaml" in text
    assert "tauscope run ROBOT.yaml --trajectory next.json" in text


@pytest.mark.slow
def test_the_page_is_the_same_on_every_run(
    found: Diagnosis, told: DiagnosisDocument, planned: PlannedExperiment, page: str
) -> None:
    assert diagnosis_report(found, told, PROVENANCE, planned) == page


def test_a_sound_arm_has_a_page_too(found: Diagnosis, told: DiagnosisDocument, undrawn_figures: None) -> None:
    sound = told.model_copy(
        update={
            "headline": "Nothing but noise is left: the model explains the recordings.",
            "findings": [],
            "verdict": "consistent",
            "parameter_shifts": [],
            "next_experiment": None,
        }
    )
    text = "".join(Reading(diagnosis_report(found, sound, PROVENANCE)).text)
    assert "Nothing but noise is left" in text
    assert "No effect is named" in text
    assert "Nothing is open" in text


def test_five_findings_stand_before_the_fold_and_tentative_ones_within(
    found: Diagnosis, told: DiagnosisDocument, undrawn_figures: None
) -> None:
    (finding,) = told.findings
    refuted = finding.model_copy(update={"confirmed": False, "statement": "Only tentative."})
    many = told.model_copy(update={"findings": [finding] * 7, "tentative": [refuted]})
    what = diagnosis_report(found, many, PROVENANCE).split('<section id="what">')[1].split("</section>")[0]
    before, folded = what.split("<details>", 1)
    assert before.count("<article") == 5
    assert "2 more findings" in folded
    assert "Tentative: held-out motion does not confirm 1 effect<" in folded
    assert folded.count("<article") == 2 + 1
    assert "Only tentative." not in before


def test_joints_that_held_out_motion_shows_worse_are_named(told: DiagnosisDocument) -> None:
    held_out = told.fit.held_out
    assert held_out is not None
    assert "predicted worse" not in " ".join(summary_sentences(told))
    worse = held_out.model_copy(
        update={"rms_after": [held_out.rms_after[0], *(2.0 * r for r in held_out.rms_before[1:])]}
    )
    text = " ".join(summary_sentences(told.model_copy(update={"fit": told.fit.model_copy(update={"held_out": worse})})))
    assert f"It is predicted worse: the residual of {JOINTS[1]} goes from" in text


def test_what_a_reader_must_know_stands_first(found: Diagnosis, told: DiagnosisDocument) -> None:
    alike = told.findings[0].model_copy(update={"equivalent": ["cable_force"]})
    doubtful = told.model_copy(update={"findings": [alike], "fit": told.fit.model_copy(update={"held_out": None})})
    page = diagnosis_report(found, doubtful, PROVENANCE)
    for words in ("No recording was held out", "these data cannot tell it from cable_force"):
        assert any(words in each for each in doubts(doubtful))
        assert words in page
        assert not any(words in each for each in doubts(told))


@pytest.mark.proof
@needs_shared_data
def test_a_page_of_seven_joints_is_below_three_megabytes() -> None:
    folder = SHARED_DATA / "franka-panda"
    robot = read_robot(folder / "robot.yaml")
    train, held_out = (read_recording(folder / f"{name}-1.csv", 7) for name in ("train", "held-out"))
    diagnosis = diagnose(robot, [train], [held_out])
    assert len(diagnosis_report(diagnosis, document(diagnosis), PROVENANCE).encode()) < 3_000_000
