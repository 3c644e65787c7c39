"""Compare the numbers of all frozen scenes with those on file, or write them.

    python -m tests.frozen [--write] [NAME ...]

Each scene runs in a process of its own with an empty store; all of them take some minutes. A number may change only in
a commit that says why, by less than its error bar: write it anew there.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from impact.files.safe_files import write_whole
from tests.frozen.recorded import FILE, HELP, ROOT, help_of_verbs, moved, numbers_of, scenes, versions

ONE_THREAD = ("OMP_NUM_THREADS", "MKL_NUM_THREADS", "OPENBLAS_NUM_THREADS", "NUMBA_NUM_THREADS")


def main(arguments: list[str]) -> int:
    """Return 1 where a number has moved."""
    if arguments[:1] == ["--one"]:
        with TemporaryDirectory() as folder:
            sys.stdout.write(json.dumps(numbers_of(Path(arguments[1]), Path(folder))))
        return 0
    write, every = "--write" in arguments, scenes()
    names = [name for name in arguments if name != "--write"] or list(every)
    frozen = json.loads(FILE.read_text(encoding="utf-8")) if FILE.exists() else {"scenes": {}}
    foreign, failed = frozen.get("versions", versions()) != versions(), False
    for name in names:
        numbers = _in_a_process(every[name])
        lines = moved(numbers, frozen["scenes"].get(name, {}), foreign=foreign)
        failed = failed or bool(lines)
        is_new = name not in frozen["scenes"]
        sys.stdout.write("".join(f"{name}: {line}\n" for line in lines if not is_new) or f"{name}: as before\n")
        sys.stdout.flush()
        if write:
            kept = {key: each for key, each in sorted({**frozen["scenes"], name: numbers}.items()) if key in every}
            frozen = {"versions": versions(), "scenes": kept}
            write_whole(FILE, (json.dumps(frozen, indent=0, sort_keys=True) + "\n").encode())
    if write:
        write_whole(HELP, (json.dumps(help_of_verbs(), indent=1) + "\n").encode())
    return int(failed and not write)


def _in_a_process(scene: Path) -> dict[str, Any]:
    """Return the numbers of a scene, computed by one thread with an empty store; compiled code is used again."""
    with TemporaryDirectory() as store:
        env = os.environ | {"SEATFEM_STORE": store} | dict.fromkeys(ONE_THREAD, "1")
        command = [sys.executable, "-m", "tests.frozen", "--one", str(scene)]
        done = subprocess.run(command, cwd=ROOT, env=env, capture_output=True, text=True, check=False)
    if done.returncode:
        raise RuntimeError(f"{scene.name}: {done.stderr[-2000:]}")
    return dict(json.loads(done.stdout))


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
