"""The end of a bounded machine's time."""

import pytest

pytest_plugins = ["pytester"]


@pytest.mark.parametrize(("end", "ran"), [("1", {"skipped": 1}), ("1e12", {"passed": 1}), (None, {"passed": 1})])
def test_what_has_not_begun_by_then_is_skipped_and_said(
    pytester: pytest.Pytester, monkeypatch: pytest.MonkeyPatch, end: str | None, ran: dict[str, int]
) -> None:
    if end is None:
        monkeypatch.delenv("TAUSCOPE_TESTS_END", raising=False)
    else:
        monkeypatch.setenv("TAUSCOPE_TESTS_END", end)
    pytester.makepyfile("def test_one(): pass")
    result = pytester.runpytest("-p", "closing_time", "-p", "no:xdist", "-rs")
    result.assert_outcomes(**ran)
    assert ("TAUSCOPE_TESTS_END" in result.stdout.str()) == ("skipped" in ran)
