"""rosbag2's compression, of single messages and of whole files, by zstd."""

from pathlib import Path

import zstandard

from tauscope.errors import RecordingError
from tauscope.recording.inflation import require_plausible_inflation

ZSTD_MAGIC = b"\x28\xb5\x2f\xfd"
"""First bytes of a zstd frame; a CDR message begins with a zero byte, JSON with a bracket."""

LARGEST_MESSAGE_BYTES = 2**17
"""Of a message with the states of a thousand joints."""

_COPY_BYTES = 2**20


def decompress_message(message: bytes) -> bytes:
    """The message itself, where it is compressed.

    Raises ValueError where the frame is damaged, or larger than any joint state.
    """
    if not message.startswith(ZSTD_MAGIC):
        return message
    try:
        if zstandard.frame_content_size(message) > LARGEST_MESSAGE_BYTES:
            raise ValueError("the compressed message is larger than any joint state")
        return zstandard.ZstdDecompressor().decompress(message, max_output_size=LARGEST_MESSAGE_BYTES)
    except zstandard.ZstdError as error:
        raise ValueError(f"the compressed message is damaged: {error}") from error


def decompress_file(source: Path, target: Path, name: str) -> Path:
    """Write a compressed file's content to a target, which is returned.

    Raises RecordingError where the file is damaged, or holds implausibly much.
    """
    size, written = source.stat().st_size, 0
    try:
        with source.open("rb") as packed, target.open("wb") as plain:
            for piece in zstandard.ZstdDecompressor().read_to_iter(packed, write_size=_COPY_BYTES):
                written += len(piece)
                require_plausible_inflation(size, written, name)
                plain.write(piece)
    except (zstandard.ZstdError, ValueError) as error:
        raise RecordingError(f"{name}: cannot be decompressed ({error}); copy the file again") from error
    return target
