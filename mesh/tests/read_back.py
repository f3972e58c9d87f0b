"""Reads files written by kerfem with the readers of ParaView (VTK), PyVista and meshio and checks that all see the same.

    python mesh/tests/read_back.py FILE.vtu FILE.vtp FILE.pvd ...

meshio reads no .vtp. Of a .pvd: its files are there, each at its time. Prints one line a file; exit code 1 at the first
that is wrong.
"""
import sys
from pathlib import Path

import meshio
import numpy as np
import pyvista
from vtkmodules.util.numpy_support import vtk_to_numpy
from vtkmodules.vtkIOXML import vtkXMLPolyDataReader, vtkXMLUnstructuredGridReader

KINDS = {3: "line", 5: "triangle", 10: "tetra", 22: "triangle6", 24: "tetra10"}
READERS = {".vtu": vtkXMLUnstructuredGridReader, ".vtp": vtkXMLPolyDataReader}


def from_vtk(path):
    """Points, corners by kind of cell and arrays, as ParaView's reader has them."""
    reader, said = READERS[path.suffix](), []
    for event in ("ErrorEvent", "WarningEvent"):
        reader.AddObserver(event, lambda _, event: said.append(event))
    assert reader.CanReadFile(str(path)), "VTK cannot read it"
    reader.SetFileName(str(path))
    reader.Update()
    assert not said, said
    grid = reader.GetOutput()
    cells = {}
    for k in range(grid.GetNumberOfCells()):
        ids = grid.GetCell(k).GetPointIds()
        corners = [ids.GetId(i) for i in range(ids.GetNumberOfIds())]
        cells.setdefault(KINDS[grid.GetCellType(k)], []).append(corners)
    arrays = [{data.GetArrayName(k): vtk_to_numpy(data.GetArray(k)) for k in range(data.GetNumberOfArrays())}
              for data in (grid.GetPointData(), grid.GetCellData())]
    points = vtk_to_numpy(grid.GetPoints().GetData()) if grid.GetPoints() else np.zeros((0, 3))
    return points, cells, *arrays


def from_pyvista(path):
    grid = pyvista.read(path).cast_to_unstructured_grid()
    cells = {KINDS[kind]: corners for kind, corners in grid.cells_dict.items()}
    return np.asarray(grid.points), cells, *({k: np.asarray(d[k]) for k in d.keys()} for d in (grid.point_data, grid.cell_data))


def from_meshio(path):
    mesh = meshio.read(path)
    cells = {block.type: block.data for block in mesh.cells}
    return mesh.points, cells, mesh.point_data, {k: v[0] for k, v in mesh.cell_data.items()}


def same(a, b):
    """Two readings, to the bit."""
    assert np.array_equal(a[0], b[0]) and a[0].dtype == b[0].dtype == np.float64, "points differ"
    for what, x, y in zip(("cells", "point arrays", "cell arrays"), a[1:], b[1:]):
        assert sorted(x) == sorted(y), (what, sorted(x), sorted(y))
        for name in x:
            assert np.array_equal(x[name], y[name], equal_nan=what != "cells"), (what, name)


def check_grid(path):
    ours = from_vtk(path)
    points, cells, of_points, of_cells = ours
    count = sum(map(len, cells.values()))
    assert np.isfinite(points).all(), "points that are not finite"
    assert all(len(a) == len(points) for a in of_points.values()) and all(len(a) == count for a in of_cells.values())
    readers = ["VTK"]
    for name, read in (("PyVista", from_pyvista), ("meshio", from_meshio)):
        if count and not (name == "meshio" and path.suffix == ".vtp"):  # without cells they drop arrays or read nothing
            same(ours, read(path))
            readers.append(name)
    arrays = ", ".join(sorted([*of_points, *of_cells]))
    return "%d points, %d cells, arrays %s (%s)" % (len(points), count, arrays or "none", ", ".join(readers))


def check_list(path):
    """Every file is there and is the one that is read at its time, and times ascend with the numbers of the steps."""
    reader = pyvista.get_reader(path)
    listed = [(d.time, d.path) for d in reader.datasets]
    assert listed and len(listed) == len(reader.time_values), "two files at one time, or none"
    assert [f for _, f in listed] == sorted({f for _, f in listed}), "times do not follow the steps"
    there = sorted(str(f.relative_to(path.parent)) for f in (path.parent / listed[0][1]).parent.glob("*"))
    assert there == [f for _, f in listed], "the folder holds other files than the list"
    for time, file in listed:
        reader.set_active_time_value(time)
        assert reader.read()[0] == pyvista.read(path.parent / file)
    return "%d files from %g s to %g s" % (len(listed), listed[0][0], listed[-1][0])


for file in map(Path, sys.argv[1:]):
    print("%s: %s" % (file, check_list(file) if file.suffix == ".pvd" else check_grid(file)))
