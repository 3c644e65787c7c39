"""CalculiX on a small mesh of ours: natural frequencies."""

import numpy as np
import pytest
import skfem

from benchmarks.peers import calculix
from seatfem.structures.elements.assembly import assemble
from seatfem.structures.materials import Material
from seatfem.structures.model import ModelError
from seatfem.structures.reduction.modes import solve_modes

STEEL = Material(200e9, 0.3, 7850.0)
SIDES = (8e-3, 6e-3, 4e-3)
here = pytest.mark.skipif(bool(calculix.absent()), reason=calculix.absent())


def block(kind=skfem.MeshTet, cells=(3, 2, 2)):
    """A block, clamped below, pushed above."""
    mesh = kind.init_tensor(*(np.linspace(0, side, n + 1) for side, n in zip(SIDES, cells, strict=True)))
    named = {"contact": lambda x: x[2] > SIDES[2] - 1e-9, "fixed": lambda x: x[2] < 1e-9}
    return assemble(mesh.with_boundaries(named), STEEL, order=2)


@here
def test_the_mass_explains_what_the_frequencies_differ_by():
    """With four points for our mass, too: the seven digits that it prints."""
    model = block()
    same = calculix.with_its_mass(model, STEEL)
    theirs = calculix.frequencies(model, STEEL, 5).values
    assert np.abs(theirs / solve_modes(same, 5).frequencies_hz - 1).max() < 1e-6


def test_hexahedra_are_refused():
    with pytest.raises(ModelError, match="tetrahedra of order 2"):
        calculix.same_mass(block(skfem.MeshHex), STEEL)
