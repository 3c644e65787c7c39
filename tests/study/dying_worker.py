"""A worker that dies at a mass of 2 g and hangs at one of 3 g."""

import json
import os
import signal
import time
from dataclasses import asdict

from seatfem.study.sweep.runner import Outcome


def reply(line: str) -> str:
    mass = json.loads(line)["changed"]["reed.mass"]
    if mass == "2 g":
        os.kill(os.getpid(), signal.SIGKILL)
    if mass == "3 g":
        time.sleep(60)
    values = {"landing_impulse_Ns": 1.0, "landing_filtered_peak_force_N": 1.0}
    return json.dumps(asdict(Outcome("done", "", 1.0, values)))
