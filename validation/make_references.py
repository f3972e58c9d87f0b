"""Makes the reference solutions of kerfem: linear elasticity on P1 tetrahedra, solved by scikit-fem.

    pip install -r validation/requirements.txt
    python validation/make_references.py [NAME ...]

Writes `validation/references/NAME.vtu` (mesh; point data `displacement` in m, `fixed` with one 0 or 1 for each axis,
`load` in N) for the scenes `references/NAME.toml`, all of them by default. The meshes of `cut_*` are those that kerfem's
own cut leaves (`cargo run -p kerfem-validation --bin cut_meshes`); the sweeps that cut are written here as well. Loads
and supports are found and integrated by this script alone: what kerfem makes of the scenes is compared with them.
"""
import subprocess
import sys
import tempfile
from pathlib import Path

import meshio
import numpy as np
from scipy.sparse.linalg import splu
from skfem import Basis, ElementTetP1, ElementVector, FacetBasis, LinearForm, MeshTet, MeshTri, asm, condense
from skfem.helpers import dot
from skfem.models.elasticity import lame_parameters, linear_elasticity

HERE = Path(__file__).resolve().parent
REFERENCES = HERE / "references"
YOUNG, POISSON, DENSITY = 1e7, 0.3, 1000.0
GRAVITY = np.array([0.0, 0.0, -9.81])
LENGTH = 4.0  # of the beams, 1 x 1 across (m)
EPSILON = 1e-9


# --- meshes -----------------------------------------------------------------------------------------------------------

def box(length, cells):
    """A box `length` x 1 x 1, six tetrahedra a cell."""
    x, y, z = (np.linspace(0.0, side, n + 1) for side, n in zip((length, 1.0, 1.0), cells))
    return MeshTet.init_tensor(x, y, z)


def shaken(mesh, by, seed):
    """The mesh with its interior vertices moved at random by up to `by` (m) along each axis."""
    shift = np.random.default_rng(seed).uniform(-by, by, mesh.p.shape)
    shift[:, mesh.boundary_nodes()] = 0.0
    return MeshTet(mesh.p + shift, mesh.t)


def oriented(mesh):
    """Corners of the cells (rows), each with positive volume."""
    p, cells = mesh.p.T, mesh.t.T.copy()
    volumes = np.linalg.det(p[cells[:, 1:]] - p[cells[:, :1]]) / 6
    assert np.abs(volumes).min() > 1e-6 * np.abs(volumes).mean(), "a cell is flat"
    turned = volumes < 0
    cells[turned, 2], cells[turned, 3] = cells[turned, 3], cells[turned, 2]
    return cells


def shell_octant(inner, outer, layers, refinements):
    """The part of a thick spherical shell where x, y, z >= 0: prisms over a refined triangle, three tetrahedra each."""
    face = MeshTri(np.eye(3)[:2], np.array([[0], [1], [2]])).refined(refinements)
    direction = np.vstack([face.p, 1.0 - face.p.sum(axis=0)])
    direction /= np.linalg.norm(direction, axis=0)
    radii = inner * (outer / inner) ** (np.arange(layers + 1) / layers)
    points = np.hstack([r * direction for r in radii])
    points[np.abs(points) < EPSILON] = 0.0
    n = face.p.shape[1]
    a, b, c = np.sort(face.t, axis=0)  # ascending corners: neighbours cut their common side alike
    prisms = [[(a, 0), (b, 0), (c, 0), (c, 1)], [(a, 0), (b, 0), (b, 1), (c, 1)], [(a, 0), (a, 1), (b, 1), (c, 1)]]
    tets = np.hstack([np.array([v + (k + up) * n for v, up in t]) for k in range(layers) for t in prisms])
    return MeshTet(points, tets)


# --- the problem ------------------------------------------------------------------------------------------------------

def traction_load(mesh, where, traction):
    """Nodal forces of the traction (Pa; a function of the quadrature points x, and of the outward normal n) on the boundary
    facets whose corners all satisfy `where`."""
    chosen = where(mesh.p)
    facets = [f for f in mesh.boundary_facets() if chosen[mesh.facets[:, f]].all()]
    basis = FacetBasis(mesh, ElementVector(ElementTetP1()), facets=np.array(facets), intorder=4)
    return asm(LinearForm(lambda v, w: dot(traction(w.x, w.n), v)), basis)


def gravity_load(mesh):
    basis = Basis(mesh, ElementVector(ElementTetP1()), intorder=2)
    weight = (DENSITY * GRAVITY)[:, None, None]
    return asm(LinearForm(lambda v, w: dot(weight + 0 * w.x, v)), basis)


def solve(mesh, fixed, prescribed, load):
    """Displacements (rows of vertices) in equilibrium; `fixed` and `prescribed` have the shape of the points."""
    basis = Basis(mesh, ElementVector(ElementTetP1()))
    K = asm(linear_elasticity(*lame_parameters(YOUNG, POISSON)), basis)
    nodes = basis.nodal_dofs  # axis, vertex
    x = np.zeros(basis.N)
    x[nodes] = prescribed
    A, b, x, free = condense(K, load, x=x, D=nodes[fixed])
    factor = splu(A.tocsc())
    part = factor.solve(b)
    for _ in range(3):  # refinement
        part += factor.solve(b - A @ part)
    x[free] = part
    return x[nodes].T, load[nodes].T


def clamp(mesh):
    return np.tile(mesh.p[0] < EPSILON, (3, 1))


# --- the cases --------------------------------------------------------------------------------------------------------

def patch_test():
    mesh = shaken(box(1.0, (4, 4, 4)), 0.06, seed=1)
    gradient = np.array([[0.01, 0.02, -0.03], [0.005, -0.02, 0.01], [0.015, 0.004, 0.02]])
    fixed = np.zeros(mesh.p.shape, bool)
    fixed[:, mesh.boundary_nodes()] = True
    return mesh, fixed, np.where(fixed, gradient @ mesh.p, 0.0), np.zeros(mesh.p.size)


def cantilever_gravity():
    mesh = shaken(box(LENGTH, (12, 4, 4)), 0.05, seed=2)
    return mesh, clamp(mesh), np.zeros(mesh.p.shape), gravity_load(mesh)


def cantilever_traction():
    mesh = shaken(box(LENGTH, (12, 4, 4)), 0.05, seed=3)
    twist = lambda x, n: np.array([2000.0 * x[2] - 500.0, -800.0 * x[2] + 100.0, 900.0 * x[1] - 600.0])
    return mesh, clamp(mesh), np.zeros(mesh.p.shape), traction_load(mesh, lambda p: p[0] > LENGTH - EPSILON, twist)


def thick_sphere():
    mesh = shell_octant(1.0, 2.0, layers=6, refinements=4)
    inside = lambda p: np.linalg.norm(p, axis=0) < 1.0 + 1e-6
    pressure = traction_load(mesh, inside, lambda x, n: -20000.0 * n)
    return mesh, np.abs(mesh.p) < EPSILON, np.zeros(mesh.p.shape), pressure


def cut_cantilever(name):
    cut = meshio.read(cut_mesh(name))
    mesh = MeshTet(*(np.ascontiguousarray(a.T) for a in (cut.points, cut.cells_dict["tetra"])))
    pull = traction_load(mesh, lambda p: p[0] > LENGTH - EPSILON, lambda x, n: np.array([300.0, 40.0, -150.0])[:, None, None] + 0 * x)
    return mesh, clamp(mesh), np.zeros(mesh.p.shape), gravity_load(mesh) + pull


CASES = {
    "patch_test": patch_test,
    "cantilever_gravity": cantilever_gravity,
    "cantilever_traction": cantilever_traction,
    "thick_sphere": thick_sphere,
    "cut_plane": lambda: cut_cantilever("cut_plane"),
    "cut_curved": lambda: cut_cantilever("cut_curved"),
}


# --- cuts -------------------------------------------------------------------------------------------------------------

def plane_sweep():
    """A tilted rectangle that ends inside the beam, below its middle."""
    center, along = np.array([1.93, 0.5, 0.9]), np.array([0.21, 1.0, 0.05])
    up = np.array([-0.17, 0.09, 1.0])
    corners = [center + a * along + b * up for a, b in ((-1, -0.47), (1, -0.47), (1, 0.6), (-1, 0.6))]
    return np.array(corners), [[0, 1, 2], [0, 2, 3]]


def curved_sweep():
    """A curved sheet that ends inside the beam, above its middle."""
    n = 7
    y, z = np.meshgrid(np.linspace(-0.3, 1.3, n), np.linspace(-0.37, 0.43, n), indexing="ij")
    points = np.stack([2.05 + 0.2 * np.sin(2.3 * y) + 0.5 * (z - 0.1) ** 2, y, z + 0.08 * y], axis=-1).reshape(-1, 3)
    quads = [(i * n + j, (i + 1) * n + j, (i + 1) * n + j + 1, i * n + j + 1) for i in range(n - 1) for j in range(n - 1)]
    return points, [t for a, b, c, d in quads for t in ([a, b, c], [a, c, d])]


SWEEPS = {"cut_plane": plane_sweep, "cut_curved": curved_sweep}


def cut_mesh(name):
    """The mesh that kerfem's cut of the uncut beam leaves (a file)."""
    points, triangles = SWEEPS[name]()
    lines = ["v %.17g %.17g %.17g" % tuple(p) for p in points] + ["f %d %d %d" % tuple(k + 1 for k in t) for t in triangles]
    (REFERENCES / (name + ".obj")).write_text("\n".join(lines) + "\n")
    out = Path(tempfile.mkdtemp()) / (name + ".vtu")
    subprocess.run(["cargo", "run", "-q", "-p", "kerfem-validation", "--bin", "cut_meshes", name, str(out)], cwd=HERE, check=True)
    return out


def main():
    for name in sys.argv[1:] or CASES:
        mesh, fixed, prescribed, load = CASES[name]()
        displacement, load = solve(mesh, fixed, prescribed, load)
        data = {"displacement": displacement, "fixed": fixed.T.astype(np.int64), "load": load}
        path = REFERENCES / (name + ".vtu")
        meshio.write_points_cells(path, mesh.p.T, [("tetra", oriented(mesh))], point_data=data)
        print("%s: %d vertices, %d cells, largest displacement %.6g m, %d bytes" % (
            name, mesh.p.shape[1], mesh.t.shape[1], np.linalg.norm(displacement, axis=1).max(), path.stat().st_size))


if __name__ == "__main__":
    main()
