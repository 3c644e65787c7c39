"""A worker that takes its computer along: it kills the process that has started it, once that is asked for."""

import os
import signal

from seatfem.jobs.worker import answer_lines


def reply(line: str) -> str:
    if line == "die":
        os.kill(os.getppid(), signal.SIGKILL)
    return line


if __name__ == "__main__":
    answer_lines(reply)
