"""Materials, meshes, matrices and modes as tests take them, from one place: where each lives is the product's."""
# ruff: noqa: F401 (they are for the tests)

from seatfem.structures.elements.assembly import assemble
from seatfem.structures.elements.axisymmetric import assemble_axisymmetric
from seatfem.structures.errors import GeometryError, MeshError, ModelError
from seatfem.structures.formats.mesh_files import read_mesh
from seatfem.structures.inspection.cad import inspect_geometry
from seatfem.structures.materials import Material, Orthotropic
from seatfem.structures.mesh.gmsh_process import MeshingError
from seatfem.structures.mesh.meshing import make_mesh
from seatfem.structures.mesh.plane_meshes import make_meridian
from seatfem.structures.mesh.spec import MeshSpec
from seatfem.structures.method import Aims
from seatfem.structures.model import Port, SecondOrderModel
from seatfem.structures.reduction.factorization import factorize
from seatfem.structures.reduction.greens import greens_function
from seatfem.structures.reduction.krylov import Krylov
from seatfem.structures.reduction.modes import solve_modes
from seatfem.structures.shapes import AnnularSeat, CadPart, Stopper
from seatfem.structures.sheets import Sheet, plate_modes
