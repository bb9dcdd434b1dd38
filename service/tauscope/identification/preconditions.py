"""What recordings must show before anything is estimated from them: motion."""

from collections.abc import Sequence

from tauscope.errors import IdentificationError
from tauscope.recording.conditioning import Conditioner


def require_motion(conditioners: Sequence[Conditioner]) -> None:
    """Refuse recordings in which no joint leaves the noise of its own encoder.

    Raises IdentificationError, which names the recordings.
    """
    if not any(conditioner.moving.any() for conditioner in conditioners):
        names = ", ".join(conditioner.recording.name for conditioner in conditioners)
        raise IdentificationError(
            f"{names}: no joint moves by more than the noise of its position: record a motion that excites every joint"
        )
