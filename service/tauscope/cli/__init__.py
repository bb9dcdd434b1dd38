"""The command line: ``tauscope identify``, ``run``, ``robot``, ``recording``, ``serve``, ``demo`` and more.

Modules named ``*_command`` only declare arguments, and import what does the work when they are called: ``--help``
answers at once.
"""

from tauscope.cli.program import main

__all__ = ["main"]
