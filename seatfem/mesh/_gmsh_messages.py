"""What the gmsh process tells its parent: JSON lines on standard output."""

from __future__ import annotations

import json
import sys
from typing import Any


def send(**message: Any) -> None:
    """One JSON line to the parent."""
    sys.stdout.write(json.dumps(message) + "\n")
    sys.stdout.flush()


def stage(what: str, done: float) -> None:
    send(stage=what, done=done)
