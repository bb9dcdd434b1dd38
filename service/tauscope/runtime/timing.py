"""When the cycles of a run are due, how late they were, and what was missed."""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from tauscope.runtime.stored import StoredModel
from tauscope_drivers import Clock

_HISTOGRAM_EDGES_US = (10, 20, 50, 100, 200, 500, 1000, 2000, 5000, 10_000, 20_000, 50_000)
_PERCENTILES = {"p50": 50.0, "p99": 99.0, "p99.9": 99.9, "max": 100.0}


class Timing(StoredModel):
    """How well a run kept its time."""

    rate_hz: float = Field(description="cycles a second that were asked for")
    achieved_rate_hz: float | None = Field(
        description="cycles that took place, by the time they took; null for less than two"
    )
    cycles: int = Field(description="cycles that took place")
    missed_periods: int = Field(description="cycles that were left out because the loop was late")
    stale_samples: tuple[int, ...] = Field(
        description="readings that a joint did not answer in time to tell their instant, one number a joint"
    )
    lateness_us: Mapping[str, float] = Field(
        description="lateness of the cycles behind their deadlines: p50, p99, p99.9, max"
    )
    histogram_us: tuple[tuple[float | None, int], ...] = Field(
        description="upper edge and number of cycles of each bin of the lateness; the last bin has no edge"
    )


class Metronome:
    """Absolute deadlines at a constant rate; one that was slept through is left out and counted, never made up."""

    def __init__(self, clock: Clock, start_ns: int, period_ns: int, cycles: int) -> None:
        """Set the first deadline.

        Parameters
        ----------
        start_ns : int
            first deadline [ns]
        period_ns : int
            time between deadlines [ns]
        """
        self._clock, self._start, self._period, self._cycles = clock, start_ns, period_ns, cycles
        self._lateness: NDArray[np.int64] = np.zeros(cycles, dtype=np.int64)
        self._next = 0
        self.index = -1
        self.due_ns = start_ns
        self.lateness_ns = 0
        self.missed = 0
        self.played = 0

    def wait(self) -> bool:
        """Wait for the next deadline that is not a whole period past, and say in `index` which it is.

        Returns
        -------
        bool
            False where there is none left
        """
        if self._next >= self._cycles:
            return False
        due = self._start + self._next * self._period
        lateness = self._clock.wait_until_ns(due) - due
        skipped = min(lateness // self._period, self._cycles - 1 - self._next) if lateness >= self._period else 0
        self.missed += skipped
        self.index = self._next + skipped
        self.due_ns = due + skipped * self._period
        # What counts is the lateness of the wake-up, also where it cost whole periods.
        self.lateness_ns = lateness
        self._lateness[self.played] = lateness
        self.played += 1
        self._next = self.index + 1
        return True

    def timing(self, stale: NDArray[np.int64]) -> Timing:
        """The account so far.

        Parameters
        ----------
        stale : (n,) int64
            readings that each joint did not answer
        """
        late_us = self._lateness[: self.played] * 1e-3
        span_s = self.index * self._period * 1e-9
        bins = np.searchsorted(_HISTOGRAM_EDGES_US, late_us, side="right")
        counts = np.bincount(bins, minlength=len(_HISTOGRAM_EDGES_US) + 1)
        return Timing(
            rate_hz=1e9 / self._period,
            achieved_rate_hz=(self.played - 1) / span_s if self.played > 1 else None,
            cycles=self.played,
            missed_periods=self.missed,
            stale_samples=tuple(int(count) for count in stale),
            lateness_us=lateness_percentiles(late_us),
            histogram_us=tuple(zip((*map(float, _HISTOGRAM_EDGES_US), None), map(int, counts), strict=True)),
        )

    def recent_lateness_us(self, cycles: int) -> Mapping[str, float]:
        """Percentiles of the last cycles' lateness [µs]."""
        return lateness_percentiles(self._lateness[max(self.played - cycles, 0) : self.played] * 1e-3)


def lateness_percentiles(lateness_us: NDArray[np.floating]) -> dict[str, float]:
    """Median, tail and largest value, by name; empty where there is no value.

    Parameters
    ----------
    lateness_us : (N,) float64
        [µs]
    """
    if not len(lateness_us):
        return {}
    values = np.percentile(lateness_us, list(_PERCENTILES.values()))
    return {name: round(float(value), 1) for name, value in zip(_PERCENTILES, values, strict=True)}
