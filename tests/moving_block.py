"""A block of 2 by 4 by 10 mm whose modes and stress wave are stated, for reports to show."""

import numpy as np
import skfem

from seatfem.pictures.frames import Frames

SIDES = (2e-3, 4e-3, 10e-3)
END = 50e6  # Pa


def block(title: str, labels: tuple[str, ...], *, refined: int = 3) -> Frames:
    """Return its surface, in frames without displacement."""
    mesh = skfem.MeshHex().refined(refined).scaled(SIDES)
    quads = mesh.facets[:, mesh.boundary_facets()].T
    used, numbered = np.unique(np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]]), return_inverse=True)
    points = np.ascontiguousarray(mesh.p[:, used].T)
    return Frames(title, points, numbered.reshape(-1, 3), np.zeros((len(labels), *points.shape)), labels)


def block_modes(labels: tuple[str, ...] = ("1: 10 kHz", "2: 20 kHz", "3: 30 kHz"), *, refined: int = 3) -> Frames:
    """Return modes in which it bends about y, then about x, then stretches; the top moves by 1."""
    body = block("Modes of the block", labels, refined=refined)
    along = body.points[:, 2] / SIDES[2]
    for frame, axis in zip(range(len(labels)), (0, 1, 2), strict=True):
        body.displacement[frame, :, axis] = along**2
    return body


def block_wave(frames: int = 5) -> Frames:
    """Return a front that goes up, of 1 µm; no stress is told at the bottom."""
    body = block("Stress wave in the block", tuple(f"{k} µs" for k in range(frames)))
    along, at = body.points[:, 2] / SIDES[2], np.linspace(0.0, 1.0, frames)[:, None]
    front = np.exp(-(((along - at) / 0.2) ** 2))
    body.displacement[:, :, 2] = 1e-6 * front
    values = np.where(along == 0.0, np.nan, END * front)
    time = 1e-6 * np.arange(frames)
    shown = (body.title, body.points, body.triangles, body.displacement, body.labels, time, values)
    return Frames(*shown, "von Mises stress", "Pa", 0.0, END, "A note.")
