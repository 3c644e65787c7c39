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
from seatfem.structures.formats.calculix_deck import PATCH, CalculixBody, calculix_body
from seatfem.structures.model import SecondOrderModel

TENSION = 1e-3  # Pa that an open contact of ccx pulls by at most
_CORNERS = ((-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0), (-1, -1, 2), (1, -1, 2), (1, 1, 2), (-1, 1, 2))


def march(model: SecondOrderModel, dt: float, duration: float = DURATION) -> tuple[Course, float]:
    """The force, of steps of ``dt`` [s], and the momentum that the mass itself lost [N s].

    *DYNAMIC, DIRECT with the numerical damping that comes with it (ALPHA = -0.05), small displacements.
    """
    count = round(duration / dt)
    deck = calculix_body(calculix.tetrahedra(model), STEEL)
    brick = deck.node + 1
    step = [f"*STEP, INC={count + 1}", "*DYNAMIC, DIRECT", f"{dt:.12e},{dt * count:.12e}"]
    step += ["*NODE PRINT, NSET=BRICK", "U,V", f"*NODE PRINT, NSET={PATCH}", "U", "*END STEP"]
    text, seconds = calculix.run([*deck.lines, *_mass(deck), *step])
    foot, moved, speed = (_heights(text, *of) for of in (("disp", deck.node), ("disp", brick), ("velo", brick)))
    if len(foot) < count:
        raise calculix.PeerError(f"{calculix.NAME} ends after {len(foot)} of {count} steps")
    return of_points(STIFFNESS * np.maximum(foot - moved, 0.0), dt, seconds), MASS * (float(speed[-1]) + SPEED)


def _mass(deck: CalculixBody) -> list[str]:
    """The brick above the patch's node, which stands at the origin, and their contact."""
    brick = range(deck.node + 1, deck.node + 9)
    lines = ["*NODE, NSET=BRICK"]
    lines += [f"{n},{x / 2},{y / 2},{z / 2}" for n, (x, y, z) in zip(brick, _CORNERS, strict=True)]
    lines += ["*ELEMENT, TYPE=C3D8, ELSET=MASS", ",".join(map(str, [deck.cells + 1, *brick]))]
    lines += ["*MATERIAL, NAME=RIGID", "*ELASTIC", "1e12,0.", "*DENSITY", f"{MASS:.12g}"]
    lines += ["*SOLID SECTION, ELSET=MASS, MATERIAL=RIGID", "*BOUNDARY", f"{PATCH},1,2", "BRICK,1,2"]
    for node in brick[1:]:
        lines += ["*EQUATION", "2", f"{node},3,1.,{brick[0]},3,-1."]
    lines += ["*SURFACE, NAME=FOOT, TYPE=NODE", PATCH, "*SURFACE, NAME=FACE", "MASS,S1"]
    lines += ["*SURFACE INTERACTION, NAME=SPRING", "*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=LINEAR"]
    lines += [f"{STIFFNESS:.12g},{TENSION:g}", "*CONTACT PAIR, INTERACTION=SPRING, TYPE=NODE TO SURFACE", "FOOT,FACE"]
    return [*lines, "*INITIAL CONDITIONS, TYPE=VELOCITY", f"BRICK,3,{-SPEED:.12g}"]


def _heights(text: str, what: str, node: int) -> Array:
    """(steps,) third component of a node, of displacements ("disp") or velocities ("velo")."""
    blocks = re.split(r"^ (?=displacements|velocities)", text, flags=re.MULTILINE)
    rows = (re.search(rf"^ +{node} +\S+ +\S+ +(\S+)", block, re.MULTILINE) for block in blocks if block[:4] == what)
    return np.array([float(row[1]) for row in rows if row])
