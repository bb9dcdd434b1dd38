"""Objects that CiA 301 and CiA 402 leave to the maker, and the substitute for each that a drive does not have."""

from collections.abc import Container, Mapping

from tauscope_drivers.canopen import objects
from tauscope_drivers.canopen.objects import DriveObject

SUBSTITUTES: Mapping[DriveObject, str] = {
    objects.ABORT_CONNECTION: (
        "by the standard it goes into fault when the host is silent; make sure of that with the arm supported"
    ),
    objects.QUICK_STOP_OPTION: (
        "a quick stop ends without power, so Tauscope brakes and holds by targets; if the host is gone, the drive "
        "lets go of the joint"
    ),
    objects.FAULT_REACTION_OPTION: "its reaction to a fault is the maker's",
    objects.LARGEST_TORQUE: "Tauscope stops the arm where the measured torque exceeds the joint's limit",
    objects.LOWEST_POSITION: "Tauscope keeps the targets within the joint's range",
    objects.HIGHEST_POSITION: "Tauscope keeps the targets within the joint's range",
    objects.VELOCITY_ACTUAL: "no velocity is recorded, and the arm runs in position mode alone",
    objects.ERROR_CODE: "errors are known by emergency messages alone",
    objects.PRODUCER_HEARTBEAT: "a restart of the drive shows in its power state alone",
    objects.INTERPOLATION_VALUE: "it finds the cycle from SYNC",
}
"""Optional objects, and what is done where one is absent."""

WRITTEN = frozenset(SUBSTITUTES) - {objects.VELOCITY_ACTUAL, objects.ERROR_CODE}
"""Optional objects that the driver sets; one that is read-only counts as absent."""


STAYING_OPTIONS = range(5, 9)
"""Quick stop options (0x605A) after which a drive keeps its power."""

DOUBTFUL = (objects.ABORT_CONNECTION, objects.QUICK_STOP_OPTION)
"""Optional objects without which an operator has to try how the arm stops."""


def describe_absent(present: Container[DriveObject]) -> list[str]:
    """One line for each optional object that a drive does not have."""
    lines: dict[str, list[str]] = {}
    for entry, substitute in SUBSTITUTES.items():
        if entry not in present:
            lines.setdefault(substitute, []).append(str(entry))
    return [f"has no {' and '.join(names)}: {substitute}" for substitute, names in lines.items()]
