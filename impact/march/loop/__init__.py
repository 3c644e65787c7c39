"""The compiled march: laws, several contacts at one time level, and the loops over steps."""

from impact.march.loop.complementarity import active_set
from impact.march.loop.forces import contact_force
from impact.march.loop.lanes import LANES, march_lanes
from impact.march.loop.marches import march_many, march_one
from impact.march.loop.oscillators import oscillate, padded
from impact.march.loop.past import FLOOR, displaced

__all__ = [
    "FLOOR",
    "LANES",
    "active_set",
    "contact_force",
    "displaced",
    "march_lanes",
    "march_many",
    "march_one",
    "oscillate",
    "padded",
]
