"""The fuzzer's process: answers a case with its verdict, both in JSON. Started by `tests.fuzz.runner` only.

`python -m tests.fuzz.worker CORPUS FOLDER LIMIT`: LIMIT seconds for a case; what it is at when they are nearly over
is written to the standard error.
"""

import faulthandler
import json
import os
import sys
from dataclasses import asdict
from pathlib import Path
from typing import Final

from seatfem.jobs.processes import limit_process
from seatfem.jobs.worker import answer_lines

from .corpus import Specimen
from .trial import Case, carry_out

MEMORY: Final = 4 << 30  # bytes of address space beyond what the libraries map
FILE_SIZE: Final = 256 << 20  # bytes of one file


def main(corpus: Path, folder: Path, limit: float) -> None:
    """Carry out cases until the parent ends, or ends this process."""
    os.chdir(folder)
    limit_process(memory=MEMORY, file_size=FILE_SIZE)
    faulthandler.enable()

    def answer(line: str) -> str:
        given = json.loads(line)
        case = Case(**given | {"specimen": Specimen(**given["specimen"])})
        os.truncate(2, 0)
        os.lseek(2, 0, os.SEEK_SET)
        faulthandler.dump_traceback_later(0.9 * limit)
        verdict = carry_out(case, corpus, folder / "case")
        faulthandler.cancel_dump_traceback_later()
        return json.dumps(asdict(verdict))

    answer_lines(answer)


if __name__ == "__main__":
    main(Path(sys.argv[1]), Path(sys.argv[2]), float(sys.argv[3]))
