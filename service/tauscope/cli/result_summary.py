"""Results of identify, rollout and excite on the terminal."""

from rich.console import Console

from tauscope.cli.terminal import plain, table
from tauscope.closed_loop import RolloutDocument
from tauscope.closed_loop.tables import recording_table, refinement_table, rollout_sentences, summary_table
from tauscope.excitation import ExcitationDesign
from tauscope.identification import IdentificationDocument
from tauscope.number_text import ABSENT, counted, percent, significant
from tauscope.report.tables import Table, base_parameter_table, fit_table, friction_table, rotor_table
from tauscope.report.words import band_words, cautions, fit_sentences, masked_samples, noise_words
from tauscope.robot import Robot


def show_identification(console: Console, document: IdentificationDocument, robot: Robot) -> None:
    """Show parameters, friction, noise and fit."""
    console.print(
        plain(f"Robot {document.robot}: {counted(len(document.joints), 'joint')}, {document.estimator.upper()}")
    )
    for sentence in cautions(document):
        console.print(plain(f"! {sentence}"), soft_wrap=True)
    console.print(table("Base parameters", base_parameter_table(document)))
    if document.unidentifiable:
        names = ", ".join(document.unidentifiable)
        console.print(plain(f"No motion of this arm shows {names}"), soft_wrap=True)
        console.print()
    console.print(table("Friction [SI units]; in brackets: these data cannot tell", friction_table(document)))
    if document.rotor_inertia:
        console.print(table("Rotors", rotor_table(document)))
    console.print(table("Noise and residual", fit_table(document, robot)))
    console.print(table("Whole arm", _whole_arm(document)))
    for sentence in fit_sentences(document):
        console.print(plain(sentence), soft_wrap=True)


def _whole_arm(document: IdentificationDocument) -> Table:
    """What belongs to no single joint."""
    fit = document.fit
    entries = (*document.conditioning, *document.held_out_conditioning)
    rows = [
        ("relative error", percent(fit.train.relative_error)),
        ("relative error, held out", percent(fit.held_out.relative_error if fit.held_out else None)),
        ("condition number", significant(document.condition_number, 3)),
        ("band", band_words(document)),
        ("noise", noise_words(document.noise_method)),
        ("samples", str(sum(entry.samples for entry in entries))),
        ("masked samples", str(masked_samples(document))),
    ]
    return Table(("figure", "value"), rows, words=2)


def show_rollout(console: Console, document: RolloutDocument) -> None:
    """Show the errors of all models."""
    joints, recordings = len(document.joints), len(document.recordings)
    console.print(plain(f"Robot {document.robot}: {counted(joints, 'joint')}, {counted(recordings, 'recording')}"))
    for warning in document.warnings:
        console.print(plain(f"! {warning.sentence}"), soft_wrap=True)
    console.print(table("Position error, real against simulated motion", summary_table(document)))
    console.print(table("Error by time between restarts [mrad, mm]", recording_table(document)))
    if document.refinement is not None:
        console.print(table("Refined parameters", refinement_table(document.refinement)))
    for sentence in rollout_sentences(document):
        console.print(plain(sentence), soft_wrap=True)


CRITERIA = {"cond-f": "Cond_F(LᵀL)", "log-det": "-ln det(LᵀL)/p", "cond-2": "condition number of L"}


def show_design(console: Console, design: ExcitationDesign, robot: Robot) -> None:
    """Show what a design is good for, what it leaves of the limits, and what limits it."""
    trajectory = design.trajectory
    console.print(
        plain(
            f"Excitation of {robot.name}: {counted(robot.joint_count, 'joint')}, {counted(design.periods, 'period')} "
            f"of {design.series.period_s:.4g} s, {trajectory.duration_s:.4g} s in all"
        )
    )
    rows = [
        ("condition number", significant(design.condition_number, 4)),
        (CRITERIA[design.criterion.value], significant(design.value, 4)),
        ("  of the best random motion", significant(design.random_value, 4)),
        ("motions tried", str(design.evaluations)),
        ("seconds", significant(design.seconds, 3)),
    ]
    if design.margins.workspace_m is not None:
        rows.append(("clearance [m]", significant(design.margins.workspace_m, 3)))
    console.print(table("Design", Table(("figure", "value"), rows)))
    margins = design.margins.as_table()
    cells = [
        (joint.name, *(ABSENT if values[j] is None else percent(values[j]) for values in margins.values()))
        for j, joint in enumerate(robot.joints)
    ]
    console.print(table("Margins: part of each limit that is left", Table(("joint", *margins), cells)))
    if design.active:
        console.print(plain(f"Limited by {', '.join(design.active)}"), soft_wrap=True)
    for note in design.notes:
        console.print(plain(f"! {note}"), soft_wrap=True)
