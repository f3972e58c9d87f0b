"""Compares published cures of volumetric locking on linear (P1) tetrahedra and triangles.

    pip install -r validation/requirements.txt
    python validation/compare_locking.py [-o DIR] [--quick]

Writes `locking.csv`, `locking.md` (the tables of `docs/book/locking.md`) and `locking.svg` to DIR (default `out/locking`).
All cures are written here from their papers, with no line of kerfem in between; only the references, quadratic elements on
graded meshes, come from scikit-fem. The mesh of the cantilever is that of `kerfem_mesh::generate::box_tets`.

With t the trace of the strain of a cell, V its volume, and for a vertex a of N-cornered cells V_a = sum V, weight V_a / N:

none        mu e:e + lambda/2 t^2 in the cells.
nodal-p     lambda/2 of the volume-averaged t of each vertex (Bonet, Burton: A simple average nodal pressure tetrahedral
            element, Comm. Numer. Meth. Engng 14, 1998).
nodal-p b   the same, but min(lambda, b mu) stays in the cells (after Puso, Solberg: A stabilized nodally integrated
            tetrahedral, IJNME 67, 2006, which stabilises all of the strain so).
mixed       P1 displacement and P1 pressure, stabilised by the part of the pressure that is not constant in a cell (Bochev,
            Dohrmann, Gunzburger: Stabilization of low-order mixed finite elements, SIAM J. Numer. Anal. 44, 2006).
patch       t averaged over disjoint patches (de Souza Neto, Pires, Owen: F-bar-based linear triangles and tetrahedra, IJNME 62,
            2005): the cells of one grid place.
nodal a b   strain averaged over the cells of a vertex, all of it: (1 - a) mu and lambda - a min(lambda, b mu) of the averages, the
            rest in the cells (Puso, Solberg 2006; Gee, Dohrmann, Key, Wall: A uniform nodal strain tetrahedron with isochoric
            stabilization, IJNME 78, 2009).
"""
import argparse
import csv
import io
from pathlib import Path

import numpy as np
import scipy.sparse as sp
from scipy.linalg import eigh, solveh_banded
from scipy.sparse.linalg import splu
from skfem import (Basis, ElementHex2, ElementQuad2, ElementVector, FacetBasis, LinearForm, MeshHex, MeshQuad, asm)

KUHN = [[0, 1, 3, 7], [0, 3, 2, 7], [0, 2, 6, 7], [0, 6, 4, 7], [0, 4, 5, 7], [0, 5, 1, 7]]
CURES = [("none", None, None), ("nodal-p", 1.0, 0.0), ("nodal-p b=1", 1.0, 1.0), ("nodal-p b=2", 1.0, 2.0),
         ("mixed", None, None), ("patch", None, None), ("nodal a=.05 b=2", 0.05, 2.0), ("nodal a=.1 b=2", 0.1, 2.0),
         ("nodal a=.2 b=2", 0.2, 2.0), ("nodal a=.3 b=2", 0.3, 2.0), ("nodal a=.2 b=-2/3", 0.2, -2 / 3)]
CHOSEN = "nodal a=.2 b=2"


def lame(poisson, young=1.0):
    return young * poisson / ((1 + poisson) * (1 - 2 * poisson)), young / (2 * (1 + poisson))


# --- meshes -----------------------------------------------------------------------------------------------------------

def box(size, cells):
    """Points, tetrahedra and the grid place of each, as `box_tets`: six a place, all along one diagonal."""
    n = np.array(cells)
    z, y, x = np.meshgrid(*[np.linspace(0, s, k + 1) for s, k in zip(size[::-1], n[::-1])], indexing="ij")
    place = np.stack(np.meshgrid(*map(np.arange, n), indexing="ij"), -1).reshape(-1, 3)
    stride = np.array([1, n[0] + 1, (n[0] + 1) * (n[1] + 1)])
    corner = np.array([[q & 1, q >> 1 & 1, q >> 2] for q in range(8)]) @ stride
    cells = (place @ stride)[:, None, None] + corner[np.array(KUHN)]
    return np.stack([x, y, z], -1).reshape(-1, 3), cells.reshape(-1, 4), np.repeat(np.arange(len(place)), 6)


def rectangle(cells, shape=lambda p: p):
    """Points, triangles with alternating diagonals and the grid place of each, over the unit square mapped by `shape`."""
    n, m = cells
    y, x = np.meshgrid(np.linspace(0, 1, m + 1), np.linspace(0, 1, n + 1), indexing="ij")
    triangles = []
    for i, j in ((i, j) for i in range(n) for j in range(m)):
        a, b, c, d = i + (n + 1) * j, i + 1 + (n + 1) * j, i + 1 + (n + 1) * (j + 1), i + (n + 1) * (j + 1)
        triangles += [[a, b, c], [a, c, d]] if (i + j) % 2 == 0 else [[a, b, d], [b, c, d]]
    return shape(np.stack([x, y], -1).reshape(-1, 2)), np.array(triangles), np.repeat(np.arange(n * m), 2)


def cook(p):
    """The unit square as Cook's membrane, 48 long, 44 high at the clamp and 16 at the end."""
    x = 48 * p[:, 0]
    low, high = 44 * p[:, 0], 44 + 16 * p[:, 0]
    return np.stack([x, low + (high - low) * p[:, 1]], -1)


def slit(points, cells):
    """Doubles the vertices on x = 2 above the middle of the beam: a cut of half its height."""
    on = (np.abs(points[:, 0] - 2) < 1e-9) & (points[:, 2] > 0.5 + 1e-9)
    copy = np.arange(len(points))
    copy[on] = len(points) + np.arange(on.sum())
    beyond = points[cells].mean(1)[:, 0] > 2
    return np.vstack([points, points[on]]), np.where(beyond[:, None], copy[cells], cells)


# --- elements ---------------------------------------------------------------------------------------------------------

class Body:
    """Strain operators of a mesh of P1 simplices; dof = axes * vertex + axis."""

    def __init__(self, points, cells, places):
        self.points, self.cells = points, cells
        d = self.axes = cells.shape[1] - 1
        jacobian = (points[cells[:, 1:]] - points[cells[:, :1]])
        self.volume = np.linalg.det(jacobian) / (1 if d == 1 else 2 if d == 2 else 6)
        assert self.volume.min() > 0
        g = np.linalg.inv(jacobian)
        self.gradients = np.concatenate([-g.sum(2, keepdims=True), g], 2).transpose(0, 2, 1)
        n, dofs = len(cells), d * len(points)
        rows, cols, values = [], [], []
        for a in range(d + 1):
            for i in range(d):
                for j in range(d):
                    for k in {i * d + j, j * d + i}:
                        rows.append(np.arange(n) * d * d + k)
                        cols.append(cells[:, a] * d + i)
                        values.append(self.gradients[:, a, j] * (1.0 if i == j else 0.5))
        flat = map(np.concatenate, (values, rows, cols))
        v, r, c = flat
        self.strain = sp.csr_matrix((v, (r, c)), (n * d * d, dofs))
        trace = sp.csr_matrix(np.eye(d).reshape(1, -1))
        self.trace = sp.kron(sp.eye(n), trace).tocsr() @ self.strain
        self.average, self.weight = self.averages(cells.ravel(), np.repeat(np.arange(n), d + 1))
        self.weight /= d + 1
        self.patch, self.patch_volume = self.averages(places, np.arange(n))

    def averages(self, rows, cells):
        """The operator of volume averages over sets of cells, and the volumes of the sets."""
        sums = sp.csr_matrix((self.volume[cells], (rows, cells)), (rows.max() + 1, len(self.cells)))
        total = np.asarray(sums.sum(1)).ravel()
        return sp.diags(1 / total) @ sums, total

    def shear(self, mu, op=None, weight=None):
        op, weight = (self.strain, self.volume) if op is None else (op, weight)
        return op.T @ sp.diags(np.repeat(2 * mu * weight, self.axes**2)) @ op

    def pressure(self, lam, op=None, weight=None):
        op, weight = (self.trace, self.volume) if op is None else (op, weight)
        return op.T @ sp.diags(lam * weight) @ op

    def averaged_strain(self):
        return sp.kron(self.average, sp.eye(self.axes**2)).tocsr() @ self.strain

    def stiffness(self, cure, lam, mu):
        """K of a cure that leaves a displacement system, and the operator from u to the mean stress / bulk part of cells."""
        name, a, b = cure
        to_cells = sp.csr_matrix((self.average > 0).T, dtype=float) / (self.axes + 1)
        mean = self.average @ self.trace
        if name == "none":
            return self.shear(mu) + self.pressure(lam), lam * self.trace
        if name == "patch":
            op = self.patch @ self.trace
            back = sp.csr_matrix((self.patch > 0).T, dtype=float)
            return self.shear(mu) + self.pressure(lam, op, self.patch_volume), lam * back @ op
        kept = a * min(lam, b * mu)
        K = self.shear(a * mu) + self.pressure(kept) + self.pressure(lam - kept, mean, self.weight)
        if a < 1:
            K = K + self.shear((1 - a) * mu, self.averaged_strain(), self.weight)
        return K, kept * self.trace + (lam - kept) * to_cells @ mean

    def saddle(self, mu, lam):
        """The blocks A, B, C of the stabilised P1/P1 system [A B^T; B -C]; the pressure is that of the vertices."""
        d, n = self.axes, len(self.points)
        corners, cells = self.cells.ravel(), np.repeat(np.arange(len(self.cells)), d + 1)
        mean = sp.csr_matrix((np.full(len(corners), 1 / (d + 1)), (cells, corners)), (len(self.cells), n))
        B = mean.T @ sp.diags(self.volume) @ self.trace
        local = (1 + np.eye(d + 1)) / ((d + 1) * (d + 2))
        r = np.repeat(self.cells, d + 1, axis=1).ravel()
        c = np.tile(self.cells, (1, d + 1)).ravel()
        M = sp.csr_matrix(((self.volume[:, None, None] * local).ravel(), (r, c)), (n, n))
        projected = mean.T @ sp.diags(self.volume) @ mean
        return self.shear(mu), B, M / lam + (M - projected) / (2 * mu), mean

    def solve(self, cure, poisson, load, fixed):
        """Displacements, and the mean stress lambda tr(e) by cell."""
        lam, mu = lame(poisson)
        free = np.nonzero(~fixed)[0]
        order = free[np.lexsort(self.points[free // self.axes].T[::-1])]
        u = np.zeros(len(load))
        if cure[0] == "mixed":
            A, B, C, mean = self.saddle(mu, lam)
            K = sp.bmat([[A[free][:, free], B[:, free].T], [B[:, free], -C]]).tocsc()
            where = np.concatenate([self.points[free // self.axes], self.points])
            perm = np.lexsort(where.T[::-1])
            rhs = np.concatenate([load[free], np.zeros(len(self.points))])[perm]
            lu = splu(K[perm][:, perm], permc_spec="NATURAL", diag_pivot_thresh=0.0, options={"SymmetricMode": True})
            x = np.empty(len(perm))
            x[perm] = lu.solve(rhs)
            u[free] = x[: len(free)]
            return u, mean @ x[len(free):]
        K, stress = self.stiffness(cure, lam, mu)
        u[order] = banded(K[order][:, order], load[order])
        return u, stress @ u


def banded(K, b):
    """Solves a symmetric positive definite system whose order gives it a small bandwidth."""
    K = sp.tril(K).tocoo()
    lower = np.zeros(((K.row - K.col).max() + 1, len(b)))
    np.add.at(lower, (K.row - K.col, K.col), K.data)
    return solveh_banded(lower, b, overwrite_ab=True, lower=True)


def end_load(points, cells, at, axis):
    """Nodal forces of a unit traction along `axis` (with its sign) on the facets where x = `at`."""
    d = cells.shape[1] - 1
    weight = np.zeros(len(points))
    for k in range(d + 1):
        facets = np.delete(cells, k, axis=1)
        facets = facets[(np.abs(points[facets][:, :, 0] - at) < 1e-9).all(1)]
        e = points[facets[:, 1:]] - points[facets[:, :1]]
        area = np.linalg.norm(e[:, 0], axis=1) if d == 2 else np.linalg.norm(np.cross(e[:, 0], e[:, 1]), axis=1) / 2
        for corner in facets.T:
            np.add.at(weight, corner, area / d)
    f = np.zeros((len(points), d))
    f[:, abs(axis)] = np.sign(axis) * weight
    return f.ravel()


# --- references -------------------------------------------------------------------------------------------------------

def quadratic(mesh, element, poisson, at, axis):
    """Work of the end load on its displacement, by quadratic elements, the side x = 0 clamped."""
    lam, mu = lame(poisson)
    basis = Basis(mesh, ElementVector(element), intorder=5)
    scalar = Basis(mesh, element, intorder=5)
    d = mesh.p.shape[0]
    g = np.stack([scalar.basis[a][0].grad for a in range(scalar.Nbfun)]).transpose(2, 0, 1, 3)  # cell, function, axis, point
    n = g.shape[1]
    flat = g.reshape(len(g), n * d, -1)
    pairs = ((flat * scalar.dx[:, None]) @ flat.transpose(0, 2, 1)).reshape(-1, n, d, n, d)
    K = lam * pairs + mu * pairs.transpose(0, 1, 4, 3, 2)
    K += mu * np.einsum("caibi,jk->cajbk", pairs, np.eye(d))
    K = K.reshape(len(g), n * d, n * d)
    dofs = basis.element_dofs.T  # the functions of the vector element: axis by axis of each scalar one
    K = sp.csr_matrix((K.ravel(), (np.repeat(dofs, n * d, axis=1).ravel(), np.tile(dofs, (1, n * d)).ravel())), (basis.N,) * 2)
    end = FacetBasis(mesh, ElementVector(element), facets=mesh.facets_satisfying(lambda x: np.abs(x[0] - at) < 1e-9),
                     intorder=5)
    f = asm(LinearForm(lambda v, w: np.sign(axis) * v[abs(axis)]), end)
    free = np.nonzero(np.abs(basis.doflocs[0]) > 1e-9)[0]
    order = free[np.lexsort(basis.doflocs[:, free][::-1])]
    return f[order] @ banded(K[order][:, order], f[order])


def limit(works):
    """Where three works of finer and finer meshes lead if their differences shrink by a fixed factor (Aitken); with how far the
    last is from there. Of two, the last one."""
    if len(works) < 3:
        return works[-1], abs(works[-1] / works[-2] - 1)
    first, second = np.diff(works)
    end = works[-1] + second**2 / (first - second)
    return end, abs(works[-1] / end - 1)


def cantilever_reference(poisson, cut, quick):
    """Work of the end shear, from quadratic hexahedra on graded meshes (see `limit`)."""
    works = []
    for n in (2, 3) if quick else (2, 3, 4):
        x = np.concatenate([np.linspace(0, 1, n + 2) ** 1.5, np.linspace(1, 4, 2 * n + 1)[1:]])
        y = z = (1 - np.cos(np.linspace(0, np.pi, n + 2))) / 2
        if cut:  # towards the front of the cut
            half = np.linspace(0, 1, n + 2) ** 2.2 / 2
            z = np.concatenate([0.5 - half[:0:-1], 0.5 + half])
            near = np.linspace(0, 1, n + 3) ** 2.5 * 0.8
            clamp = np.linspace(0, 1, n + 1)[:-1] ** 1.5 * 1.2
            x = np.concatenate([clamp, 2 - near[:0:-1], 2 + near, np.linspace(2.8, 4, n)[1:]])
            y = (1 - np.cos(np.linspace(0, np.pi, n + 1))) / 2
        mesh = MeshHex.init_tensor(x, y, z)
        if cut:
            p, t = slit(mesh.p.T, mesh.t.T)
            mesh = MeshHex(p.T, t.T)
        works.append(quadratic(mesh, ElementHex2(), poisson, 4.0, -2))
    return limit(works)


def cook_reference(poisson, quick):
    works = []
    for n in (8, 16) if quick else (8, 16, 32):
        g = (1 - np.cos(np.linspace(0, np.pi, n + 1))) / 2
        mesh = MeshQuad.init_tensor(g**1.5, g)
        works.append(quadratic(MeshQuad(cook(mesh.p.T).T, mesh.t), ElementQuad2(), poisson, 48.0, 1))
    return limit(works)


# --- measures ---------------------------------------------------------------------------------------------------------

def cantilever(cure, poisson, n, cut):
    """Work of an end shear on a cantilever 4 x 1 x 1 with n cells across; the body and its mean stress."""
    points, cells, places = box((4, 1, 1), (4 * n, n, n))
    if cut:
        points, cells = slit(points, cells)
    body = Body(points, cells, places)
    f = end_load(points, cells, 4.0, -2)
    u, stress = body.solve(cure, poisson, f, np.repeat(points[:, 0] == 0, 3))
    return f @ u, body, stress


def cooks(cure, poisson, n):
    """Work of the end shear on Cook's membrane in plane strain, the body and its mean stress."""
    points, cells, places = rectangle((n, n), cook)
    body = Body(points, cells, places)
    f = end_load(points, cells, 48.0, 1)
    u, stress = body.solve(cure, poisson, f, np.repeat(points[:, 0] == 0, 2))
    return f @ u, body, stress


def smooth(cure, axes, n, poisson=0.4999):
    """A held square or cube under the body force of a swirl (free of divergence) and of a smooth mean stress
    q = cos(pi x) cos(pi y) [cos(pi z)], in units of mu: relative error of q in the cells; its jumps across facets, and those of
    its vertex averages along edges, of the jumps that q itself has."""
    points, cells, places = rectangle((n, n)) if axes == 2 else box((1, 1, 1), (n, n, n))
    body = Body(points, cells, places)
    lam, mu = lame(poisson)
    pi, q = np.pi, lambda x: mu * np.prod(np.cos(np.pi * x), axis=-1)

    def force(x):
        s2, c2 = np.sin(2 * pi * x), np.cos(2 * pi * x)
        s = np.sin(pi * x) ** 2
        z, ddz = (1, 0) if axes == 2 else (s[..., 2], 2 * pi**2 * c2[..., 2])
        # u = (s(x) s'(y), -s'(x) s(y), 0) s(z) / (2 pi), s' = pi sin(2 pi x): -mu laplace(u) - grad(q)
        f = np.zeros(x.shape)
        for i, (a, b, sign) in enumerate([(0, 1, 1), (1, 0, -1)]):
            laplace = (2 * pi**2 * c2[..., a] * z - 4 * pi**2 * s[..., a] * z + s[..., a] * ddz) * s2[..., b]
            f[..., i] = -sign * mu * laplace / 2
        for i in range(axes):
            others = np.prod(np.delete(np.cos(pi * x), i, axis=-1), axis=-1)
            f[..., i] += mu * pi * np.sin(pi * x[..., i]) * others
        return f

    f = np.zeros(points.shape)
    corner = points[cells]
    for a in range(axes + 1):  # degree 2: as many points as corners
        inner = 0.58541019662496845446 if axes == 3 else 2 / 3
        w = np.full(axes + 1, (1 - inner) / axes)
        w[a] = inner
        at = force(np.einsum("k,ckj->cj", w, corner)) * body.volume[:, None] / (axes + 1)
        for k in range(axes + 1):
            np.add.at(f, cells[:, k], w[k] * at)
    held = ((points < 1e-9) | (points > 1 - 1e-9)).any(1)
    stress = body.solve(cure, poisson, f.ravel(), np.repeat(held, axes))[1]
    exact = q(corner.mean(1))
    stress = stress - np.average(stress - exact, weights=body.volume)
    error = np.sqrt(np.average((stress - exact) ** 2, weights=body.volume) / np.average(exact**2, weights=body.volume))
    own, true = jumps(body, stress, ~held), jumps(body, exact, ~held, q(points))
    return error, own[0] / true[0], own[1] / true[1]


def jumps(body, stress, counted, nodal=None):
    """Root of the mean square of what `stress` jumps by across facets, and of what its vertex averages (or `nodal`) differ by
    along edges, between `counted` vertices: of edges both ends, of facets all corners of both cells."""
    cells, d = body.cells, body.axes
    sides = np.sort(np.vstack([np.delete(cells, k, axis=1) for k in range(d + 1)]), axis=1)
    owner = np.tile(np.arange(len(cells)), d + 1)
    order = np.lexsort(sides.T)
    twin = (sides[order][1:] == sides[order][:-1]).all(1)
    a, b = owner[order][1:][twin], owner[order][:-1][twin]
    inner = counted[cells].all(1)
    across = (stress[a] - stress[b])[inner[a] & inner[b]]
    nodal = body.average @ stress if nodal is None else nodal
    edges = np.unique(np.sort(np.vstack([cells[:, [i, j]] for i in range(d + 1) for j in range(i)]), axis=1), axis=0)
    a, b = edges[counted[edges].all(1)].T
    return np.sqrt(np.mean(across**2)), np.sqrt(np.mean((nodal[a] - nodal[b]) ** 2))


def inf_sup(cure, axes, n):
    """The inf-sup number of a square or cube held at x = 0, of the strain energy of the cure at mu = 1 against its pressures
    (Chapelle, Bathe: The inf-sup test, Comput. Struct. 47, 1993); of "mixed" with its stabilising term. Pressures that exert no
    force at all are counted, and left out."""
    points, cells, places = rectangle((n, n)) if axes == 2 else box((1, 1, 1), (n, n, n))
    body = Body(points, cells, places)
    free = np.repeat(points[:, 0] > 1e-9, axes)
    extra = 0.0
    name, a, _ = cure
    A = body.shear(1.0)
    if name == "mixed":
        A, B, C, _ = body.saddle(1.0, np.inf)
        M = body.saddle(1.0, 1.0)[2] - C
        M, extra = M.toarray(), C.toarray()
    else:
        op, weight = (body.trace, body.volume) if name == "none" else (
            (body.patch @ body.trace, body.patch_volume) if name == "patch" else (body.average @ body.trace, body.weight))
        B, M = sp.diags(weight) @ op, np.diag(weight)
        if a is not None and a < 1:
            A = body.shear(a) + body.shear(1 - a, body.averaged_strain(), body.weight)
    A, B = A[free][:, free].toarray(), B[:, free].toarray()
    values = eigh(B @ np.linalg.solve(A, B.T) + extra, M, eigvals_only=True)
    silent = (values < 1e-10).sum()
    return silent, np.sqrt(values[silent])


# --- tables and picture -----------------------------------------------------------------------------------------------

def tables(quick):
    """Rows (dictionaries, figures as text) and the series of the picture."""
    sizes = (2, 4) if quick else (2, 4, 8)
    finest = sizes[-1]
    references = {}
    for poisson in (0.3, 0.499, 0.4999):
        for cut in (False, True):
            references[poisson, cut] = cantilever_reference(poisson, cut, quick)
            print("reference", poisson, cut, references[poisson, cut], flush=True)
    cook = {p: cook_reference(p, quick) for p in (0.499, 0.4999)}
    print("cook", cook, flush=True)
    rows, series = [], {}
    middle = lambda body: (body.points[:, 0] > 0.6) & (body.points[:, 0] < 3.4)
    _, body, stress = cantilever(("mixed", None, None), 0.499, 4, False)
    smoothest = jumps(body, stress, middle(body))
    for cure in CURES:
        name = cure[0]
        ratio = lambda poisson, n, cut: cantilever(cure, poisson, n, cut)[0] / references[poisson, cut][0]
        series[name] = [(n, ratio(0.499, n, False)) for n in sizes]
        row = {"cure": name, "F21": series[name][-1][1], "F21 n=%d" % sizes[-2]: series[name][-2][1],
               "F21 cut": ratio(0.499, finest, True), "F21 .4999": ratio(0.4999, finest, False),
               "F21 .3": ratio(0.3, finest, False), "F21 .3 cut": ratio(0.3, finest, True)}
        for poisson in (0.499, 0.4999):
            row["Cook %s" % str(poisson)[1:]] = cooks(cure, poisson, 16)[0] / cook[poisson][0]
        _, body, stress = cantilever(cure, 0.499, 4, False)
        for what, own, best in zip(("facets", "edges"), jumps(body, stress, middle(body)), smoothest):
            row["F21 p %s" % what] = own / best
        for axes, n in ((2, 16), (3, 8)):
            for what, value in zip(("error", "facets", "edges"), smooth(cure, axes, n)):
                row["q %dD %s" % (axes, what)] = value
        for axes, ns in ((2, (4, 8, 16)), (3, (2, 4, 6))):
            for n in ns:
                silent, number = inf_sup(cure, axes, n)
                row["inf-sup %dD n=%d" % (axes, n)] = "%.3f (%d)" % (number, silent)
        rows.append({k: v if isinstance(v, str) else "%.3g" % v if v < 0.1 else "%.3f" % v for k, v in row.items()})
        print(", ".join("%s: %s" % kv for kv in rows[-1].items()), flush=True)
    return rows, series


def markdown(rows, columns):
    head = "| cure | " + " | ".join(columns) + " |\n|---|" + "---|" * len(columns) + "\n"
    return head + "".join("| `%s` | %s |\n" % (r["cure"], " | ".join(r[c] for c in columns)) for r in rows)


def draw(series, path):
    import matplotlib
    matplotlib.use("Agg")
    matplotlib.rcParams["svg.hashsalt"] = "locking"
    import matplotlib.pyplot as plt
    figure, axes = plt.subplots(1, 4, figsize=(15, 4), constrained_layout=True)
    for name in ("none", "nodal-p", "nodal-p b=2", "mixed", "patch", CHOSEN):
        axes[0].plot(*zip(*series[name]), marker="o", lw=2.5 if name == CHOSEN else 1, label=name)
    axes[0].axhspan(0.95, 1.05, color="#dddddd")
    axes[0].set(xscale="log", xlabel="cells across", ylabel="deflection / true", title="cantilever, nu = .499", ylim=(0, 1.4))
    axes[0].set_xticks([n for n, _ in series["none"]], [str(n) for n, _ in series["none"]])
    axes[0].minorticks_off()
    axes[0].legend(fontsize=7)
    for axis, cure in zip(axes[1:], [c for c in CURES if c[0] in ("none", "nodal-p", CHOSEN)]):
        _, body, stress = cooks(cure, 0.4999, 12)
        drawn = axis.tripcolor(*body.points.T, body.cells, facecolors=stress, cmap="RdBu_r", vmin=-3, vmax=3)
        axis.set(title="Cook, mean stress / load: " + cure[0], aspect="equal")
        axis.axis("off")
    figure.colorbar(drawn, ax=axes[1:], shrink=0.8)
    svg = io.StringIO()
    figure.savefig(svg, format="svg", metadata={"Date": None, "Creator": None, "Format": None, "Type": None})
    text = svg.getvalue().replace("*{stroke", "#figure_1 *{stroke")  # other drawings of the page keep their style
    path.write_text("\n".join(line.rstrip() for line in text[text.index("<svg") :].splitlines() if line.strip()) + "\n")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("-o", default="out/locking", type=Path, metavar="DIR")
    parser.add_argument("--quick", action="store_true", help="coarser meshes, to try the script")
    arguments = parser.parse_args()
    arguments.o.mkdir(parents=True, exist_ok=True)
    rows, series = tables(arguments.quick)
    with open(arguments.o / "locking.csv", "w", newline="") as file:
        writer = csv.DictWriter(file, rows[0].keys())
        writer.writeheader()
        writer.writerows(rows)
    names = list(rows[0])[1:]
    groups = [[c for c in names if c.startswith(("F21", "Cook")) and " p " not in c],
              [c for c in names if c.startswith(("q", "F21 p"))], [c for c in names if c.startswith("inf")]]
    (arguments.o / "locking.md").write_text("\n".join(markdown(rows, g) for g in groups))
    draw(series, arguments.o / "locking.svg")
