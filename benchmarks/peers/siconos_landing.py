"""A rigid mass on a seat by Siconos, on the modes of the plain program.

python -m benchmarks.peers.siconos_landing SCENE.toml LEVEL
"""

from __future__ import annotations

import json
import sys
from pathlib import Path

import numpy as np

from benchmarks.peers import siconos_impact
from benchmarks.peers.plain_program import bodies_of, fidelity, number, read_measures, read_scene


def main(path: Path, level: int) -> None:
    """Print the measures by the theta rule, in steps of a quarter of those of the plain program."""
    scene, fine = read_scene(path), fidelity(level)
    striker, seat, _ = bodies_of(scene, fine)
    law, (duration,) = number(scene["contact"]["law"]["stiffness"]), (number(scene["run"]["duration"]),)
    dt = duration / (4 * np.ceil(duration / fine.step))
    impact = siconos_impact.Impact(
        mass=1 / striker.shapes[0] ** 2, speed=-number(scene["reed"]["velocity"]), duration=duration,
        stiffness=1 / (1 / law + striker.residual + seat.residual),
    )  # fmt: skip
    force = siconos_impact.march(seat.omega, seat.shapes, (dt,), impact)[0].force[:, None]
    nothing = np.zeros(0)
    measures = read_measures(scene, None, force, np.zeros((len(force), 0)), nothing, nothing, dt)
    print(json.dumps(measures))  # noqa: T201


if __name__ == "__main__":
    main(Path(sys.argv[1]), int(sys.argv[2]))
