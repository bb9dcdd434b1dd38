"""Whether a drive is what the driver needs and what its EDS or DCF file states."""

from tauscope_drivers.backend import ControlMode
from tauscope_drivers.canopen import objects, process_data
from tauscope_drivers.canopen.data_sheet.device_file import TYPE_NAMES, DataSheetError, DescribedObject, DeviceFile
from tauscope_drivers.canopen.objects import SUBSTITUTES, TARGETS, WRITTEN, DriveObject, select_modes
from tauscope_drivers.canopen.sdo import NodeDictionary
from tauscope_drivers.errors import DriverError

_READ = (objects.DEVICE_TYPE, objects.SUPPORTED_MODES, objects.MODE_DISPLAY)
_WRITTEN = (objects.CONTROLWORD, objects.MODE_OF_OPERATION)


def present_objects(file: DeviceFile) -> frozenset[DriveObject]:
    """Optional objects that a drive has as the driver uses them, by its file."""
    return frozenset(entry for entry in SUBSTITUTES if _is_there(file, entry))


def find_flaws(file: DeviceFile, *, reads_rated_torque: bool) -> list[str]:
    """Everything for which the driver cannot use a drive, each as a clause that names the object; empty if none."""
    flaws = [flaw for entry in _READ if (flaw := _flaw(file, entry))]
    flaws += [flaw for entry in _WRITTEN if (flaw := _unwritable(file, entry))]
    if needs_guarding(file) and (
        unguarded := [flaw for entry in objects.GUARDING if (flaw := _unwritable(file, entry))]
    ):
        heartbeat = _unwritable(file, objects.CONSUMER_HEARTBEAT)
        flaws.append(f"{heartbeat}, and {unguarded[0]}: the drive would not notice that the host is gone")
    flaws += [flaw for entry in SUBSTITUTES if _find(file, entry) and (flaw := _flaw(file, entry))]
    flaws += [flaw for entry in process_data.MEASURED if (flaw := _flaw(file, entry, is_mapped=True))]
    flaws += find_target_flaws(file, ControlMode.POSITION)
    if flaws and reads_rated_torque and not states_rated_torque(file):
        flaws.append(f"{objects.RATED_TORQUE} is missing: give drive.rated_torque_nm")
    return flaws


def needs_guarding(file: DeviceFile) -> bool:
    """Whether a drive watches no heartbeat that the driver could send it."""
    return _unwritable(file, objects.CONSUMER_HEARTBEAT) is not None


def states_rated_torque(file: DeviceFile) -> bool:
    """Whether a drive states its rated torque; else a run needs it from the robot file."""
    return _flaw(file, objects.RATED_TORQUE) is None


def pdo_slots(file: DeviceFile) -> process_data.PdoSlots:
    """The PDOs of a drive, and which of them can be mapped."""
    received, sent = (
        tuple(slot for number in range(process_data.PDO_COUNT) if (slot := _slot(file, number, direction)))
        for direction in (process_data.RECEIVED, process_data.SENT)
    )
    return process_data.PdoSlots(received, sent)


def find_target_flaws(file: DeviceFile, mode: ControlMode) -> list[str]:
    """Why a drive takes no targets of a mode, and gives no measurements meanwhile."""
    described = _find(file, objects.SUPPORTED_MODES)
    stated = None if described is None else described.default
    number = select_modes(stated).get(mode) if stated else next(iter(TARGETS[mode]))
    if number is None:
        return [f"{objects.SUPPORTED_MODES} states no cyclic synchronous {mode} mode"]
    target = TARGETS[mode][number]
    if flaw := _flaw(file, target, is_mapped=True, is_written=True):
        return [flaw]
    if mode is ControlMode.TORQUE and not _find(file, objects.VELOCITY_ACTUAL):
        return [f"{objects.VELOCITY_ACTUAL} is missing, by which a runaway is noticed"]
    optional = (entry for entry in process_data.MEASURED_WHERE_THERE if _is_mappable(file, entry))
    missing = process_data.plan_pdos(pdo_slots(file), target, optional).missing
    there = (entry for entry in missing if _find(file, entry))
    return [f"{entry} is in none of its PDOs, and their mapping cannot be written" for entry in there]


def _slot(file: DeviceFile, number: int, direction: process_data.PdoDirection) -> process_data.PdoSlot | None:
    """A PDO as the file describes it; None where it has none of this number."""
    mapping = direction.mapping + number
    count = file.objects.get((mapping, 0))
    if (direction.communication + number, 1) not in file.objects or count is None:
        return None
    entries: list[DescribedObject] = []
    while entry := file.objects.get((mapping, len(entries) + 1)):
        entries.append(entry)
    if "w" in count.access and entries and all("w" in entry.access for entry in entries):
        return process_data.PdoSlot(number, entries=len(entries))
    words = [entry.default or 0 for entry in entries[: count.default or 0]]
    return process_data.PdoSlot(number, process_data.decode_mapping(words) or ())


def _is_there(file: DeviceFile, entry: DriveObject) -> bool:
    """Whether an optional object is there, and can be written where the driver writes it."""
    if entry in process_data.MEASURED_WHERE_THERE:
        return _is_mappable(file, entry)
    return _flaw(file, entry, is_written=entry in WRITTEN) is None


def _is_mappable(file: DeviceFile, entry: DriveObject) -> bool:
    return _flaw(file, entry, is_mapped=True) is None


def _flaw(file: DeviceFile, entry: DriveObject, *, is_mapped: bool = False, is_written: bool = False) -> str | None:
    """Why an object is not usable: it is missing, or not as the driver needs it."""
    described = _find(file, entry)
    # values that an unsigned object takes here fit the signed one of its size
    wanted = ("INTEGER",) if entry.signed else ("UNSIGNED", "INTEGER")
    if described is None:
        return f"{entry} is missing"
    if TYPE_NAMES.get(described.data_type) not in [f"{kind}{entry.bits}" for kind in wanted]:
        return f"{entry} is {described.type_name}, not {wanted[0]}{entry.bits}"
    if is_mapped and not described.is_mappable:
        slots = pdo_slots(file)  # of fixed mapping, one may hold it whatever its PDOMapping states
        if not any(entry in (slot.fixed or ()) for slot in (*slots.received, *slots.sent)):
            return f"{entry} cannot be mapped to a PDO (PDOMapping)"
    if is_written and "w" not in described.access:
        return f"{entry} cannot be written (AccessType {described.access[:20]!a})"
    return None


def _unwritable(file: DeviceFile, entry: DriveObject) -> str | None:
    return _flaw(file, entry, is_written=True)


def _find(file: DeviceFile, entry: DriveObject) -> DescribedObject | None:
    return file.objects.get((entry.index, entry.subindex))


def refuse(flaws: list[str]) -> None:
    """Refuse a drive that has flaws. Raises DataSheetError, which names every one."""
    if flaws:
        raise DataSheetError(f"{'; '.join(flaws)}; check that it is the file of this drive, or use another drive")


def require_identity(file: DeviceFile, dictionary: NodeDictionary, place: str) -> None:
    """Refuse a drive that is not the one of its file. Raises DriverError ``refused``: the difference."""
    identity = ((objects.VENDOR, file.vendor), (objects.PRODUCT, file.product), (objects.REVISION, file.revision))
    for entry, stated in identity:
        told = None if stated is None else dictionary.read_optional(entry)
        if stated is None or told in (None, stated):
            continue
        # CiA 301 counts changes of behaviour in the major half of the revision number
        if entry is not objects.REVISION or not told >> 16 == stated >> 16 != 0:
            raise DriverError.refusal(
                f"{place}: {entry} reads 0x{told:X}, and {file.name} states 0x{stated:X}; "
                "check drive.node_id, or give the file of this drive"
            )
