"""The page in German: every sentence and every id has its words, and no word is left that nobody says."""

import json
import re

from server.http.page_words import german, sentences, tagged
from tauscope.diagnosis import Verdict
from tauscope.effects import catalogue
from tauscope.robot.robot import JointType
from tauscope.runtime.states import RunState
from tauscope.server.page.router import STATIC, assets
from tauscope.server.queue.record import JobState
from tauscope.server.store.data_folder import FOLDERS

PART = re.compile(r"\{\d+\}")
VARIABLES = {"velocity", "position", "load", "acceleration", "time", "temperature", "motor_position"}
SAME = {"JSON", "SI"}
"""What is said alike in every language."""


def test_sentences_are_found_within_sentences() -> None:
    assert list(tagged("f(t`a ${b ? t`c ${d}` : { e: `f` }} g`, set`h`, x.t`i`)")) == ["a {0} g", "c {0}"]


def test_every_sentence_has_its_german_one_and_none_is_left_over() -> None:
    assert sentences() == german()[0].keys()


def test_german_sentences_hold_the_same_parts() -> None:
    differing = [each for each in german()[0].items() if set(PART.findall(each[0])) != set(PART.findall(each[1]))]
    assert differing == []


def test_every_id_that_the_service_shows_has_a_german_name() -> None:
    shown = {str(each) for kind in (RunState, JobState, Verdict, JointType) for each in kind}
    shown |= {effect.id for effect in catalogue()} | {"unknown", "damaged", "waiting"} | VARIABLES
    names = german()[1].keys() | json.loads(assets()["effects.js"].content.split(b"= ")[1].rstrip(b";\n")).keys()
    assert shown | FOLDERS.keys() - {"excitation"} <= names


def test_no_words_are_said_in_one_language_only() -> None:
    written = re.compile(r'(?:text|[lL]abel|"aria-label"): "([^"]*[A-Za-z]{2}[^"]*)"|textContent = "([^"]+)"')
    for script in STATIC.glob("*.js"):
        found = {one or other for one, other in written.findall(script.read_text(encoding="utf-8"))}
        assert found <= SAME, script.name
