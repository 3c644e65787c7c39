"""Write the values of frozen scenes anew: `python -m tests.frozen [NAME ...]`, of all scenes where none is named.

`make frozen` compares them. A value may move within its error bar; what moves by more than a tenth of it is printed
here, and stands in CHANGELOG.md.
"""

import sys
from pathlib import Path
from tempfile import TemporaryDirectory

from tests.frozen.recorded import moved, numbers_in, read_frozen, scenes, worth_telling, write_frozen
from tests.gallery import read_summary, run_alone

if __name__ == "__main__":
    every, frozen = scenes(), read_frozen()
    for name in sys.argv[1:] or every:
        with TemporaryDirectory() as folder:
            numbers = numbers_in(read_summary(run_alone(every[name], Path(folder))))
        before = frozen.get(name, {})
        changes = [*moved(numbers, before), *worth_telling(numbers, before)] if before else ["is new"]
        sys.stdout.write("".join(f"{name}: {line}\n" for line in changes or ["as before"]))
        frozen[name] = numbers
        write_frozen({key: frozen[key] for key in sorted(frozen) if key in every})
