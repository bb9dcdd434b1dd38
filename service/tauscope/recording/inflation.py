"""Files that unpack to far more than any recording would: refused before they fill memory or disk."""

from tauscope.errors import RecordingError

ALWAYS_ACCEPTED_BYTES = 2**30
"""Unpacked size that is never refused: it fits on any disk that holds recordings."""

LARGEST_RATIO = 100
"""Unpacked over packed size beyond which nothing is a recording: measured motion, with its noise, packs to a third or
so, and its text to a twentieth."""


HELD_BYTES = 2**25
"""Unpacked size that is never refused of data that are held in memory."""


def require_plausible_inflation(
    packed_bytes: int, unpacked_bytes: int, name: str, accepted_bytes: int | None = None
) -> None:
    """Refuse a file that unpacks to more than `LARGEST_RATIO` times its size, beyond a size that does no harm.

    Raises RecordingError if it does.
    """
    accepted_bytes = ALWAYS_ACCEPTED_BYTES if accepted_bytes is None else accepted_bytes
    if unpacked_bytes > max(accepted_bytes, LARGEST_RATIO * packed_bytes):
        ratio = unpacked_bytes // max(packed_bytes, 1)
        hint = "no recording packs so well; record it again, or save it uncompressed"
        raise RecordingError(f"{name}: unpacks to {unpacked_bytes} bytes, {ratio} times its size; {hint}")


ALWAYS_ACCEPTED_RECORDS = 200_000
"""Records that are never refused: they are walked within a fraction of a second."""


def count_plausible_records(packed_bytes: int) -> int:
    """Most records that a file may hold: one a byte, beyond a number that does no harm."""
    return ALWAYS_ACCEPTED_RECORDS + packed_bytes
