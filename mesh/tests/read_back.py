"""Reads files written by kerfem with meshio and PyVista (VTK) and checks that both see the same, finite mesh.

    python mesh/tests/read_back.py FILE.vtu ...

Prints one line a file; exit code 1 at the first that differs.
"""
import sys

import meshio
import numpy as np
import pyvista


def check(path):
    b = pyvista.read(path)
    if b.n_cells == 0:  # meshio reads no file without cells
        print(f"{path}: {b.n_points} points, no cells (PyVista only)")
        return
    a = meshio.read(path)
    assert np.array_equal(a.points, b.points) and np.isfinite(a.points).all() and a.points.dtype == np.float64
    kinds = {"tetra": 10, "triangle": 5, "tetra10": 24, "triangle6": 22}
    cells = {c.type: c.data for c in a.cells}
    assert sum(len(c) for c in cells.values()) == b.n_cells, "cell counts differ"
    for name, data in cells.items():
        assert np.array_equal(b.cells_dict[kinds[name]], data), name
    for mine, theirs in ((a.point_data, b.point_data), ({k: v[0] for k, v in a.cell_data.items()}, b.cell_data)):
        assert sorted(mine) == sorted(theirs.keys()), (sorted(mine), sorted(theirs.keys()))
        for name, values in mine.items():
            assert np.array_equal(values, theirs[name], equal_nan=True), name
    arrays = sorted([*a.point_data, *a.cell_data])
    print(f"{path}: {len(a.points)} points, {b.n_cells} cells, volume {b.volume:.12g}, arrays {', '.join(arrays) or 'none'}")


for file in sys.argv[1:]:
    check(file)
