"""Every array of a public callable has a shape in its docstring."""

import importlib
import pkgutil

import numpy as np
import pytest

import tauscope
import tauscope_drivers
import tauscope_sim
from house.docstring_audit import audit_function, audit_module


@pytest.mark.parametrize("package", [tauscope, tauscope_drivers, tauscope_sim], ids=lambda package: package.__name__)
def test_shapes_of_public_arrays_are_documented(package) -> None:
    modules = (m.name for m in pkgutil.walk_packages(package.__path__, f"{package.__name__}."))
    names = [name for name in modules if not any(part.startswith("__") or part == "env" for part in name.split("."))]
    faults = [f"{name}.{fault}" for name in names for fault in audit_module(importlib.import_module(name))]
    assert len(names) > 50
    assert not faults, "\n" + "\n".join(faults)


def test_an_array_without_a_shape_is_found() -> None:
    def product(a: np.ndarray, b: np.ndarray) -> np.ndarray:
        """Product of a, (n, m), and another."""
        return a @ b

    assert list(audit_function(product, [product.__doc__ or ""])) == ["array `b` has no shape"]
