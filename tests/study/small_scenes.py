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
TWO_PORTS = f"""
seat = {{ kind = "plate", ports = 2, layout = "row", port_radius = "4 mm", pitch = "12 mm", margin = "6 mm", \
    thickness = "6 mm", land_width = "1 mm", clamp_width = "2 mm", damping_ratio = 0.02, model = "3d", \
    mesh = {{ size = "4 mm", contact_size = "2 mm" }}, {STEEL} }}
reed = {{ kind = "flapper", root_width = "12 mm", taper_length = "3 mm", neck_width = "10 mm", neck_length = "20 mm", \
    paddle_diameter = "24 mm", thickness = "0.2 mm", damping_ratio = 0.02, greens = {{ bandwidth = "60 kHz" }}, \
    release = {{ mode = 1, velocity = "-2 m/s" }}, {STEEL} }}
contact = {{ ports = 16, rings = 1 }}
run = {{ duration = "0.1 ms", filter_width = "10 us", time_step = "100 ns" }}
accuracy = {{ target = "1 %", measures = ["impulse"] }}
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
    """Return tables put together; ``changes``: dotted keys with _ for the dot between table and key."""
    data: dict[str, Any] = tomllib.loads("\n".join(parts))
    for dotted, value in changes.items():
        *tables, key = dotted.split("__")
        table = data
        for name in tables:
            table = table.setdefault(name, {})
        table[key] = value
    return load.scene_of().model_validate(data)
