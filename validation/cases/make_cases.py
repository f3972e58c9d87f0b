"""Makes what the cases of `kerfem validate` need beside their text: the meshes of Cook's membrane, the sweeps of the cut
cantilevers, and their references by scikit-fem (printed, to be copied into the case).

    pip install -r validation/requirements.txt
    python validation/cases/make_cases.py
"""
from pathlib import Path

import meshio
import numpy as np
from scipy.sparse.linalg import spsolve
from skfem import Basis, ElementTetP2, ElementVector, FacetBasis, LinearForm, MeshTet, asm, condense
from skfem.models.elasticity import lame_parameters, linear_elasticity

HERE = Path(__file__).resolve().parent


def cook(n):
    """Cook's membrane of n x n quadrilaterals, two triangles each."""
    s, t = np.meshgrid(np.linspace(0, 1, n + 1), np.linspace(0, 1, n + 1), indexing="ij")
    points = np.stack([48 * s, 44 * s + t * (44 - 28 * s), 0 * s], -1).reshape(-1, 3)
    corner = (np.arange(n)[:, None] * (n + 1) + np.arange(n)).ravel()
    a, b, c, d = corner, corner + n + 1, corner + n + 2, corner + 1
    cells = np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)])
    meshio.Mesh(points, [("triangle", cells)]).write(HERE / f"cook_{n}.vtu", binary=True)


def sweep(depth):
    """A plane at x = 2 from above down to `depth`."""
    low = 1 - depth
    rows = [f"v 2 -0.5 {low}", f"v 2 1.5 {low}", "v 2 1.5 1.5", "v 2 -0.5 1.5", "f 1 2 3", "f 1 3 4"]
    (HERE / f"cut_depth_{round(100 * depth)}.obj").write_text("\n".join(rows) + "\n")


def tip(depth, n):
    """Mean of uz at the end of a cantilever 4 x 1 x 1 with a slit at x = 2, order 2, n cells a metre (m)."""
    mesh = MeshTet.init_tensor(np.linspace(0, 4, 4 * n + 1), np.linspace(0, 1, n + 1), np.linspace(0, 1, n + 1))
    p, t = mesh.p, mesh.t.copy()
    lip = np.flatnonzero((abs(p[0] - 2) < 1e-9) & (p[2] > 1 - depth + 1e-9))
    other = np.arange(p.shape[1])
    other[lip] = p.shape[1] + np.arange(len(lip))
    right = p[0, t].mean(axis=0) > 2
    t[:, right] = other[t[:, right]]
    mesh = MeshTet(np.hstack([p, p[:, lip]]), t)
    element = ElementVector(ElementTetP2())
    basis = Basis(mesh, element, intorder=4)
    stiffness = asm(linear_elasticity(*lame_parameters(1e6, 0.3)), basis)
    end = FacetBasis(mesh, element, facets=mesh.facets_satisfying(lambda x: abs(x[0] - 4) < 1e-9), intorder=4)
    area = asm(LinearForm(lambda v, w: v[2]), end)
    clamped = basis.get_dofs(lambda x: abs(x[0]) < 1e-9)
    u = np.zeros(basis.N)
    matrix, load, x, free = condense(stiffness, -100.0 * area, D=clamped)
    u[free] = spsolve(matrix, load)
    return area @ u


if __name__ == "__main__":
    for n in (8, 16, 32):
        cook(n)
    for depth in (0.25, 0.5, 0.75):
        sweep(depth)
        print(depth, [float(tip(depth, n)) for n in (4, 8)])
