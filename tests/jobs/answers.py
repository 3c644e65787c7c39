"""What the jobs of a crew are answered in tests: they say whether their worker hangs, fails, dies, or ends another."""

import os
import signal
import sys
import tempfile
import time

import psutil


def reply(job: str) -> str:
    print("words of a library that are no answer", flush=True)  # noqa: T201
    sys.stderr.write(f"at {job}\n")
    sys.stderr.flush()
    if job.startswith("slow"):
        time.sleep(0.5)
    if job == "hang":
        time.sleep(60)
    if job == "fail":
        raise KeyError("no such thing")
    if job == "die":
        os.kill(os.getpid(), signal.SIGKILL)
    if job == "kill the computer":  # the process that has hired the crew
        psutil.Process().parents()[1].kill()
        time.sleep(60)
    if job == "litter":
        return tempfile.mkdtemp()
    return f"{job}, {os.getpid()}, {os.environ['OMP_NUM_THREADS']}"
