"""Scenes that mutations start from: every kind of seat and striker, every table."""

import re
from collections.abc import Mapping
from pathlib import Path
from typing import Final

STEEL: Final = 'material = { young = "200 GPa", poisson = 0.3, density = "7850 kg/m^3" }\n'
WOOD: Final = """
[seat.material]
kind = "orthotropic"
young = ["200 GPa", "100 GPa", "50 GPa"]
poisson = [0.3, 0.2, 0.25]
shear = ["70 GPa", "60 GPa", "40 GPa"]
density = "7850 kg/m^3"
axes = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]
loss_factor = 0.01
"""
SUPPORTS: Final = """
[[seat.supports]]
kind = "foundation"
on = "contact"
normal = "2 GPa/mm"
tangential = "1 GPa/mm"
[[seat.supports]]
kind = "bolted"
on = "contact"
normal = "2 GPa/mm"
[[seat.supports]]
kind = "absorbing"
on = "contact"
[[seat.supports]]
kind = "dashpot"
on = "contact"
normal = "4e7 N*s/m^3"
[[seat.supports]]
kind = "sliding"
on = "contact"
"""
BALL: Final = '[reed]\nkind = "rigid_mass"\nmass = "1 g"\nvelocity = "-1 m/s"\n'
REED: Final = """[reed]
kind = "cantilever"
length = "25.4 mm"
width = "10 mm"
thickness = "0.305 mm"
damping_ratio = 0.03
n_modes = 4
release = { tip_deflection = "1 mm" }
[reed.material]
young = "200 GPa"
density = "7850 kg/m^3"
[contact]
law = "signorini"
at = "25 mm"
gap = "10 um"
"""
RUN: Final = '[run]\nduration = "0.4 ms"\nfilter_width = "10 us"\n'
STEP: Final = 'time_step = "0.5 us"\n'
TARGET: Final = '[accuracy]\ntarget = "5 %"\nmeasures = ["impulse", "filtered_peak", "contact_duration"]\n'
COARSE: Final = (
    'mesh = { size = "4 mm", contact_size = "2 mm", order = 1 }\ngreens = { bandwidth = "50 kHz", tolerance = "5 %" }\n'
)

# Seats that cost nothing: run to the end.
CHEAP: Final[Mapping[str, str]] = {
    "spring-reed": '[seat]\nkind = "spring"\nstiffness = "27.8 N/um"\n' + REED + RUN + STEP + TARGET,
    "spring-mass": '[seat]\nkind = "spring"\nstiffness = "27.8 N/um"\n' + BALL + RUN,
    "rod-area": '[seat]\nkind = "rod"\nyoung = "200 GPa"\ndensity = "7850 kg/m^3"\nlength = "30 mm"\n'
    'area = "4 mm^2"\ndamping_ratio = 0.1\n' + REED + RUN + TARGET,
    "rod-strip": '[seat]\nkind = "rod"\nyoung = "200 GPa"\ndensity = "7850 kg/m^3"\nlength = "3 mm"\n'
    'width = "10 mm"\nthickness = "0.4 mm"\n' + BALL + RUN + STEP,
    "bar-as-rod": '[seat]\nkind = "bar"\nlength = "100 mm"\nwidth = "2 mm"\nheight = "2 mm"\n'
    'model = "rod"\n' + STEEL + BALL + RUN + TARGET,
}

LIFE: Final = (
    '[life]\nstrength = "strength.toml"\ncriterion = "walker"\nsurvival = 0.999\nhours = 25000\nrpm = 3000\n'
    'block = "run"\nimpact_speed_limit = "8 m/s"\nsource = "invented"\n'
)
STRENGTH: Final = """source = "invented"
temperature = "120 degC"
specimens = 30
ultimate = "1800 MPa"
walker_exponent = 0.65
loading_ratio = 0
impact_velocity = "8 m/s"
[curve]
points = [["500 MPa", 1e5], ["400 MPa", 1e7], ["380 MPa", 1e9]]
scatter = 0.25
survival = "90 %"
"""

# Seats of finite elements: carried out up to the call of gmsh, a few of them to the end.
DRAWN: Final[Mapping[str, str]] = {
    "annular": '[seat]\nkind = "annular"\nbore_radius = "4 mm"\nlip_width = "1 mm"\nlip_height = "0.5 mm"\n'
    'lip_edge_radius = "0.1 mm"\nouter_radius = "12 mm"\nthickness = "8 mm"\nfixed = "underside"\n'
    'model = "auto"\ndamping_ratio = 0.1\n' + COARSE + STEEL + REED + RUN + TARGET,
    "annular-arc": '[seat]\nkind = "annular"\narc = "60 deg"\nbore_radius = "4 mm"\nlip_width = "1 mm"\n'
    'rayleigh = { mass = "10 1/s", stiffness = "1 ns" }\n' + COARSE + STEEL + SUPPORTS + BALL + RUN,
    "conical": '[seat]\nkind = "conical"\nbore_radius = "4 mm"\nhalf_angle = "45 deg"\nface_width = "3 mm"\n'
    'contact_width = "1 mm"\nouter_radius = "12 mm"\nthickness = "8 mm"\nmodel = "axisymmetric"\n'
    + COARSE
    + STEEL
    + BALL
    + RUN,
    "stopper": '[seat]\nkind = "stopper"\nradius = "8 mm"\nthickness = "5 mm"\ncontact_radius = "3 mm"\n'
    'dome_radius = "40 mm"\nmodel = "sector"\n' + COARSE + STEEL + BALL + RUN,
    "plate": '[seat]\nkind = "plate"\nports = 3\nport_radius = "3 mm"\npitch = "10 mm"\nmargin = "5 mm"\n'
    'thickness = "4 mm"\nland_width = "1 mm"\nclamp_width = "2 mm"\nlayout = "row"\nstruck = 2\nfixed = "rim"\n'
    + COARSE
    + STEEL
    + BALL
    + RUN,
    "flapper": '[seat]\nkind = "spring"\nstiffness = "27.8 N/um"\n[reed]\nkind = "flapper"\nroot_width = "8 mm"\n'
    'taper_length = "2 mm"\nneck_width = "6 mm"\nneck_length = "15 mm"\npaddle_diameter = "16 mm"\n'
    'thickness = "0.3 mm"\ndamping_ratio = 0.01\ncontact_radius = "5.5 mm"\ncontact_width = "1 mm"\n'
    'greens = { bandwidth = "30 kHz" }\nmesh = { size = "2 mm" }\nrelease = { mode = 1, velocity = "-1 m/s" }\n'
    + STEEL
    + RUN
    + TARGET,
    "ring-plate": '[seat]\nkind = "spring"\nstiffness = "27.8 N/um"\n[reed]\nkind = "ring_plate"\n'
    'outer_diameter = "20 mm"\ninner_diameter = "10 mm"\nthickness = "1 mm"\ndamping_ratio = 0.01\n'
    'contact_radius = "7 mm"\ncontact_width = "1 mm"\ngreens = { bandwidth = "30 kHz" }\nmesh = { size = "2 mm" }\n'
    'velocity = "-1 m/s"\n' + STEEL + RUN + TARGET,
    "disc": '[seat]\nkind = "spring"\nstiffness = "27.8 N/um"\n[reed]\nkind = "disc"\ndiameter = "20 mm"\n'
    'thickness = "1 mm"\ngreens = { bandwidth = "30 kHz" }\nvelocity = "-1 m/s"\n' + STEEL + RUN + TARGET,
    "sheet": '[seat]\nkind = "spring"\nstiffness = "27.8 N/um"\n[reed]\nkind = "sheet"\n'
    'outline = [["0 mm", "-4 mm"], ["20 mm", "-3 mm"], ["20 mm", "3 mm"], ["0 mm", "4 mm"]]\n'
    'clamped = { normal = [-1, 0], offset = "-2 mm" }\ncontact_at = ["17 mm", "0 mm"]\nthickness = "0.5 mm"\n'
    'greens = { bandwidth = "30 kHz" }\nmesh = { size = "2 mm" }\nrelease = { velocity = "-1 m/s" }\n'
    + STEEL
    + RUN
    + TARGET,
    "stepped": '[seat]\nkind = "spring"\nstiffness = "27.8 N/um"\n[reed]\nkind = "stepped"\n'
    'widths = [["0 mm", "8 mm"], ["2 mm", "6 mm"], ["15 mm", "6 mm"], ["15 mm", "16 mm"], ["30 mm", "0 mm"]]\n'
    'thickness = "0.3 mm"\nn_modes = 4\nrelease = { tip_deflection = "1 mm" }\n' + STEEL + RUN + TARGET,
    "ball": '[seat]\nkind = "spring"\nstiffness = "27.8 N/um"\n[reed]\nkind = "ball"\ndiameter = "10 mm"\n'
    'contact_radius = "0.6 mm"\nvelocity = "-1 m/s"\n' + COARSE + STEEL + RUN + TARGET,
    "bar": '[seat]\nkind = "bar"\nlength = "10 mm"\nwidth = "4 mm"\nheight = "3 mm"\nfixed = "end"\nmodel = "3d"\n'
    + COARSE
    + BALL
    + RUN
    + WOOD
    + SUPPORTS,
    "block": '[seat]\nkind = "block"\nwidth = "20 mm"\ndepth = "20 mm"\nthickness = "8 mm"\npatch_width = "4 mm"\n'
    'patch_depth = "4 mm"\nfixed = "underside"\n' + COARSE + STEEL + '[seat.materials.seat]\nyoung = "100 GPa"\n'
    'density = "7000 kg/m^3"\nloss_factor = 0.02\n' + BALL + RUN,
    "cad": '[seat]\nkind = "cad"\nfile = "part.step"\nunit = "mm"\n'
    'contact = { kind = "plane", normal = [0, 0, 1], offset = "8.5 mm", radius_min = "1 mm", radius_max = "9 mm" }\n'
    'fixed = { kind = "colour", colour = [0, 0, 255] }\n' + COARSE + STEEL + BALL + RUN,
    "mesh-file": '[seat]\nkind = "mesh"\nfile = "ring.inp"\nunit = "inch"\ncontact = "contact"\nfixed = "fixed"\n'
    'greens = { bandwidth = "50 kHz", tolerance = "5 %" }\n' + STEEL + BALL + RUN,
}

# Seats from files; each file is a starting point of its own.
GREENS: Final = '[seat]\nkind = "greens"\nfile = "seat.h5"\n' + BALL + RUN + STEP + TARGET
MATRICES: Final = (
    '[seat]\nkind = "matrices"\nmass = "M{0}"\nstiffness = "K{0}"\ncontact = "port.csv"\nsystem = "SI"\n'
    'first_dof = 1\ndamping_ratio = 0.01\ngreens = {{ bandwidth = "50 kHz", tolerance = "5 %" }}\n'
)
MODES: Final = (
    '[seat]\nkind = "modes"\nfile = "modes.uff"\nnode = 7\ndirection = "+z"\nsystem = "SI"\n' + REED + RUN + STEP
)
RESPONSE: Final = '[seat]\nkind = "frf"\nfile = "frf.{0}"\nnode = 7\ndirection = "+z"\ntolerance = "5 %"\n'
MESH: Final = (
    '[seat]\nkind = "mesh"\nfile = "{0}"\nunit = "inch"\nmaterial = {{ young = "200 GPa", density = "7850 kg/m^3" }}\n'
    'contact = "{1}"\nfixed = "{2}"\ngreens = {{ bandwidth = "50 kHz", tolerance = "5 %" }}\n'
)


def of_examples() -> dict[str, str]:
    """The scenes of the folder examples/, by name, a tenth as long."""
    folder = Path(__file__).parents[2] / "examples"
    texts = {path.stem: path.read_text(encoding="utf-8") for path in sorted(folder.glob("*.toml"))}
    return {name: re.sub(r'(duration = ")(\d)', r"\g<1>0.\2", text) for name, text in texts.items()}
