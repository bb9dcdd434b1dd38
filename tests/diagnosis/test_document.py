"""What a document says is so: what held-out motion refutes stands apart, and no impossible value stands as true."""

from dataclasses import replace

import numpy as np
import pytest

from diagnosis.diagnosed_arm import only_effects, recordings
from diagnosis.test_diagnosis_of_simulated_arms import spring
from tauscope.diagnosis import Diagnosis, Verdict, diagnose, document
from tauscope.diagnosis.documents.document import impossible_places
from tauscope.identification import document as identification_document
from tauscope.robot import Model, read_robot
from tauscope_sim.examples import example_robot


@pytest.fixture(scope="module")
def found() -> Diagnosis:
    """The paper's arm with a spring at its first joint, one motion held out."""
    robot = replace(read_robot(example_robot("paper_arm")), model=Model())
    train, held_out = recordings((1, 2), spring, np.random.default_rng(5))
    with only_effects(["joint_spring"]):
        return diagnose(robot, [train], [held_out])


@pytest.fixture(scope="module")
def refuted(found: Diagnosis) -> Diagnosis:
    """The same as if held-out motion had not shown the spring."""
    return replace(found, findings=(), tentative=found.findings)


def test_the_change_on_held_out_motion_is_that_of_the_table_beside_it(found: Diagnosis) -> None:
    (entry,) = document(found).findings
    assert entry.confirmed
    assert entry.held_out_change is not None
    assert entry.held_out_rms_before is not None
    assert entry.held_out_rms_after is not None
    table = np.array(entry.held_out_rms_after) / np.array(entry.held_out_rms_before) - 1.0
    assert entry.held_out_change.relative == pytest.approx(table, abs=1e-9)
    assert entry.held_out_change.std[0] is not None
    assert entry.held_out_change.relative[0] < -5.0 * entry.held_out_change.std[0]


def test_the_only_finding_explains_all_that_is_explained(found: Diagnosis) -> None:
    (entry,) = document(found).findings
    assert entry.share == pytest.approx(1.0, abs=0.02)


def test_the_headline_is_the_first_sentence_of_the_first_finding(found: Diagnosis) -> None:
    told = document(found)
    assert " Nm/rad spring is missing at joint1 (" in told.headline
    assert told.findings[0].statement.startswith(told.headline)


def test_a_tentative_finding_turns_no_verdict_and_advises_nothing(refuted: Diagnosis) -> None:
    assert refuted.verdict is Verdict.UNEXPLAINED
    told = document(refuted)
    assert {entry.effect for entry in told.findings} == {"unknown"}
    assert told.headline == "Something is missing that no effect of the catalogue explains."
    (entry,) = told.tentative
    assert (entry.effect, entry.confirmed) == ("joint_spring", False)
    assert "Held-out motion does not confirm it" in entry.statement
    assert "Add a spring" not in entry.statement


def test_what_is_tentative_is_open(refuted: Diagnosis) -> None:
    settled = replace(refuted, misfit_before=refuted.misfit_after)
    assert settled.verdict is Verdict.CONSISTENT
    wanted = document(settled).next_experiment
    assert wanted is not None
    assert wanted.separates == ["joint_spring@joint1"]


def test_a_finding_that_is_refuted_is_added_to_the_tentative_ones(found: Diagnosis) -> None:
    doubted = replace(found.findings[0], confirmed=False, gain=1.0)
    more = found.with_findings([doubted])
    assert more.findings == found.findings
    assert more.tentative == (doubted,)


def test_the_noise_is_known_from_where_identify_says(found: Diagnosis) -> None:
    told = document(replace(found, pure_error=not found.pure_error))
    assert told.noise_method == identification_document(found.identification).noise_method


def test_values_that_findings_made_impossible_are_no_shifts_but_a_warning(found: Diagnosis) -> None:
    fit = found.selection.fit
    structure, parameters = fit.model.structure, fit.model.parameters.copy()
    viscous = structure.coefficient(1, "viscous")
    assert viscous is not None
    parameters[viscous] = -5.0
    impossible = replace(fit, model=replace(fit.model, parameters=parameters))
    told = document(replace(found, selection=replace(found.selection, fit=impossible)))
    name = structure.names[viscous]
    assert name not in [entry.parameter for entry in told.parameter_shifts]
    (warning,) = [each for each in told.warnings if each.code == "impossible-value"]
    assert f"{name} = -5.0" in warning.text
    assert "impossible-value" not in [each.code for each in document(found).warnings]


def test_only_what_must_be_positive_is_impossible_below_zero(found: Diagnosis) -> None:
    structure = found.selection.fit.model.structure
    names = [structure.names[place] for place in impossible_places(structure, -np.ones(structure.size))]
    assert {"stiction joint1", "viscous joint3"} <= set(names)
    assert "offset joint1" not in names
    assert not [name for name in names if " - " in name or name.startswith("ms")]
