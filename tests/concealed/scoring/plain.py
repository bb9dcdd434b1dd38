"""A diagnosis as outcomes keep it."""

from typing import Any

from tauscope.diagnosis.documents.document import DiagnosisDocument

NOT_KEPT = {"parameter_differences", "parameter_shifts"}
"""What of a diagnosis no figure needs."""


def plain(found: DiagnosisDocument) -> dict[str, Any]:
    """A diagnosis as plain data, without what no figure needs."""
    return found.model_dump(mode="json", by_alias=True, exclude=NOT_KEPT)
