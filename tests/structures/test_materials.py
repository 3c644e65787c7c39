"""Isotropic and orthotropic solids: stiffness, wave speeds, messages."""

import numpy as np
import pytest

from seatfem.structures.materials import Material, Orthotropic
from seatfem.structures.model import ModelError

STEEL = Material(200e9, 0.3, 7850.0, "steel")
WOOD = {"young": (12e9, 0.9e9, 0.5e9), "poisson": (0.4, 0.45, 0.5), "shear": (0.8e9, 0.7e9, 0.06e9), "density": 450.0}
TURN = ((0.8, 0.6, 0.0), (-0.36, 0.48, 0.8), (0.48, -0.64, 0.6))


def test_an_orthotropic_solid_with_isotropic_constants_is_isotropic_in_any_axes():
    shear = 200e9 / 2.6
    same = Orthotropic((200e9,) * 3, (0.3,) * 3, (shear,) * 3, 7850.0, axes=TURN)
    assert np.allclose(same.elasticity, STEEL.elasticity, rtol=1e-12, atol=1.0)
    assert same.c_p_along([[1.0, 2.0, 3.0]]) == pytest.approx([STEEL.c_p], rel=1e-12)
    assert same.c_s == pytest.approx(STEEL.c_s, rel=1e-9)


def test_orthotropic_compliance_has_the_engineering_constants():
    compliance = np.linalg.inv(Orthotropic(**WOOD).elasticity)
    assert 1 / np.diag(compliance)[:3] == pytest.approx(WOOD["young"], rel=1e-9)
    assert 1 / np.diag(compliance)[3:] == pytest.approx(WOOD["shear"][::-1], rel=1e-9)
    assert -compliance[0, 1] * 12e9 == pytest.approx(0.4, rel=1e-9)
    assert -compliance[1, 2] * 0.9e9 == pytest.approx(0.5, rel=1e-9)


@pytest.mark.parametrize(
    ("changed", "message"),
    [
        ({"young": (1e9, -1e9, 1e9)}, "young = .* Pa must be positive"),
        ({"poisson": (0.4, 0.45, 1.5)}, "strain energy of the wrong sign"),
        ({"axes": ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 1.0, 0.0))}, "three orthonormal rows"),
        ({"loss_factor": -0.1}, "loss_factor = -0.1 must be finite"),
        ({"rayleigh": (1.0, np.nan)}, "rayleigh = .* must be finite"),
    ],
)
def test_bad_orthotropic_constants(changed, message):
    with pytest.raises(ModelError, match=message):
        Orthotropic(**{**WOOD, **changed})
