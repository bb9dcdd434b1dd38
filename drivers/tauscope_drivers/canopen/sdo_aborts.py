"""Abort codes of SDO transfers (CiA 301, table 22), in words with a remedy."""

from collections.abc import Mapping

_OTHER_DRIVE = "check that drive.eds and the firmware are those of this drive"
_OTHER_VALUE = "see the drive's manual for the values that it takes, and correct the robot file's limits or its DCF"
_OTHER_STATE = "let go of the drive's power (tauscope release), close the maker's tool, and try again"

_MEANINGS: Mapping[int, tuple[str, str]] = {
    0x05040001: ("the drive does not know the transfer's command", _OTHER_DRIVE),
    0x05040005: ("the drive is out of memory", "restart the drive"),
    0x06010000: ("the drive does not give access to it", _OTHER_DRIVE),
    0x06010001: ("the drive lets it be written only", _OTHER_DRIVE),
    0x06010002: ("the drive lets it be read only", _OTHER_DRIVE),
    0x06020000: ("the drive has no such object", _OTHER_DRIVE),
    0x06040041: ("the drive cannot map this object to a PDO", "name its EDS file as drive.eds"),
    0x06040042: ("the drive's PDO would be too long", "name its EDS file as drive.eds"),
    0x06040043: ("the drive finds its parameters incompatible", _OTHER_VALUE),
    0x06040047: ("the drive has an internal incompatibility", "restart the drive"),
    0x06060000: ("the drive has a hardware error", "see the drive's own display"),
    0x06070010: ("the object has another length", _OTHER_DRIVE),
    0x06070012: ("the object is shorter", _OTHER_DRIVE),
    0x06070013: ("the object is longer", _OTHER_DRIVE),
    0x06090011: ("the drive has no such subindex", _OTHER_DRIVE),
    0x06090030: ("the drive does not take this value", _OTHER_VALUE),
    0x06090031: ("the value is too high for the drive", _OTHER_VALUE),
    0x06090032: ("the value is too low for the drive", _OTHER_VALUE),
    0x06090036: ("the drive's upper limit would be below its lower one", _OTHER_VALUE),
    0x08000000: ("the drive states a general error", "see the drive's own display"),
    0x08000020: ("the drive cannot store it", _OTHER_STATE),
    0x08000021: ("another program controls the drive", _OTHER_STATE),
    0x08000022: ("the drive does not take it in its present state", _OTHER_STATE),
}


def describe_abort(code: int) -> tuple[str, str]:
    """Meaning and remedy of an abort code."""
    return _MEANINGS.get(code, ("the drive aborts the transfer", "see the drive's manual for the code"))
