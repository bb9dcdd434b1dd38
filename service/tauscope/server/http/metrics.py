"""Prometheus metrics: requests, jobs, runs, lateness of the control loops, and drift of models."""

import math
import threading
import time
from collections import Counter as Tally
from collections.abc import Callable, Iterable, Iterator, Mapping
from concurrent.futures import Executor, Future
from functools import partial
from itertools import accumulate
from typing import Any

from prometheus_client import CollectorRegistry, Counter, Gauge, Histogram, generate_latest
from prometheus_client.core import CounterMetricFamily, GaugeMetricFamily, HistogramMetricFamily, Metric
from prometheus_client.registry import Collector

from tauscope.runtime.record import RunRecord
from tauscope.server.control.run_manager import Live
from tauscope.server.history.model_registry import DriftMonitor

CONTENT_TYPE = "text/plain; version=0.0.4; charset=utf-8"
_JOB_BUCKETS_S = (0.1, 0.5, 1, 5, 10, 30, 60, 120, 300, 600, 1800, 3600)


class Metrics:
    """All counters of one service; each application has its own registry."""

    def __init__(self) -> None:
        self.registry = CollectorRegistry()
        self.loops = LoopTimes()
        self.registry.register(self.loops)
        self.requests = Counter("tauscope_requests", "Requests", ["method", "route", "status"], registry=self.registry)
        self.request_seconds = Histogram(
            "tauscope_request_seconds", "Time to the answer", ["method", "route"], registry=self.registry
        )
        self.job_seconds = Histogram(
            "tauscope_job_seconds",
            "Time in the executor, by kind of work and outcome",
            ["kind", "outcome"],
            buckets=_JOB_BUCKETS_S,
            registry=self.registry,
        )
        self.runs = Counter("tauscope_runs_ended", "Runs by backend, end", ["backend", "end"], registry=self.registry)

    def run_ended(self, record: RunRecord) -> None:
        self.runs.labels(record.backend, record.state.value).inc()
        self.loops.add(record)

    def watch(self, name: str, text: str, value: Callable[[], float]) -> None:
        """Have a number asked for whenever somebody looks; NaN where that fails."""

        def ask() -> float:
            try:
                return value()
            except OSError:
                return float("nan")

        Gauge(name, text, registry=self.registry).set_function(ask)

    def watch_readiness(self, checks: Mapping[str, Callable[[], str | None]]) -> None:
        gauge = Gauge("tauscope_ready", "Whether a part can work: 1, or 0", ["part"], registry=self.registry)
        for part, check in checks.items():
            gauge.labels(part).set_function(lambda check=check: float(check() is None))

    def text(self) -> bytes:
        return generate_latest(self.registry)


class LoopTimes(Collector):
    """How late the cycles of the control loops were: whole runs when they have ended, and what goes on now."""

    def __init__(self) -> None:
        self.live: Callable[[], Iterable[Live]] = tuple
        self._lock = threading.Lock()
        self._late: dict[str, Tally[float]] = {}
        self._missed: Tally[str] = Tally()
        self._stale: Tally[str] = Tally()

    def add(self, record: RunRecord) -> None:
        if record.timing is None:
            return
        with self._lock:
            late = self._late.setdefault(record.backend, Tally())
            for edge_us, count in record.timing.histogram_us:
                late[float("inf") if edge_us is None else edge_us / 1e6] += count
            self._missed[record.backend] += record.timing.missed_periods
            self._stale[record.backend] += sum(record.timing.stale_samples)

    def collect(self) -> Iterator[Metric]:
        histogram = HistogramMetricFamily(
            "tauscope_loop_lateness_seconds", "Lateness of control cycles behind their deadlines", labels=["backend"]
        )
        missed = CounterMetricFamily("tauscope_missed_periods", "Cycles left out for lateness", labels=["backend"])
        stale = CounterMetricFamily("tauscope_stale_samples", "Readings that did not come in time", labels=["backend"])
        with self._lock:
            for backend, late in self._late.items():
                histogram.add_metric([backend], _cumulative(late), None)
                missed.add_metric([backend], self._missed[backend])
                stale.add_metric([backend], self._stale[backend])
        recent = GaugeMetricFamily(
            "tauscope_loop_lateness_recent_seconds", "The same of the last second", labels=["quantile"]
        )
        lives = list(self.live())
        figures = [live.figures.get("lateness_us") for live in lives]
        for quantile in ("p50", "p99", "max"):
            values = [each[quantile] * 1e-6 for each in figures if isinstance(each, dict) and quantile in each]
            if values:
                recent.add_metric([quantile], max(values))
        moving = GaugeMetricFamily("tauscope_runs_active", "Runs that go on", labels=["state"])
        for state, count in Tally(live.state.value for live in lives).items():
            moving.add_metric([state], count)
        yield from (histogram, missed, stale, recent, moving)


class ModelDrift(Collector):
    """How far each robot's active model is from the one that drift is counted from; a series a parameter."""

    def __init__(self, watch: DriftMonitor) -> None:
        self._watch = watch

    def collect(self) -> Iterator[Metric]:
        labels = ["robot", "parameter"]
        share = GaugeMetricFamily(
            "tauscope_model_drift_ratio", "Change of a parameter, in parts of its reference", labels=labels
        )
        errors = GaugeMetricFamily("tauscope_model_drift_standard_errors", "The same in standard errors", labels=labels)
        events = GaugeMetricFamily("tauscope_model_drift_events", "Open drifts beyond their bounds", labels=["robot"])
        for robot, found in self._watch.robots.items():
            events.add_metric([robot], found.open_events)
            for drift in found.drifts:
                share.add_metric([robot, drift.name], drift.share)
                errors.add_metric([robot, drift.name], drift.in_std)
        yield from (share, errors, events)


class TimedExecutor(Executor):
    def __init__(self, executor: Executor, seconds: Histogram) -> None:
        self._executor, self._seconds = executor, seconds

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> "Future[Any]":
        began = time.monotonic()
        kind = fn.args[0].noun if isinstance(fn, partial) else "work"
        future = self._executor.submit(fn, *args, **kwargs)

        def note(done: "Future[Any]") -> None:
            has_failed = done.cancelled() or done.exception() is not None or done.result() is not None
            self._seconds.labels(kind, "failed" if has_failed else "succeeded").observe(time.monotonic() - began)

        future.add_done_callback(note)
        return future

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        self._executor.shutdown(wait=wait, cancel_futures=cancel_futures)


def _cumulative(counts: Tally[float]) -> list[tuple[str, float]]:
    """Counts at or below each edge, as Prometheus wants them; the last edge is infinity."""
    edges = sorted({*counts, math.inf})
    totals = accumulate(counts[edge] for edge in edges)
    names = ("+Inf" if edge == math.inf else repr(edge) for edge in edges)
    return list(zip(names, map(float, totals), strict=True))
