"""The reference page says what the classes say."""

from diagnosis.write_catalogue import PAGE, page_text


def test_the_page_is_that_of_the_present_catalogue() -> None:
    assert PAGE.read_text(encoding="utf-8") == page_text(), "run python tests/diagnosis/write_catalogue.py"


def test_every_row_has_as_many_cells_as_the_head() -> None:
    rows = [line for line in page_text().splitlines() if line.startswith("| `")]
    assert len(rows) == 27
    assert {row.replace("\\|", "").count("|") for row in rows} == {8}
