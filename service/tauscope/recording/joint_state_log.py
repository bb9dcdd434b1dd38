"""The topics of a log: which of them carry joint states, and which of those is meant."""

from collections.abc import Callable, Mapping, Sequence

from tauscope.errors import RecordingError
from tauscope.recording.joint_state_topic import Choice, JointStateTopic
from tauscope.recording.recording import Recording
from tauscope.recording.words import listed

JOINT_STATE_TYPES = ("sensor_msgs/msg/JointState", "sensor_msgs/JointState")

_JSON_TYPES = (*JOINT_STATE_TYPES, "JointState")
_PREFERRED_TOPICS = ("/joint_states", "joint_states")

MessageHandler = Callable[[int, bytes], None]
"""Takes the log time [ns] and the bytes of a message."""


class JointStateLog:
    """Joint states of one or several container files that were recorded together."""

    def __init__(self, choice: Choice) -> None:
        """Start empty."""
        self._choice = choice
        self._topics: dict[str, JointStateTopic] = {}
        self._others: list[str] = []

    def handler(self, topic: str, type_name: str, encoding: str) -> MessageHandler | None:
        """Whoever takes the messages of a topic, None where they are not joint states."""
        known = JOINT_STATE_TYPES if encoding == "cdr" else _JSON_TYPES if encoding == "json" else ()
        if type_name not in known:
            self._others.append(f"{topic} ({type_name}, {encoding})" if type_name else topic)
            return None
        if topic not in self._topics:
            self._topics[topic] = JointStateTopic(topic, encoding, self._choice)
        return self._topics[topic].add

    @property
    def samples(self) -> int:
        """Number of samples that the topic with most of them holds so far."""
        for topic in self._topics.values():
            topic.flush()
        return max((topic.samples for topic in self._topics.values()), default=0)

    def finish(self) -> Recording:
        """The recording that the log holds; raises `RecordingError` where there is none, or more than one."""
        return choose_topic(self._topics, self._others, self._choice.file).finish()


def choose_topic(topics: Mapping[str, JointStateTopic], other_topics: Sequence[str], file: str) -> JointStateTopic:
    """The one topic with joint states, or the one that ROS itself would call so.

    Raises
    ------
    RecordingError
        there is none, or more than one and none of them is ``/joint_states``
    """
    filled = {name: topic for name, topic in topics.items() if topic.messages}
    if not filled:
        found = f"; it holds the topics {listed(sorted(set(other_topics)))}" if other_topics else ""
        raise RecordingError(f"{file}: no sensor_msgs/msg/JointState message was recorded{found}")
    for name in _PREFERRED_TOPICS:
        if name in filled:
            return filled[name]
    if len(filled) > 1:
        raise RecordingError(
            f"{file}: several topics carry joint states ({listed(sorted(filled))}); "
            "keep one of them in the file, or name it /joint_states"
        )
    return next(iter(filled.values()))
