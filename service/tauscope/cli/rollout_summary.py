"""The result of a rollout on a terminal."""

from rich.console import Console

from tauscope.cli.terminal import plain, table
from tauscope.closed_loop import RolloutDocument
from tauscope.closed_loop.tables import recording_table, refinement_table, rollout_sentences, summary_table
from tauscope.number_text import counted


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
