"""How often a process is killed in each series: fifty times, or fewer where a machine has little time."""

import os

KILLS = int(os.environ.get("TAUSCOPE_KILLS", "50"))
