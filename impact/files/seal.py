"""A checksum in front of an HDF5 file: the library that reads HDF5 can crash on damaged bytes, so they are found first.

The seal stands in HDF5's user block, 512 bytes that the format leaves to the application: other programs read the file
as before.
"""

from __future__ import annotations

import hashlib
import subprocess
import sys
from pathlib import Path

USER_BLOCK = 512
_MAGIC = b"impact file, sha256 of all after byte 512: "
_PROBE = "import sys, h5py\nwith h5py.File(sys.argv[1]) as f: f.visititems(lambda _, x: dict(x.attrs) and None)"


def seal_of(image: bytes) -> bytes:
    """The user block to stand in front of the bytes of an HDF5 file."""
    return (_MAGIC + hashlib.sha256(image).hexdigest().encode() + b"\n").ljust(USER_BLOCK, b"\0")


def seal(path: Path) -> None:
    """Write the checksum of a closed file with a user block into that block."""
    with path.open("r+b") as file:
        file.seek(USER_BLOCK)
        block = seal_of(file.read())
        file.seek(0)
        file.write(block)


def seal_holds(path: Path) -> bool | None:
    """Whether the file is as it was sealed; ``None`` for a file without a seal."""
    with path.open("rb") as file:
        head = file.read(USER_BLOCK)
        if not head.startswith(_MAGIC):
            return None
        digest = hashlib.file_digest(file, "sha256").hexdigest().encode()
    return head[len(_MAGIC) :].split(b"\n")[0] == digest


def can_be_opened(path: Path) -> bool:
    """Whether HDF5 reads the file's structure without crashing, tried in a process of its own."""
    try:
        probe = subprocess.run(
            [sys.executable, "-P", "-c", _PROBE, str(path)], capture_output=True, timeout=60, check=False
        )
    except subprocess.TimeoutExpired:
        return False
    return probe.returncode >= 0
