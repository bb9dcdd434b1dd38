"""What processes of this tree need to find it, and to leave the cores to others."""

import os
from pathlib import Path

_TREE = Path(__file__).resolve().parents[1]


def process_environment() -> dict[str, str]:
    """Environment of a Python process that imports this tree."""
    path = os.pathsep.join(filter(None, [str(_TREE), os.environ.get("PYTHONPATH")]))
    # One thread: the matrices are small, and the control loop needs the other cores.
    return {**os.environ, "PYTHONPATH": path, "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
