"""Compressed data: unpacked, and refused before files that unpack to far more than a recording fill memory or disk."""

import bz2
import gzip
import lzma
import zlib
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path

import zstandard

from tauscope.errors import RecordingError

ALWAYS_ACCEPTED_BYTES = 2**30  # unpacked size that is never refused: it fits on any disk that holds recordings
# Unpacked over packed size beyond which nothing is a recording: measured motion, with its noise, packs to a third or
# so, and its text to a twentieth.
LARGEST_RATIO = 100


HELD_BYTES = 2**25  # unpacked size that is never refused of data that are held in memory


def require_plausible_inflation(
    packed_bytes: int, unpacked_bytes: int, name: str, accepted_bytes: int | None = None
) -> None:
    """Raise RecordingError beyond `LARGEST_RATIO` times the packed size and a size that does no harm."""
    accepted_bytes = ALWAYS_ACCEPTED_BYTES if accepted_bytes is None else accepted_bytes
    if unpacked_bytes > max(accepted_bytes, LARGEST_RATIO * packed_bytes):
        ratio = unpacked_bytes // max(packed_bytes, 1)
        hint = "no recording packs so well; record it again, or save it uncompressed"
        raise RecordingError(f"{name}: unpacks to {unpacked_bytes} bytes, {ratio} times its size; {hint}")


ALWAYS_ACCEPTED_RECORDS = 200_000  # records that are never refused: they are walked within a fraction of a second


def count_plausible_records(packed_bytes: int) -> int:
    """Most records that a file may hold: one a byte, beyond a number that does no harm."""
    return ALWAYS_ACCEPTED_RECORDS + packed_bytes


# First bytes of a zstd frame; a CDR message begins with a zero byte, JSON with a bracket.
ZSTD_MAGIC = b"\x28\xb5\x2f\xfd"
LARGEST_MESSAGE_BYTES = 2**17  # of a message with the states of a thousand joints
_COPY_BYTES = 2**20


def decompress_message(message: bytes) -> bytes:
    """The message, unpacked. Raises ValueError where it is damaged, or larger than any joint state."""
    if not message.startswith(ZSTD_MAGIC):
        return message
    try:
        if zstandard.frame_content_size(message) > LARGEST_MESSAGE_BYTES:
            raise ValueError("the compressed message is larger than any joint state")
        return zstandard.ZstdDecompressor().decompress(message, max_output_size=LARGEST_MESSAGE_BYTES)
    except zstandard.ZstdError as error:
        raise ValueError(f"the compressed message is damaged: {error}") from error


def _unpack_zstd(path: Path) -> Iterator[bytes]:
    """Frame by frame: the library's own file ends without a word where a frame is cut short."""
    begin = zstandard.ZstdDecompressor().decompressobj
    unpacking = begin()
    with path.open("rb") as file:
        while rest := file.read(2**10):  # a piece of zeros unpacks to ten thousand times its size
            while rest:
                unpacking = begin() if unpacking.eof else unpacking
                yield unpacking.decompress(rest)
                rest = unpacking.unused_data if unpacking.eof else b""
    if not unpacking.eof:
        raise EOFError("it is truncated")


def _unpack_by(kind: type[gzip.GzipFile | bz2.BZ2File | lzma.LZMAFile]) -> Callable[[Path], Iterator[bytes]]:
    def unpack(path: Path) -> Iterator[bytes]:
        with kind(path) as file:
            while piece := file.read(_COPY_BYTES):
                yield piece

    return unpack


# How files are packed, by their first bytes.
_PACKINGS: Mapping[bytes, Callable[[Path], Iterator[bytes]]] = {
    b"\x1f\x8b": _unpack_by(gzip.GzipFile),
    b"BZh": _unpack_by(bz2.BZ2File),
    b"\xfd7zXZ": _unpack_by(lzma.LZMAFile),
    ZSTD_MAGIC: _unpack_zstd,
}
_DAMAGE = (EOFError, ValueError, zlib.error, lzma.LZMAError, zstandard.ZstdError)


def is_packed(magic: bytes) -> bool:
    """Whether a file that begins so is one that `decompress_file` unpacks."""
    return magic.startswith(tuple(_PACKINGS))


def decompress_file(source: Path, target: Path, name: str, accepted_bytes: int | None = None) -> Path:
    """Unpack a file to a target, and return it. Raises RecordingError where it is damaged or implausibly large."""
    with source.open("rb") as file:
        magic = file.read(max(map(len, _PACKINGS)))
    size, written = source.stat().st_size, 0
    unpack = next((unpack for start, unpack in _PACKINGS.items() if magic.startswith(start)), None)
    if unpack is None:
        raise RecordingError(f"{name}: cannot be decompressed (it is not packed as its name says); copy the file again")
    try:
        with target.open("wb") as plain:
            for piece in unpack(source):
                written += len(piece)
                require_plausible_inflation(size, written, name, accepted_bytes)
                plain.write(piece)
    except (OSError, *_DAMAGE) as error:
        if isinstance(error, OSError) and error.errno is not None:  # of the disk; one of the content has no number
            raise
        raise RecordingError(f"{name}: cannot be decompressed ({error}); copy the file again") from error
    return target
