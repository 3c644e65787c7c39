"""The impact by CalculiX's own direct dynamics and contact.

The mass is a rigid brick (its nodes' heights equal, *EQUATION), the patch a point that moves by the mean of the lip's
top (*EQUATION with the port's weights, so that its force is spread as ours is), between them a contact pair with a
linear penalty. The brick's face measures 1 m^2, as ccx takes the stiffness of a node's contact per area of the face.
"""

from __future__ import annotations

import re

import numpy as np

from benchmarks.peers import calculix
from benchmarks.peers.impact_scene import DURATION, MASS, SPEED, STEEL, STIFFNESS, Array, Course, of_points
from seatfem.structures.model import SecondOrderModel

TENSION = 1e-3  # Pa that an open contact of ccx pulls by at most
_CORNERS = ((-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0), (-1, -1, 2), (1, -1, 2), (1, 1, 2), (-1, 1, 2))


def march(model: SecondOrderModel, dt: float, duration: float = DURATION) -> tuple[Course, float]:
    """The force, of steps of ``dt`` [s], and the momentum that the mass itself lost [N s].

    *DYNAMIC, DIRECT with the numerical damping that comes with it (ALPHA = -0.05), small displacements.
    """
    count = round(duration / dt)
    lines, point, brick = _bodies(model)
    step = ["*DYNAMIC, DIRECT", f"{dt:.12e},{dt * count:.12e}"]
    step += [line for name, what in (("POINT", "U"), ("BRICK", "U,V")) for line in (f"*NODE PRINT, NSET={name}", what)]
    text, seconds = calculix.run(lines, step, f", INC={count + 1}")
    foot, moved, speed = (_heights(text, *of) for of in (("disp", point), ("disp", brick), ("velo", brick)))
    if len(foot) < count:
        raise calculix.PeerError(f"{calculix.NAME} ends after {len(foot)} of {count} steps")
    return of_points(STIFFNESS * np.maximum(foot - moved, 0.0), dt, seconds), MASS * (float(speed[-1]) + SPEED)


def _bodies(model: SecondOrderModel) -> tuple[list[str], int, int]:
    """The deck but for its step; the point's node and the first of the brick."""
    [port] = model.ports.values()
    weights = calculix.unknowns(model).expand(port.vector)
    point = weights.shape[1] + 1
    brick = np.arange(point + 1, point + 9)
    nodes = [f"{n},{100 + x / 2},{y / 2},{z / 2}" for n, (x, y, z) in zip(brick, _CORNERS, strict=True)]
    mean = [f"{point},3,1."]
    mean += [f"{node + 1},{axis + 1},{-weights[axis, node]:.12e}" for node, axis in np.argwhere(weights.T)]
    lines = [*calculix.body_lines(model, STEEL), "*NODE", f"{point},100,0,0", *nodes]
    last = calculix.unknowns(model).mesh.nelements + 1
    lines += ["*ELEMENT, TYPE=C3D8, ELSET=MASS", ",".join(map(str, [last, *brick]))]
    lines += ["*MATERIAL, NAME=RIGID", "*ELASTIC", "1e12,0.", "*DENSITY", f"{MASS:.12g}"]
    lines += ["*SOLID SECTION, ELSET=MASS, MATERIAL=RIGID"]
    lines += [*calculix.node_set("POINT", np.array([point - 1])), *calculix.node_set("BRICK", brick - 1)]
    lines += ["*BOUNDARY", "POINT,1,2", "BRICK,1,2", "*EQUATION", f"{len(mean)}"]
    lines += [",".join(mean[k : k + 4]) for k in range(0, len(mean), 4)]
    for node in brick[1:]:
        lines += ["*EQUATION", "2", f"{node},3,1.,{brick[0]},3,-1."]
    lines += ["*SURFACE, NAME=FOOT, TYPE=NODE", "POINT", "*SURFACE, NAME=FACE", "MASS,S1"]
    lines += ["*SURFACE INTERACTION, NAME=SPRING", "*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=LINEAR"]
    lines += [f"{STIFFNESS:.12g},{TENSION:g}", "*CONTACT PAIR, INTERACTION=SPRING, TYPE=NODE TO SURFACE", "FOOT,FACE"]
    lines += ["*INITIAL CONDITIONS, TYPE=VELOCITY", f"BRICK,3,{-SPEED:.12g}"]
    return lines, point, int(brick[0])


def _heights(text: str, what: str, node: int) -> Array:
    """(steps,) third component of a node, of displacements ("disp") or velocities ("velo")."""
    blocks = re.split(r"^ (?=displacements|velocities)", text, flags=re.MULTILINE)
    rows = (re.search(rf"^ +{node} +\S+ +\S+ +(\S+)", block, re.MULTILINE) for block in blocks if block[:4] == what)
    return np.array([float(row[1]) for row in rows if row])
