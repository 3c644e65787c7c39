"""Three roads to the Green's function of one annular seat, and its modes by a path that shares no code with ours."""

import itertools

import numpy as np
import pytest
import skfem
from scipy.sparse.linalg import eigsh
from skfem.helpers import dot
from skfem.models.elasticity import linear_elasticity

from seatfem.assembly import assemble
from seatfem.geometry import AnnularSeat
from seatfem.greens import greens_function
from seatfem.mesh_spec import MeshSpec
from seatfem.meshing import make_mesh
from seatfem.model import Material
from seatfem.modes import solve_modes

STEEL = Material(200e9, 0.3, 7850.0)
BANDWIDTH, DURATION, TOLERANCE = 1.5e5, 4e-5, 3e-2


@pytest.fixture(scope="module")
def mesh():
    seat = AnnularSeat(bore_radius=2e-3, lip_width=1e-3, outer_radius=5e-3, thickness=3e-3)
    return make_mesh(seat, MeshSpec(size=2e-3, contact_size=1.2e-3)).mesh


@pytest.mark.parametrize("rayleigh", [None, (2e4, 2e-8)], ids=["undamped", "Rayleigh"])
def test_the_three_roads_agree_within_their_stated_errors(mesh, rayleigh):
    model = assemble(mesh, STEEL, rayleigh=rayleigh)
    t = np.linspace(0, DURATION, 301)
    response, stated = {}, {}
    for method in ("krylov", "modes", "transient"):
        greens = greens_function(model, bandwidth=BANDWIDTH, duration=DURATION, tolerance=TOLERANCE, method=method)
        response[method] = greens.filtered(t, 1 / BANDWIDTH)
        stated[method] = greens.error_estimate.reduction
        assert 0 < stated[method] <= TOLERANCE
    scale = np.abs(response["krylov"]).max()
    for one, other in itertools.combinations(response, 2):
        assert np.abs(response[one] - response[other]).max() / scale <= stated[one] + stated[other], (one, other)


def test_modes_equal_scipys_on_scikit_fems_own_matrices(mesh):
    """skfem.asm, skfem.condense, eigsh with its own factorization; same quadrature: the curved elements' 4 and 6."""

    @skfem.BilinearForm
    def mass(u, v, _):
        return STEEL.density * dot(u, v)

    vector = skfem.ElementVector(skfem.ElementTetP2())
    basis = skfem.Basis(mesh, vector, intorder=4)
    K = skfem.asm(linear_elasticity(*STEEL.lame), basis)
    M = skfem.asm(mass, skfem.Basis(mesh, vector, intorder=6))
    free = basis.complement_dofs(basis.get_dofs("fixed"))
    values = eigsh(K[free][:, free], 8, M[free][:, free], sigma=0.0, return_eigenvectors=False)
    theirs = np.sqrt(np.sort(values)) / (2 * np.pi)
    ours = solve_modes(assemble(mesh, STEEL), 8)
    assert ours.complete
    assert ours.frequencies_hz == pytest.approx(theirs, rel=1e-8)  # both solve to round-off times the condition
