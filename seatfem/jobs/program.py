"""Another program in a worker's place, which ends with the parent as the worker would.

The kernel's signal stays set from one program to the next; what the program is told of modules is what the user says.
"""

import os
import sys

if __name__ == "__main__":
    _, *others = os.environ.pop("PYTHONPATH").split(os.pathsep)  # the first is this package
    if others:
        os.environ["PYTHONPATH"] = os.pathsep.join(others)
    os.execvp(sys.argv[1], sys.argv[1:])
