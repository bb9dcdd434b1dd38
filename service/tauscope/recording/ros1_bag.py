"""ROS 1 bags, by rosbags, which comes with the extra ``tauscope[ros1]``."""

import struct
from importlib import import_module
from pathlib import Path
from typing import Any

from tauscope.errors import RecordingError
from tauscope.recording.inflation import require_plausible_inflation
from tauscope.recording.joint_state_log import JointStateLog
from tauscope.recording.joint_state_topic import Choice
from tauscope.recording.recording import Recording
from tauscope.recording.words import reason

ROS1_MAGIC = b"#ROSBAG V2.0"


def read_ros1_bag(path: Path, choice: Choice) -> Recording:
    """Read the joint states of a ROS 1 bag; only chunks that hold messages of their topics are read.

    Raises
    ------
    RecordingError
        rosbags is not installed, the bag is damaged or not indexed, or there are no usable joint states
    """
    name = choice.file
    try:
        reader_type: Any = import_module("rosbags.rosbag1").Reader
        errors = import_module("rosbags.rosbag1").ReaderError
    except ImportError as error:
        raise RecordingError(
            f"{name}: ROS 1 bags need rosbags, which is not installed: pip install 'tauscope[ros1]'"
        ) from error
    log, unpacked = JointStateLog(choice), 0
    try:
        with reader_type(path) as reader:
            handlers = {
                each.id: log.handler(each.topic, _ros1_name(each.msgtype), "ros1") for each in reader.connections
            }
            wanted = [each for each in reader.connections if handlers[each.id] is not None]
            for connection, time, message in reader.messages(connections=wanted) if wanted else ():
                unpacked += len(message)
                require_plausible_inflation(path.stat().st_size, unpacked, name)
                handler = handlers[connection.id]
                if handler is not None:
                    handler(time, bytes(message))
    except RecordingError:
        raise
    except (
        errors,
        ValueError,
        KeyError,
        IndexError,
        EOFError,
        OSError,
        RuntimeError,
        MemoryError,
        struct.error,
    ) as error:
        raise RecordingError(
            f"{name}: not a readable ROS 1 bag ({reason(error)}); run `rosbag reindex` on it"
        ) from error
    return log.finish()


def _ros1_name(type_name: str) -> str:
    """The type as ROS 1 names it."""
    return type_name.replace("/msg/", "/")
