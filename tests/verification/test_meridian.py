"""The same annular seat in its meridian and in space: one Green's function, within what their meshes leave open."""

from functools import cache

import numpy as np

from seatfem.structures.elements.assembly import assemble
from seatfem.structures.elements.axisymmetric import assemble_axisymmetric
from seatfem.structures.materials import Material
from seatfem.structures.mesh.meshing import make_mesh
from seatfem.structures.mesh.plane_meshes import make_meridian
from seatfem.structures.mesh.spec import MeshSpec
from seatfem.structures.reduction.greens import greens_function
from seatfem.structures.shapes import AnnularSeat

STEEL = Material(200e9, 0.3, 7850.0)
SEAT = AnnularSeat(bore_radius=2e-3, lip_width=1e-3, outer_radius=5e-3, thickness=3e-3)
BAND, DURATION = 150e3, 40e-6
TIMES = np.linspace(0, DURATION, 201)


def solve(model):
    return greens_function(model, bandwidth=BAND, duration=DURATION, tolerance=2e-3, damping_ratio=0.03)


def response(greens, stiffer=1.0):
    """g after the Hann pulse; of a modulus multiplied by ``stiffer`` = c^2 it is g(c t)/c, exactly."""
    c = np.sqrt(stiffer)
    return greens.filtered(TIMES * c, c / BAND) / c


def difference(one, other):
    return float(np.abs(one - other).max() / np.abs(other).max())


def in_space(size):
    """A quarter of the seat, by tetrahedra."""
    mesh = make_mesh(SEAT, MeshSpec(size=size, contact_size=size / 2), sector=4)
    return solve(assemble(mesh, STEEL, sliding=("symmetry_0", "symmetry_1"), copies=4))


@cache
def in_meridian(shape, mass="consistent"):
    mesh = make_meridian(SEAT, MeshSpec(size=0.5e-3, contact_size=0.25e-3, shape=shape))
    return solve(assemble_axisymmetric(mesh, STEEL, mass=mass))


def test_triangles_quadrilaterals_and_nodal_mass_agree():
    reference = in_meridian("hex")
    for other in (in_meridian("tet"), in_meridian("hex", "nodal")):
        stated = reference.error_estimate.reduction + other.error_estimate.reduction
        assert difference(response(other), response(reference)) < stated + 5e-4  # measured 7e-4, 1e-4
        assert difference(response(other), response(reference, 1.03)) > 10 * (stated + 5e-4)


def test_meridian_equals_the_seat_in_space():
    """The clamped corners are singular, so that tetrahedra may converge at first order only: step/(ratio - 1)."""
    coarse, fine = in_space(2e-3), in_space(1.4e-3)
    flat = in_meridian("hex")
    mesh_error = difference(response(coarse), response(fine)) / (2.0 / 1.4 - 1)
    stated = mesh_error + fine.error_estimate.reduction + flat.error_estimate.reduction
    assert difference(response(fine), response(flat)) < stated < 0.035  # measured 1.6 %
    assert difference(response(coarse), response(flat)) > difference(response(fine), response(flat))
    assert difference(response(fine, 1.03), response(flat)) > stated
