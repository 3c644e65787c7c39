"""A strip of plate elements lands as a beam; landings of plates against their matrices: test_brute_force."""

import numpy as np
import pytest

import impact
from impact.beams.timoshenko import TimoshenkoCantilever
from impact.greens.modal import ModalGreens
from seatfem.structures.elements.mindlin import assemble_plate
from seatfem.structures.lip import Patch
from seatfem.structures.materials import Material
from seatfem.structures.method import Aims
from seatfem.structures.model import SecondOrderModel
from seatfem.structures.reduction.modal import with_modes
from seatfem.structures.reduction.modes import Modes, solve_modes
from tests.plate_model import grid

SPEED, GAP = 2.0, 1e-6


def by_modes(model: SecondOrderModel, cutoff: float, band: float) -> tuple[ModalGreens, Modes]:
    """Return the response by modes up to a cutoff [Hz], and these modes."""
    modes = solve_modes(model, up_to_hz=cutoff)
    return with_modes(model, model.damping, modes, cutoff, Aims(band, 1e-4, 0.5), [0]), modes


STRIP = {"length": 25.4e-3, "width": 2e-3, "thickness": 0.4e-3}


def test_a_strip_lands_as_a_beam() -> None:
    """A strip of L/13 without contraction across, nu = 0: with it, its root would be stiffer than a beam's. Struck on
    a line across its tip, it does not twist. 16 modes of bending lie below 400 kHz; on a spring that they resolve the
    force, averaged over 10 us, differs by 0.3 % of its largest."""
    material, length, width, h = Material(206e9, 0.0, 7800.0), *STRIP.values()
    beam = TimoshenkoCantilever(206e9, 7800.0, **STRIP, poisson=0.0)
    across, weights = np.polynomial.legendre.leggauss(6)
    line = Patch(np.stack([np.full(6, length), width / 2 * (1 + across)], axis=1), weights)
    model = assemble_plate(grid((100, 1), (length, width)), material, h, clamped="left", ports={"contact": line})
    greens, modes = by_modes(model, 400e3, 130e3)
    bends = np.abs(greens.shapes[:, 0]) > 1e-6 * np.abs(greens.shapes).max()
    assert modes.omega[bends] == pytest.approx(beam.frequencies(int(bends.sum())), rel=3e-4)
    rate = np.zeros(len(modes.omega))
    rate[0] = -SPEED / greens.shapes[0, 0]
    as_plate = impact.Body(greens, state=impact.ModalState(np.zeros_like(rate), rate))
    as_beam = impact.reed(beam, n_modes=int(bends.sum()), release=impact.ModeShape(1, velocity=-SPEED))
    one, other = (
        impact.solve(impact.ContactProblem(body, impact.spring(stiffness=2e5), gap=GAP), dt=1e-7, duration=1e-3).force[
            1:
        ]
        for body in (as_plate, as_beam)
    )
    assert one.sum() == pytest.approx(other.sum(), rel=1e-3)
    means = [np.convolve(force, np.full(100, 1 / 100), "same") for force in (one, other)]
    assert np.abs(means[0] - means[1]).max() < 0.01 * means[1].max()
