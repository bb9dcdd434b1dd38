"""The result of an identification as tables and sentences on a terminal."""

from rich.console import Console

from tauscope.cli.terminal import plain, table
from tauscope.identification import IdentificationDocument
from tauscope.number_text import counted, percent, significant
from tauscope.report.table import Table
from tauscope.report.tables import base_parameter_table, fit_table, friction_table, rotor_table
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
