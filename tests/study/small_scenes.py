"""Tables of small scenes, and a scene of some of them."""

import tomllib
from typing import Any

from seatfem.study.scene import Scene, load

STEEL = 'material = { young = "200 GPa", poisson = 0.3, density = "7850 kg/m^3" }'
ANNULAR = f"""
seat = {{ kind = "annular", bore_radius = "4 mm", lip_width = "1 mm", damping_ratio = 0.05, {STEEL} }}
"""
BAR = f"""
seat = {{ kind = "bar", length = "40 mm", width = "4 mm", height = "4 mm", damping_ratio = 0.02, {STEEL} }}
"""
PLATE = f"""
seat = {{ kind = "plate", ports = 4, port_radius = "3 mm", pitch = "10 mm", margin = "5 mm", thickness = "3 mm", \
    land_width = "1 mm", clamp_width = "2 mm", damping_ratio = 0.02, {STEEL} }}
"""
SPRING = 'seat = { kind = "spring", stiffness = "27.8 N/um" }'
REED = """
reed = { kind = "cantilever", length = "25.4 mm", damping_ratio = 0.03, release = { tip_deflection = "1 mm" } }
run = { duration = "1 ms" }
"""
MASS = """
reed = { kind = "rigid_mass", mass = "5 g", velocity = "-1 m/s" }
run = { duration = "0.1 ms", filter_width = "4 us" }
"""


def scene_of(*parts: str, **changes: object) -> Scene:
    """Tables put together; ``changes``: dotted keys with _ for the dot between table and key."""
    data: dict[str, Any] = tomllib.loads("\n".join(parts))
    for dotted, value in changes.items():
        *tables, key = dotted.split("__")
        table = data
        for name in tables:
            table = table.setdefault(name, {})
        table[key] = value
    return load.scene_of().model_validate(data)
