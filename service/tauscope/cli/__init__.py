"""The command line: ``tauscope identify``, ``run``, ``robot``, ``recording``, ``serve``, ``demo`` and more.

Each module named ``*_command`` is loaded when one of its verbs is called: ``tauscope --help`` answers at once.
"""

from tauscope.cli.program import main

__all__ = ["main"]
