"""The one error tree of Tauscope.

TauscopeError
├── RobotFileError        (ValueError)    robot-file          the robot file cannot be read or is not valid
├── RecordingError        (ValueError)    recording           the recording cannot be read or is not valid
│   └── RecordingMismatchError            recording-mismatch  it is sound, but of a robot with other joints
├── IdentificationError   (ValueError)    identification      the data cannot answer the question
├── ExportError           (ValueError)    export              a model cannot be written in the asked format
├── ExcitationError       (ValueError)    excitation          no motion within the limits, or a trajectory is not valid
├── ScenarioError         (ValueError)    scenario            the simulated arm's scenario file is not valid
├── AcquisitionError      (RuntimeError)  acquisition         a run cannot start, or ended before its time
├── StoreError            (RuntimeError)  store               the database or the data folder cannot be used
├── NotFoundError         (LookupError)   not-found           nothing of that name is kept here
├── LimitExceededError    (ValueError)    limit-exceeded      an upload or a request is larger than allowed
└── MissingExtraError     (ImportError)   missing-extra       an optional dependency is not installed

Every leaf also inherits the builtin that a caller would expect, so that ``except ValueError`` keeps working. `code`
is stable: scripts and the pages below ``docs/errors/`` rely on it. A message is one line; it names the file, column,
row or joint, and what to do next.
"""

from collections.abc import Generator
from contextlib import contextmanager
from typing import ClassVar

LONGEST_MESSAGE = 2000


def one_line(text: str) -> str:
    """A message as one printable line: white space folded, control characters escaped, cut where it is endless."""
    folded = " ".join(text.split())
    printable = "".join(c if c.isprintable() else c.encode("unicode_escape").decode("ascii") for c in folded)
    return printable if len(printable) <= LONGEST_MESSAGE else printable[: LONGEST_MESSAGE - 1] + "…"


class TauscopeError(Exception):
    """Any failure that Tauscope foresees; its message is written for the user."""

    code: ClassVar[str] = "error"

    def __init_subclass__(cls, *, code: str = "") -> None:
        """Name the kind of failure: as the class it is made from, where no code is given."""
        super().__init_subclass__()
        cls.code = code or cls.code

    def __init__(self, message: str = "") -> None:
        """Take the message, whatever a file's content put into it, as one printable line."""
        super().__init__(one_line(message))


@contextmanager
def explain_os_errors(kind: type[TauscopeError], words: str, advice: str = "") -> Generator[None, None, None]:
    """Raise ``WORDS (reason)ADVICE`` where the operating system refuses what is done within."""
    try:
        yield
    except OSError as error:
        raise kind(f"{words} ({error.strerror or error}){advice}") from error


class RobotFileError(TauscopeError, ValueError, code="robot-file"):
    """The robot file, or the URDF that it names, cannot be read or is not valid."""


class RecordingError(TauscopeError, ValueError, code="recording"):
    """The recording cannot be read or is not valid."""


class RecordingMismatchError(RecordingError, code="recording-mismatch"):
    """The recording is sound but belongs to another robot: its number of joints differs."""


class IdentificationError(TauscopeError, ValueError, code="identification"):
    """The recordings cannot answer the question: too short, too poor, or without motion."""


class ExportError(TauscopeError, ValueError, code="export"):
    """A model cannot be written in the format that was asked for."""


class ExcitationError(TauscopeError, ValueError, code="excitation"):
    """No motion keeps the limits, or a trajectory file is not valid."""


class ScenarioError(TauscopeError, ValueError, code="scenario"):
    """The scenario of the simulated arm cannot be read or is not valid."""


class AcquisitionError(TauscopeError, RuntimeError, code="acquisition"):
    """A run cannot start, or ended before its time."""


class StoreError(TauscopeError, RuntimeError, code="store"):
    """The database or the data folder cannot be used: unreachable, damaged, locked, or of a newer form."""


class NotFoundError(TauscopeError, LookupError, code="not-found"):
    """Nothing of that name is kept here."""


class LimitExceededError(TauscopeError, ValueError, code="limit-exceeded"):
    """An upload or a request is larger than this service accepts."""


class MissingExtraError(TauscopeError, ImportError, code="missing-extra"):
    """An optional dependency is not installed; the message names the extra to install."""
