"""How long a fleet of recordings takes on one, two and four Dask workers: `--recordings 200 --workers 1 2 4`.

Each recording is one robot's: the paper's arm, simulated on the spot with noise of its own, two periods of ten seconds
at 100 Hz. The same list goes to each cluster in turn, as `tauscope fleet identify` gives it; workers are processes of
one thread. Times are those of one run on one machine: what counts are their ratios. The rows of the tables that come
out have to be the same.
"""

import argparse
import os
import sys
import tempfile
import time
import warnings
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from multiprocessing import get_context
from pathlib import Path

TESTS = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(TESTS)]
os.environ["PYTHONPATH"] = os.pathsep.join(sys.path[:2])  # the workers import what we do
os.environ.update(OMP_NUM_THREADS="1", OPENBLAS_NUM_THREADS="1")

from server.queue.paper_files import PAPER_ROBOT, write_recording  # noqa: E402
from tauscope.server.queue.cluster_executor import ClusterExecutor  # noqa: E402
from tauscope.server.queue.fleet import (  # noqa: E402
    FleetEntry,
    FleetResult,
    analyse_fleet,
    identify_robot,
)


def write_one(folder: Path, seed: int) -> Path:
    """A recording of its own."""
    return write_recording(folder / f"arm-{seed}.csv", seed=seed)


def recorded(folder: Path, count: int) -> list[FleetEntry]:
    """The fleet; its recordings are made on all processors."""
    with ProcessPoolExecutor(os.cpu_count(), get_context("spawn")) as makers:
        paths = list(makers.map(partial(write_one, folder), range(count)))
    return [FleetEntry(row, path.stem, PAPER_ROBOT, (path,), ()) for row, path in enumerate(paths, start=2)]


def analysed(entries: list[FleetEntry], folder: Path, workers: int) -> tuple[float, dict[str, FleetResult]]:
    """Seconds that a cluster takes, its start and the imports of its workers apart; and the results by name."""
    from distributed import LocalCluster

    cluster = LocalCluster(n_workers=workers, threads_per_worker=1, processes=True, dashboard_address="")
    with cluster:
        executor = ClusterExecutor(cluster.scheduler_address)
        try:
            cluster.wait_for_workers(workers)
            warm = [FleetEntry(0, f"warm-{number}", *_inputs(entries[0])) for number in range(4 * workers)]
            list(analyse_fleet(iter(warm), identify_robot, folder, executor, executor.width))
            begun = time.perf_counter()
            results = list(analyse_fleet(iter(entries), identify_robot, folder, executor, executor.width))
            return time.perf_counter() - begun, {result.entry.name: result for result in results}
        finally:
            executor.shutdown(cancel_futures=True)


def _inputs(entry: FleetEntry) -> tuple[Path, tuple[Path, ...], tuple[Path, ...]]:
    return entry.robot, entry.recordings, entry.held_out


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--recordings", type=int, default=200)
    parser.add_argument("--workers", type=int, nargs="+", default=[1, 2, 4])
    words = parser.parse_args()
    warnings.simplefilter("ignore")
    print(
        f"{words.recordings} recordings, {os.cpu_count()} processors, load {os.getloadavg()[0]:.1f} at the beginning\n"
    )
    print("| workers | time [s] | recordings a minute | times as quick | of a worker's time in the work | failed |")
    print("|---|---|---|---|---|---|")
    with tempfile.TemporaryDirectory(prefix="bench-") as folder:
        entries = recorded(Path(folder), words.recordings)
        first, figures = 0.0, None
        for workers in words.workers:
            out = Path(folder) / f"out-{workers}"
            out.mkdir()
            seconds, results = analysed(entries, out, workers)
            first = first or seconds
            failed = sum(result.error is not None for result in results.values())
            used = sum(result.seconds for result in results.values()) / (workers * seconds)
            speed = 60.0 * len(entries) / seconds
            print(
                f"| {workers} | {seconds:.1f} | {speed:.0f} | {first / seconds:.2f} | {used:.0%} | {failed} |",
                flush=True,
            )
            found = {name: result.figures for name, result in results.items()}
            if figures not in (None, found):
                raise SystemExit("the results depend on the number of workers")
            figures = found


if __name__ == "__main__":
    main()
