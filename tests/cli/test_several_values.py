"""Options that take several values."""

from collections.abc import Sequence

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tauscope.cli.verbs import spread_values

OPTIONS = {"--held-out", "-H"}

values = st.text(min_size=1).filter(lambda word: not word.startswith("-")) | st.just("-")
other_options = st.sampled_from(["--json", "--estimator", "-x", "--no-rotor-inertia", "--held-out=a.csv"])
words = st.lists(values | other_options | st.sampled_from(sorted(OPTIONS)))


def values_of(command_line: Sequence[str]) -> list[tuple[str | None, str]]:
    """Every value with the option that it belongs to, read off one by one: the meaning of the command line."""
    owner, found = None, []
    for word in command_line:
        if word.startswith("-") and word != "-":
            owner = word if word in OPTIONS else None
        else:
            found.append((owner, word))
    return found


def values_of_single(command_line: Sequence[str]) -> list[tuple[str | None, str]]:
    """The same for a parser that knows one value an option."""
    owner, found = None, []
    for word in command_line:
        if word.startswith("-") and word != "-":
            owner = word if word in OPTIONS else None
        else:
            found.append((owner, word))
            owner = None
    return found


@pytest.mark.parametrize(
    ("given_words", "spread"),
    [
        ("r.yaml t.csv --held-out a b", "r.yaml t.csv --held-out a --held-out b"),
        ("--held-out a b --json o r.yaml t.csv", "--held-out a --held-out b --json o r.yaml t.csv"),
        ("--held-out a b -- r.yaml t.csv", "--held-out a --held-out b -- r.yaml t.csv"),
        ("--held-out a --held-out b c", "--held-out a --held-out b --held-out c"),
        ("--held-out=a r.yaml t.csv", "--held-out=a r.yaml t.csv"),
        ("r.yaml --held-out --json -", "r.yaml --held-out --json -"),
        ("r.yaml -- --held-out a b", "r.yaml -- --held-out a b"),
    ],
)
def test_values_up_to_the_next_option_belong_to_it(given_words: str, spread: str) -> None:
    assert spread_values(given_words.split(), OPTIONS) == spread.split()


@given(words)
def test_every_value_keeps_its_option(command_line: list[str]) -> None:
    assert values_of_single(spread_values(command_line, OPTIONS)) == values_of(command_line)


@given(words)
def test_it_is_done_once_and_for_all(command_line: list[str]) -> None:
    once = spread_values(command_line, OPTIONS)
    assert spread_values(once, OPTIONS) == once


@given(words)
def test_nothing_but_the_option_is_added(command_line: list[str]) -> None:
    spread = spread_values(command_line, OPTIONS)
    assert [word for word in spread if word not in OPTIONS] == [word for word in command_line if word not in OPTIONS]


@given(words, words)
def test_what_follows_two_dashes_is_not_read(before: list[str], after: list[str]) -> None:
    spread = spread_values([*before, "--", *after], OPTIONS)
    assert spread == [*spread_values(before, OPTIONS), "--", *after]


@given(st.lists(values | other_options))
def test_other_command_lines_stay_as_they_are(command_line: list[str]) -> None:
    assert spread_values(command_line, OPTIONS) == command_line
