"""Makes the meshes of `map_sliver.study.toml`: a block of 6 x 6 x 6 boxes in whose middle a vertex lies `eps` times the length of
an edge from the opposite facet of its cell.

    pip install -r validation/requirements.txt
    python validation/studies/make_slivers.py
"""
from itertools import permutations
from pathlib import Path

import meshio
import numpy as np

HERE = Path(__file__).resolve().parent
N = 6


def block():
    """Vertices and tetrahedra, six to a box around its diagonal, of positive volume."""
    grid = np.stack(np.meshgrid(*[np.arange(N + 1)] * 3, indexing="ij"), -1).reshape(-1, 3)
    number = lambda p: (p[0] * (N + 1) + p[1]) * (N + 1) + p[2]
    cells = []
    for box in grid[(grid < N).all(axis=1)]:
        for order in permutations(range(3)):
            path = [box]
            for axis in order:
                path.append(path[-1] + np.eye(3, dtype=int)[axis])
            corners = [number(p) for p in path]
            is_even = np.linalg.det(np.eye(3)[list(order)]) > 0
            cells.append(corners if is_even else [corners[k] for k in (0, 2, 1, 3)])
    return grid / N, np.array(cells)


def sliver(eps):
    """Divides the cell in the middle by a vertex that close to one of its facets."""
    points, cells = block()
    middle = np.abs(points[cells].mean(axis=1) - [0.5, 0.5, 0.5]).sum(axis=1).argmin()
    cell = cells[middle]
    a, b, c, d = points[cell]
    normal = np.cross(b - a, c - a)
    normal /= np.linalg.norm(normal)
    new = (a + b + c) / 3 + normal * np.sign(normal @ (d - a)) * eps / N
    parts = np.repeat(cell[None], 4, axis=0)
    parts[range(4), range(4)] = len(points)
    cells = np.concatenate([np.delete(cells, middle, axis=0), parts])
    meshio.Mesh(np.vstack([points, new]), [("tetra", cells)]).write(HERE / f"sliver_{eps:.0e}.vtu", binary=True)


if __name__ == "__main__":
    for eps in (1e-1, 1e-2, 1e-3, 1e-4):
        sliver(eps)
