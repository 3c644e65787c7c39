"""SfePy on a mesh, in an environment of its own, with nothing of the project: ``sfepy_program.py IN.npz OUT.npz``."""

import sys
from time import process_time

import numpy as np
from scipy.sparse.linalg import eigsh
from sfepy.discrete import FieldVariable, Integral, Material, Problem
from sfepy.discrete.conditions import Conditions, EssentialBC
from sfepy.discrete.equations import Equation, Equations
from sfepy.discrete.fem import FEDomain, Field, Mesh
from sfepy.mechanics.matcoefs import stiffness_from_youngpoisson
from sfepy.terms import Term


def frequencies(points, cells, young, poisson, density, count):
    """(count,) lowest natural frequencies [Hz] of a body in tetrahedra of order 2 whose underside, z = 0, is held."""
    mesh = Mesh.from_data("body", points, None, [cells.astype(np.int32)], [np.zeros(len(cells), np.int32)], ["3_4"])
    domain = FEDomain("domain", mesh)
    whole = domain.create_region("Omega", "all")
    held = domain.create_region("Held", "vertices in (z < 1e-9)", "facet")
    field = Field.from_args("displacement", np.float64, "vector", whole, approx_order=2)
    u = FieldVariable("u", "unknown", field)
    v = FieldVariable("v", "test", field, primary_var_name="u")
    solid = Material("solid", D=stiffness_from_youngpoisson(3, young, poisson), rho=density)
    terms = (
        Term.new("dw_lin_elastic(solid.D, v, u)", Integral("i", order=2), whole, solid=solid, v=v, u=u),
        Term.new("dw_dot(solid.rho, v, u)", Integral("j", order=4), whole, solid=solid, v=v, u=u),
    )
    problem = Problem("modes", equations=Equations([Equation("K", terms[0]), Equation("M", terms[1])]))
    problem.set_bcs(ebcs=Conditions([EssentialBC("held", held, {"u.all": 0.0})]))
    problem.time_update()
    problem.update_materials()
    K = problem.equations["K"].evaluate(mode="weak", dw_mode="matrix", asm_obj=problem.equations.create_matrix_graph())
    M = problem.equations.create_matrix_graph()
    M = problem.equations["M"].evaluate(mode="weak", dw_mode="matrix", asm_obj=M)
    squares = eigsh(K.tocsc(), count, M.tocsc(), sigma=0.0, return_eigenvectors=False)
    return np.sqrt(np.sort(squares)) / (2 * np.pi)


if __name__ == "__main__":
    asked = np.load(sys.argv[1])
    before = process_time()
    found = frequencies(asked["points"], asked["cells"], *map(float, asked["solid"]), int(asked["count"]))
    np.savez(sys.argv[2], frequencies=found, seconds=process_time() - before)
