"""The reference page says what the classes say."""

from effects.write_catalogue import PAGE, page_text
from tauscope.effects import catalogue


def test_the_page_is_that_of_the_present_catalogue() -> None:
    assert PAGE.read_text(encoding="utf-8") == page_text(), "run python tests/effects/write_catalogue.py"


def test_every_row_has_as_many_cells_as_the_head() -> None:
    rows = [line for line in page_text().splitlines() if line.startswith("| `")]
    assert len(rows) == len(catalogue())
    assert {row.replace("\\|", "").count("|") for row in rows} == {8}
