"""``python -m service.cli``: the program where its script is not installed."""

import sys

from service.cli import main

sys.exit(main())
