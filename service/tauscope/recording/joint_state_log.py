"""The topics of a log: which of them carry joint states, and which of those is meant."""

from collections.abc import Callable, Mapping, Sequence

from tauscope.errors import RecordingError
from tauscope.recording.joint_state_decoders import find_decoder
from tauscope.recording.joint_state_topic import Choice, JointStateTopic
from tauscope.recording.recording import Recording
from tauscope.robot.messages import listed

_PREFERRED_TOPICS = ("/joint_states", "joint_states")

MessageHandler = Callable[[int, bytes], None]  # takes the log time [ns] and the bytes of a message


class JointStateLog:
    """Joint states of one or several container files that were recorded together."""

    def __init__(self, choice: Choice) -> None:
        self._choice = choice
        self._topics: dict[str, JointStateTopic] = {}
        self._others: list[str] = []

    def handler(self, topic: str, type_name: str, encoding: str, schema: bytes = b"") -> MessageHandler | None:
        """The taker of a topic's messages, None where they are not joint states, or not the wanted ones."""
        decoder = find_decoder(type_name, encoding, schema)
        if decoder is None:
            self._others.append(f"{topic} ({type_name}, {encoding})" if type_name else topic)
            return None
        if topic not in self._topics:
            self._topics[topic] = JointStateTopic(topic, decoder, self._choice)
        is_wanted = self._choice.reading.topic in (None, topic)
        return self._topics[topic].add if is_wanted else None

    @property
    def samples(self) -> int:
        """Number of samples that the topic with most of them holds so far."""
        for topic in self._topics.values():
            topic.flush()
        return max((topic.samples for topic in self._topics.values()), default=0)

    def finish(self) -> Recording:
        """The recording that the log holds; raises `RecordingError` where there is none, or more than one."""
        wanted = self._choice.reading.topic
        if wanted is not None and wanted not in self._topics:
            known = listed(sorted(self._topics)) or "none"
            raise RecordingError(f"{self._choice.file}: no topic {wanted} carries joint states; those that do: {known}")
        return choose_topic(self._topics, self._others, self._choice.file).finish()


def choose_topic(topics: Mapping[str, JointStateTopic], other_topics: Sequence[str], file: str) -> JointStateTopic:
    """The one topic with efforts of the wanted joints, or the one of several that ROS itself would take.

    Raises RecordingError where there is none, or more than one and none of them is ``/joint_states``.
    """
    filled = {name: topic for name, topic in topics.items() if topic.messages}
    if not filled:
        found = f"; it holds the topics {listed(sorted(set(other_topics)))}" if other_topics else ""
        raise RecordingError(f"{file}: no sensor_msgs/msg/JointState message was recorded{found}")
    for topic in filled.values():
        topic.flush()
    usable = {name: topic for name, topic in filled.items() if topic.has_effort}
    best = usable or {name: topic for name, topic in filled.items() if topic.samples} or filled
    for name in _PREFERRED_TOPICS:
        if name in best:
            return best[name]
    plain = {name: topic for name, topic in best.items() if topic.is_plain}  # beside ros2_control's dynamic states
    best = plain if len(plain) == 1 else best
    if len(best) > 1:
        raise RecordingError(
            f"{file}: several topics carry joint states ({listed(sorted(best))}); choose one with --topic"
        )
    return next(iter(best.values()))
