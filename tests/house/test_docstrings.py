"""Every public function, class and field says what its arguments are, with shape and unit."""

import importlib

import pytest

from house.docstring_audit import audit_module
from shared_data import REPOSITORY


def public_modules() -> list[str]:
    """Dotted names of all modules without a leading underscore, which leaves out `__main__`."""
    names: list[str] = []
    for package in ("service", "drivers", "sim_backend"):
        for file in sorted((REPOSITORY / package).rglob("*.py")):
            parts = file.relative_to(REPOSITORY).with_suffix("").parts
            dotted = parts[:-1] if parts[-1] == "__init__" else parts
            if not any(part.startswith("_") for part in dotted):
                names.append(".".join(dotted))
    return names


@pytest.mark.parametrize("name", public_modules())
def test_public_objects_are_documented(name: str) -> None:
    faults = audit_module(importlib.import_module(name))
    assert not faults, "\n" + "\n".join(faults)
