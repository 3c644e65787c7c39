"""Messages that the gmsh process sends its parent, as JSON lines on standard output."""

from __future__ import annotations

import json
import signal
import sys
from typing import Any, Final

BOUNDED: Final = ("building the geometry", "reading the mesh")
LONGEST: Final = 100  # s of these: sound files take seconds, and some broken ones keep the CAD kernel busy for ever


def send(**message: Any) -> None:
    """Send one JSON line to the parent."""
    sys.stdout.write(json.dumps(message) + "\n")
    sys.stdout.flush()


def stage(what: str, done: float) -> None:
    """Report what is begun; the system ends the process where reading a file takes longer than `LONGEST`."""
    if hasattr(signal, "alarm"):  # not on Windows
        signal.alarm(LONGEST if what in BOUNDED else 0)
    send(stage=what, done=done)
