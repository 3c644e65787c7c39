"""Replacement of a worker by another program, which ends with the parent as the worker would.

The kernel's signal at the parent's death stays set across exec; the program gets the user's PYTHONPATH.
"""

import os
import sys

if __name__ == "__main__":
    _, *others = os.environ.pop("PYTHONPATH").split(os.pathsep)  # the first is this package's folder
    if others:
        os.environ["PYTHONPATH"] = os.pathsep.join(others)
    os.execvp(sys.argv[1], sys.argv[1:])
