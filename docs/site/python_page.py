"""The page of `import tauscope`, which Sphinx fills from docstrings."""

import inspect

import tauscope
from tauscope import errors, results

HEAD = """# Python

Everything that `import tauscope` offers. A robot and a recording are given as paths, or as what these functions return.
`to_frame` needs the extra `pandas`, `simulate` and `rollout` the extra `sim`.

"""


def python_page() -> str:
    """Functions, results and errors."""
    functions = [f"tauscope.{name}" for name in tauscope.__all__]
    classes = [name for name, _ in inspect.getmembers(results, inspect.isclass) if name.endswith("Result")]
    leaves = [name for name, _ in inspect.getmembers(errors, inspect.isclass) if name.endswith("Error")]
    return HEAD + "\n".join(
        [
            "## Functions\n",
            format_directives("autofunction", functions),
            "## Results\n",
            format_directives("autoclass", [f"tauscope.results.{name}" for name in classes], "   :members:\n"),
            "## Errors\n\nEach has a stable code; [Errors](../errors/index.md) has a page for each.\n",
            format_directives("autoexception", [f"tauscope.errors.{name}" for name in leaves]),
        ]
    )


def format_directives(directive: str, names: list[str], options: str = "") -> str:
    """Directives of Sphinx, in a block of reStructuredText."""
    body = "\n".join(f".. {directive}:: {name}\n{options}" for name in names)
    return f"```{{eval-rst}}\n{body}```\n"
