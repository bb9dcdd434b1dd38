"""The page: complete, self-contained, the same on every run, and deaf to hostile names."""

import re
from dataclasses import replace
from html.parser import HTMLParser

import pytest

from report.conftest import HOSTILE, JOINTS, Case
from tauscope.identification import document
from tauscope.number_text import with_uncertainty

VOID = {"meta", "img", "br", "link", "hr", "input"}
LOADING = {"src", "srcset", "href", "xlink:href", "data", "action", "poster", "formaction", "background"}


class Reading(HTMLParser):
    """Tags, attributes and text of a page; fails on tags that do not match."""

    def __init__(self, page: str) -> None:
        super().__init__()
        self.tags: list[str] = []
        self.attributes: list[tuple[str, str, str]] = []
        self.text: list[str] = []
        self._open: list[str] = []
        self.feed(page)
        self.close()
        assert self._open == []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append(tag)
        self.attributes += [(tag, name, value or "") for name, value in attrs]
        if tag not in VOID:
            self._open.append(tag)

    def handle_startendtag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append(tag)
        self.attributes += [(tag, name, value or "") for name, value in attrs]

    def handle_endtag(self, tag: str) -> None:
        assert self._open.pop() == tag

    def handle_data(self, data: str) -> None:
        self.text.append(data)


@pytest.fixture(scope="module")
def reading(page: str) -> Reading:
    return Reading(page)


def test_nothing_is_asked_of_any_network(page: str, reading: Reading) -> None:
    assert re.findall(r"https?:|//[a-z]", page) == []
    assert [value for _, name, value in reading.attributes if name in LOADING and not value.startswith("#")] == []
    assert re.findall(r"@import|url\((?!#)", page) == []


def test_no_script_and_no_markup_comes_out_of_a_name(page: str, reading: Reading) -> None:
    assert {"script", "img", "iframe", "object", "link", "b"}.isdisjoint(reading.tags)
    assert [name for _, name, _ in reading.attributes if name.startswith("on")] == []
    assert "<script" not in page
    assert HOSTILE in "".join(reading.text)


def test_every_joint_is_named_in_every_section(reading: Reading) -> None:
    text = "".join(reading.text)
    for joint in JOINTS:
        assert text.count(joint) >= 5


def test_references_within_the_page_lead_somewhere(reading: Reading) -> None:
    ids = [value for _, name, value in reading.attributes if name == "id"]
    assert len(ids) == len(set(ids))
    links = {value[1:] for _, name, value in reading.attributes if name == "href"}
    clips = {found for _, _, value in reading.attributes for found in re.findall(r"url\(#([^)]+)\)", value)}
    assert links | clips <= set(ids)
    assert clips


def test_every_figure_is_there_and_described(reading: Reading) -> None:
    assert reading.tags.count("svg") == reading.tags.count("figure") == 2 * len(JOINTS) + 3
    labels = [value for tag, name, value in reading.attributes if tag == "div" and name == "aria-label"]
    assert len(labels) == reading.tags.count("figure")


def test_colours_follow_the_page(page: str) -> None:
    drawings = re.findall(r"<svg.*?</svg>", page, flags=re.DOTALL)
    assert drawings
    for drawing in drawings:
        assert re.findall(r"(?:fill|stroke): #", drawing) == []
        assert "var(--" in drawing
    declared = set(re.findall(r"(--[a-z-]+):", page))
    assert set(re.findall(r"var\((--[a-z-]+)\)", page)) <= declared


def test_numbers_are_those_of_the_document(case: Case, reading: Reading) -> None:
    text = "".join(reading.text)
    result = document(case.identification)
    for entry in result.base_parameters:
        assert entry.name in text
        assert with_uncertainty(entry.value, entry.std)[0] in text
    assert "ab" * 32 in text
    assert "2026-11-21" in text
    assert f"20 without a torque, of {result.conditioning[0].samples}" in text


def test_it_is_small(page: str) -> None:
    assert len(page.encode()) < 1_000_000


@pytest.mark.slow
def test_it_is_the_same_on_every_run(case: Case, page: str) -> None:
    assert case.page() == page


def test_without_held_out_recordings_it_says_so(case: Case, undrawn_figures: None) -> None:
    alone = replace(
        case.identification,
        held_out=None,
        predicted_held_out=None,
        extrapolation=None,
        held_out_conditioning=(),
    )
    page = replace(case, identification=alone, held_out=()).page()
    text = "".join(Reading(page).text)
    assert "hold a recording out" in text
    assert "Torque on a held-out recording" not in text


def test_broken_unicode_of_a_file_name_is_spelled_out(case: Case, undrawn_figures: None) -> None:
    (train,) = case.recordings
    page = replace(case, recordings=(replace(train, name="bad\udcff\x00.csv"),)).page()
    page.encode()
    assert "bad\\udcff\\x00.csv" in page
