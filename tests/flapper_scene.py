"""The flapper of the tests as a table of a scene: modes at 196.6, 915.2 (torsion) and 1644 Hz."""

from typing import Final

FLAPPER: Final = """kind = "flapper"
root_width = "8 mm"
taper_length = "2 mm"
neck_width = "6 mm"
neck_length = "15 mm"
paddle_diameter = "16 mm"
thickness = "0.3 mm"
material = { young = "206 GPa", poisson = 0.3, density = "7800 kg/m^3" }
"""
