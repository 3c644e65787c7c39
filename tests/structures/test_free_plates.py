"""Free plates: their frequencies against Kirchhoff's circular plate, their rigid motions, their mass."""

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import brentq
from scipy.special import iv, ivp, jv, jvp

from seatfem.structures.mesh.plane_meshes import make_meridian, mesh_sheet
from seatfem.structures.method import BEYOND, Aims
from seatfem.structures.reduction.modal import with_modes
from seatfem.structures.shapes import AnnularSeat, Disc, Flat, RingPlate
from seatfem.structures.sheets import Sheet, SolvedSheet, model_of, solved_sheet
from tests.solids import Material, MeshSpec, SecondOrderModel, assemble_axisymmetric, solve_modes
from tests.steps import Lip, ModalGreens, ModelError

STEEL = Material(206e9, 0.33, 7800.0)
THIN = Disc(20e-3, 0.04e-3)
RING = RingPlate(20e-3, 10e-3, 0.5e-3)
LEISSA = {(2, 0): 5.253, (0, 1): 9.084, (3, 0): 12.23, (1, 1): 20.52}
"""lambda^2 = w a^2 sqrt(rho h/D) by nodal diameters and circles, nu = 0.33: A. W. Leissa, Vibration of Plates, NASA
SP-160 (1969), table 2.5; the values are rounded and up to 0.2 % off their own equation."""


def edge(n: int, nu: float, k: float) -> float:
    """Return 0 where J_n(k r/a) + c I_n(k r/a) has no moment and no edge force. Source: Leissa, equation 2.8."""
    j, dj, i, di = jv(n, k), jvp(n, k), iv(n, k), ivp(n, k)
    moments = k**2 * j + (1 - nu) * (k * dj - n**2 * j), k**2 * i - (1 - nu) * (k * di - n**2 * i)
    forces = k**3 * dj + (1 - nu) * n**2 * (k * dj - j), k**3 * di - (1 - nu) * n**2 * (k * di - i)
    return float((moments[0] * forces[1] - moments[1] * forces[0]) / i**2)


@pytest.fixture(scope="module")
def thin() -> SolvedSheet:
    """Solve a sheet with h/a = 0.004: shear takes 1e-5 of its frequencies."""
    return solved_sheet(Sheet(THIN, STEEL, 1.5e3), (Lip.disc(1e-3),), 0.0)


@pytest.mark.slow
def test_frequencies_of_a_free_disc(thin: SolvedSheet) -> None:
    """Elements a fifth of the cutoff's wave have Kirchhoff's frequencies and pairs to 0.1 % (measured 0.06)."""
    rigidity = STEEL.young * THIN.thickness**3 / (12 * (1 - STEEL.poisson**2))
    scale = (THIN.diameter / 2) ** 2 * math.sqrt(STEEL.density * THIN.thickness / rigidity)
    scaled = thin.plate.modes.omega * scale
    for mode, ((n, _), published) in zip((3, 5, 6, 8), LEISSA.items(), strict=True):
        root = brentq(lambda k, n=n: edge(n, STEEL.poisson, k), *(math.sqrt(published * f) for f in (0.98, 1.02)))
        assert root**2 == pytest.approx(published, rel=2e-3)
        assert scaled[mode] == pytest.approx(root**2, rel=1e-3)
        if n:
            assert scaled[mode + 1] == pytest.approx(scaled[mode], rel=1e-3)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("shape", "band", "lip"),
    [
        (THIN, 1.5e3, Lip.disc(1e-3)),
        (replace(THIN, thickness=0.5e-3), 30e3, Lip(5e-3, 1e-3)),
        (RING, 50e3, Lip(7.5e-3, 1e-3)),
        (replace(RING, thickness=2e-3), 5e3, Lip(7.5e-3, 1e-3)),  # no elastic mode below the cutoff
    ],
)
def test_three_rigid_modes_and_its_mass(shape: Flat, band: float, lip: Lip) -> None:
    """w = 1, x, y alone cost no energy; pushed about its centre, it has the mass of the drawing, not of the mesh."""
    solved = solved_sheet(Sheet(shape, STEEL, band), (lip,), 0.0)
    assert solved.plate.modes.complete
    assert np.sum(solved.plate.modes.omega == 0) == 3
    assert not solved.plate.modes.frequencies_hz[:3].any()
    assert solved.greens.mass() == pytest.approx(STEEL.density * shape.area * shape.thickness, rel=1e-9)
    assert solved.greens.residual.static()[0, 0] > 0


@pytest.mark.slow
def test_what_its_modes_leave_out(thin: SolvedSheet) -> None:
    """The residual of modes to a third of the band holds the compliance of those above, to the 0.1 % of the shift,
    which the infinite one of rigid modes does not hide."""
    narrow = solved_sheet(Sheet(THIN, STEEL, 0.5e3, size=1.2e-3), (Lip.disc(1e-3),), 0.0)
    wide = solved_sheet(Sheet(THIN, STEEL, 5e3, size=1.2e-3), (Lip.disc(1e-3),), 0.0)
    between = wide.greens.omega > narrow.greens.omega[-1] * (1 + 1e-6)
    shapes = wide.greens.shapes[between, 0] / wide.greens.omega[between]
    expected = float(shapes @ shapes) + wide.greens.residual.static()[0, 0]
    assert narrow.greens.residual.static()[0, 0] == pytest.approx(expected, rel=1.5e-3)
    assert float(shapes @ shapes) > 0.85 * expected


def difference_from_solid(thickness: float, share: float) -> float:
    """Return by how much g of a ring plate at the hole differs from that of the same ring as a solid of revolution.

    It is judged after the Hann pulse of the band at which the thickness is this share of the bending wave, for five
    widths of the pulse, later the rigid motion hides the rest, and relative to the largest g of the solid.
    """
    inner, outer, land, steel = 4e-3, 12e-3, 1e-3, Material(206e9, 0.3, 7800.0)
    shape = RingPlate(2 * outer, 2 * inner, thickness)
    band = (share * Sheet(shape, steel, 1.0).bending_wave(1.0) / thickness) ** 2
    solid = AnnularSeat(inner, land, 0.0, lip_edge_radius=0.0, outer_radius=outer, thickness=thickness)
    mesh = make_meridian(solid, MeshSpec(min(thickness / 4, 0.4e-3), 0.12e-3))
    sheet = Sheet(shape, steel, band / 10, size=Sheet(shape, steel, band).element_size)  # by itself it would be refused

    def response(model: SecondOrderModel) -> np.ndarray:
        cutoff, aims = BEYOND * band, Aims(band, 5 / band, 0.1)
        modes = solve_modes(model, up_to_hz=cutoff)
        greens: ModalGreens = with_modes(model, model.damping.plus(0.01), modes, cutoff, aims, [0])
        return greens.filtered(np.linspace(0.0, 5 / band, 200), 1 / band)

    plate = response(model_of(sheet, (Lip(inner + land / 2, land),)))
    right = response(assemble_axisymmetric(mesh, steel, fixed=()))
    return float(np.abs(plate - right).max() / np.abs(right).max())


@pytest.mark.slow
def test_a_plate_is_its_solid_while_waves_are_long() -> None:
    """A ring almost as thick as wide is off a solid of revolution by 0.3, 1.6 and 5.7 % (measured) as its thickness is
    1/6, 1/4 and 1/3 of the shortest wave; beyond, the plate is refused."""
    thickness = 0.94 * 8e-3
    off = [difference_from_solid(thickness, share) for share in (1 / 6, 1 / 4, 1 / 3)]
    assert off[0] < 0.005
    assert off[1] < 0.025
    assert 0.04 < off[2] < 0.08
    with pytest.raises(ModelError, match=r"reed\.thickness = 7\.52 mm.*0\.34"):
        Sheet(RingPlate(24e-3, 8e-3, thickness), STEEL, 150e3).check()


def test_elements_that_would_fold_are_made_smaller() -> None:
    """About 4 elements around the hole of this ring fold; half of the size has the area of the ring."""
    ring = RingPlate(10.3562e-3, 4.9233e-3, 0.6042e-3)
    mesh = mesh_sheet(ring, 1.41e-3)
    assert len(mesh.cells) > 92
    assert mesh.area == pytest.approx(ring.area, rel=1e-3)
