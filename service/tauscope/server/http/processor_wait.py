"""Work that can wait gives way where processors are scarce, so that the event loop runs at once when a stop arrives."""

GIVE_WAY = 3.0
"""How many times as long as the event loop waited for a processor other work pauses afterwards. Beside processes that
leave it a third of a processor, that work then takes a tenth of one; the scheduler lets a thread run at once that uses
less than its share."""

LONGEST_PAUSE_S = 0.1
"""Longest pause: on a machine that is never idle, such work goes on still [s]."""


class ProcessorWait:
    """How long the event loop's thread has waited for a processor."""

    def __init__(self) -> None:
        """Begin to count."""
        self._seen_s = read_processor_wait()

    def take_pause(self) -> float:
        """How long other work is to pause for the wait since the last call [s]."""
        before, self._seen_s = self._seen_s, read_processor_wait()
        return min(LONGEST_PAUSE_S, GIVE_WAY * (self._seen_s - before))


def read_processor_wait() -> float:
    """How long the calling thread has been ready to run and had no processor [s]; 0 where the system does not tell."""
    try:
        with open("/proc/thread-self/schedstat", "rb", buffering=0) as file:
            return 1e-9 * int(file.read().split()[1])
    except (OSError, IndexError, ValueError):
        return 0.0
