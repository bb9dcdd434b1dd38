"""What a reader noticed about a robot and did not want to keep to itself."""

from dataclasses import dataclass
from enum import StrEnum


class Severity(StrEnum):
    """How much a finding matters: an error refuses, a warning may spoil results, the rest is good to know."""

    ERROR = "error"
    WARNING = "warning"
    INFO = "info"


@dataclass(frozen=True)
class Finding:
    """One remark on a robot."""

    severity: Severity
    where: str
    text: str
