"""``tauscope fleet``: the manifest read, the work handed out, the table written row by row."""

import csv
import os
from pathlib import Path
from typing import Annotated, Literal

from typer import Argument, Option

from tauscope.cli.arguments import name_input
from tauscope.cli.task_run import require_new
from tauscope.cli.terminal import say, show_progress
from tauscope.cli.verbs import make_group
from tauscope.errors import ExportError, IdentificationError, explain_os_errors
from tauscope.number_text import counted
from tauscope.server.queue import fleet as fleets
from tauscope.server.queue.cluster_executor import ClusterExecutor, open_executor

TABLE = "table.csv"
# How long a robot waits for a cluster that is away, as when its scheduler is started anew [s].
CLUSTER_PATIENCE_S = 60.0
CORES = os.cpu_count() or 1

Manifest = Annotated[
    Path,
    name_input(
        "CSV with the columns name,robot,recordings,held_out; recordings separated by ';', paths relative to it.",
        "MANIFEST",
        Argument,
    ),
]
Out = Annotated[Path, Option(metavar="DIR", file_okay=False, help="Folder of table.csv, and NAME.json for each.")]
Workers = Annotated[
    int,
    Option(
        min=1, max=1024, metavar="N", help="Processes; a Dask cluster has its own (DASK_SCHEDULER_ADDRESS).",
        show_default="one a core",
    ),
]  # fmt: skip


def identify_fleet(manifest: Manifest, out: Out, workers: Workers = CORES) -> None:
    """Identify every robot of a manifest. A failure is a row of the table; exit status 1 where there is any."""
    run_fleet("identify", manifest, out, workers)


def diagnose_fleet(manifest: Manifest, out: Out, workers: Workers = CORES) -> None:
    """Diagnose every robot of a manifest. A failure is a row of the table; exit status 1 where there is any."""
    run_fleet("diagnose", manifest, out, workers)


def run_fleet(verb: Literal["identify", "diagnose"], manifest: Path, out: Path, workers: int) -> None:
    """Raises RecordingError for a bad manifest, ExportError for results, IdentificationError if any robot failed."""
    total = sum(1 for _ in fleets.read_manifest(manifest))
    with explain_os_errors(ExportError, f"{out}: cannot be made", "; choose another --out"):
        out.mkdir(parents=True, exist_ok=True)
    require_new(out / TABLE)
    failed = _run(verb, manifest, out.resolve(), workers, total)
    say(f"wrote {out / TABLE}: {counted(total, 'robot')}, {failed} failed")
    if failed:
        text = f"{manifest}: {failed} of {counted(total, 'robot')} failed; see the column error of {out / TABLE}"
        raise IdentificationError(text)


def _run(verb: str, manifest: Path, out: Path, workers: int, total: int) -> int:
    columns, work = (
        (fleets.IDENTIFICATION_COLUMNS, fleets.identify_robot)
        if verb == "identify"
        else (fleets.DIAGNOSIS_COLUMNS, fleets.diagnose_robot)
    )
    executor = open_executor(workers, CLUSTER_PATIENCE_S)
    width = executor.width if isinstance(executor, ClusterExecutor) else workers
    failed = done = 0
    try:
        with show_progress() as tell, (out / TABLE).open("x", newline="", encoding="utf-8") as file:
            table = csv.writer(file, lineterminator="\n")
            table.writerow(("line", "name", "state", *columns, "seconds", "error"))
            for result in fleets.analyse_fleet(fleets.read_manifest(manifest.resolve()), work, out, executor, width):
                table.writerow(_row(result, columns))
                file.flush()
                done, failed = done + 1, failed + (result.error is not None)
                tell(f"{verb} {result.entry.name}", 100.0 * done / total)
    finally:
        executor.shutdown(wait=True, cancel_futures=True)
    return failed


def _row(result: fleets.FleetResult, columns: tuple[str, ...]) -> list[str]:
    state = "succeeded" if result.error is None else "failed"
    figures = (result.figures.get(column, "") for column in columns)
    return [str(result.entry.row), result.entry.name, state, *figures, f"{result.seconds:.2f}", result.error or ""]


fleet = make_group(identify=identify_fleet, diagnose=diagnose_fleet)
