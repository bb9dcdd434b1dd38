"""How a drive notices that its host is gone: by the host's heartbeat, or by node guarding where it watches none.

Node guarding (CiA 301): the host asks for the drive's state by remote frames. A drive that is not asked within its life
time, guard time (0x100C) × factor (0x100D), stops as one does that misses a heartbeat. It counts from the first remote
frame that reaches it: an adapter that sends none would leave the drive unguarded, so an answer is required.
"""

from tauscope_drivers.canopen import objects
from tauscope_drivers.canopen.bus import MASTER_NODE
from tauscope_drivers.canopen.node import DriveNode
from tauscope_drivers.errors import DriverError

BEATS = 10  # of the host within a drive's watchdog time: one lost frame stops nothing
PRODUCER_HEARTBEAT_MS = 100


def arm_watchdog(node: DriveNode, watchdog_s: float) -> None:
    """Let a drive stop after so long a silence of the host, at most.

    Raises DriverError ``refused`` where it does not take a value, or answers no remote frame.
    """
    write = node.dictionary.write
    if not node.is_guarded:
        write(objects.CONSUMER_HEARTBEAT, MASTER_NODE << 16 | round(watchdog_s * 1e3))
    if node.has(objects.PRODUCER_HEARTBEAT):
        # a node that produces heartbeats is not guarded
        write(objects.PRODUCER_HEARTBEAT, 0 if node.is_guarded else PRODUCER_HEARTBEAT_MS)
    if node.is_guarded:
        write(objects.LIFE_TIME_FACTOR, BEATS)
        write(objects.GUARD_TIME, int(watchdog_s * 1e3 / BEATS))
        require_guarding(node)
        node.bus.guarded.add(node.configuration.node_id)


def require_guarding(node: DriveNode) -> None:
    """Ask a drive by a remote frame. Raises DriverError ``refused`` where it does not answer."""
    if not node.bus.ask_guard(node.configuration.node_id):
        raise DriverError.refusal(
            f"{node.place}: answers no remote frame, and would not notice that the host is gone; "
            "use an adapter that sends remote frames, or a drive with a heartbeat consumer (0x1016)"
        )


def disarm_watchdog(node: DriveNode) -> None:
    """Let a drive be without its host. Raises DriverError where it does not answer, or does not take the value."""
    for entry in objects.GUARDING if node.is_guarded else (objects.CONSUMER_HEARTBEAT,):
        node.dictionary.write(entry, 0)
