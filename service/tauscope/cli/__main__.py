"""``python -m tauscope.cli``: the program where its script is not installed."""

import sys

from tauscope.cli import main

sys.exit(main())
