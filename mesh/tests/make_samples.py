"""Makes mesh/tests/samples: one small mesh in every form that is read. Needs pyvista, meshio and gmsh.

    python mesh/tests/make_samples.py

The samples are committed; this script says where they come from. Each holds the same two-by-one-by-one box of tetrahedra
(gmsh files: a box meshed by gmsh), with a vector at each point, a number and an integer in each cell.
"""
import pathlib

import gmsh
import meshio
import numpy as np
import pyvista
import vtk

HERE = pathlib.Path(__file__).parent / "samples"
HERE.mkdir(exist_ok=True)

KUHN = np.array([[0, 1, 3, 7], [0, 3, 2, 7], [0, 2, 6, 7], [0, 6, 4, 7], [0, 4, 5, 7], [0, 5, 1, 7]])
points = np.array([[i, j, k] for k in (0, 1) for j in (0, 1) for i in (0, 1, 2)], float)
corner = np.array([b % 2 + 3 * (b // 2 % 2) + 6 * (b // 4) for b in range(8)])
tets = np.concatenate([corner[KUHN], corner[KUHN] + 1])
velocity = points * [1.0, -2.0, 0.5] + 0.1
quality = np.linspace(0.25, 0.75, len(tets))
region = np.arange(len(tets)) % 3

# meshio: base64 inside the XML
mesh = meshio.Mesh(points, [("tetra", tets)], {"velocity": velocity}, {"quality": [quality], "region": [region]})
for compression in (None, "zlib", "lzma"):
    mesh.write(HERE / f"meshio_{compression or 'none'}.vtu", compression=compression)
mesh.write(HERE / "meshio_ascii.vtu", binary=False)

# VTK: every mode, compressor, header and order of bytes
grid = pyvista.UnstructuredGrid({pyvista.CellType.TETRA: tets}, points)
grid.point_data["velocity"] = velocity
grid.point_data["velocity32"] = velocity.astype(np.float32)
grid.cell_data["quality"] = quality
grid.cell_data["region"] = region.astype(np.int32)
grid.cell_data["flag"] = (region == 1).astype(np.uint8)
for mode, data_mode in (("ascii", 0), ("binary", 1), ("appended", 2)):
    for compressor, kind in (("none", 0), ("zlib", 1), ("lz4", 2), ("lzma", 3)):
        if mode == "ascii" and compressor != "none":
            continue
        for header, order, base64 in ((32, "le", True), (64, "be", False)):
            writer = vtk.vtkXMLUnstructuredGridWriter()
            writer.SetInputData(grid)
            writer.SetFileName(str(HERE / f"vtk_{mode}_{compressor}_{header}_{order}.vtu"))
            writer.SetDataMode(data_mode)
            writer.SetCompressorType(kind)
            writer.SetBlockSize(128)
            writer.SetHeaderType(header)
            writer.SetByteOrder(1 if order == "le" else 0)
            writer.SetEncodeAppendedData(base64)
            assert writer.Write() == 1
# what PyVista makes of it, and raw bytes in the order of most machines
for binary in (True, False):
    grid.save(HERE / f"pyvista_{'binary' if binary else 'ascii'}.vtu", binary=binary)
writer.SetFileName(str(HERE / "vtk_appended_none_32_le_raw.vtu"))
writer.SetCompressorType(0)
writer.SetHeaderType(32)
writer.SetByteOrder(1)
assert writer.Write() == 1

# refused or mixed cells
mixed = [("tetra", tets), ("triangle", tets[:, :3]), ("line", tets[:, :2]), ("vertex", tets[:, :1])]
meshio.Mesh(points, mixed, {}, {"number": [100 * k + np.arange(len(c)) for k, (_, c) in enumerate(mixed)]}).write(
    HERE / "mixed.vtu")
meshio.Mesh(points, [("tetra", tets), ("hexahedron", [[0, 1, 4, 3, 6, 7, 10, 9]])]).write(HERE / "hexahedron.vtu")
cells = [("triangle", [[0, 1, 4]]), ("quad", [[1, 2, 5, 4]]), ("polygon", [[0, 1, 4, 9, 6]])]
meshio.Mesh(points, cells).write(HERE / "surface.vtu", binary=False)

# legacy VTK: meshio (5.1 and 4.2), VTK (4.2 and 5.1), each ASCII and binary; VTK's surfaces
for binary in (True, False):
    form = "binary" if binary else "ascii"
    mesh.write(HERE / f"meshio_51_{form}.vtk", file_format="vtk51", binary=binary)
    mesh.write(HERE / f"meshio_42_{form}.vtk", file_format="vtk42", binary=binary)
    for version, name in ((42, "42"), (51, "51")):
        writer = vtk.vtkUnstructuredGridWriter()
        writer.SetInputData(grid)
        writer.SetFileName(str(HERE / f"vtk_{name}_{form}.vtk"))
        writer.SetFileVersion(version)
        writer.SetFileType(2 if binary else 1)
        assert writer.Write() == 1
    grid.save(HERE / f"pyvista_{form}.vtk", binary=binary)
square = pyvista.PolyData(points[[0, 1, 4, 3, 6]], faces=[4, 0, 1, 2, 3, 3, 0, 1, 4])
square.cell_data["lip"] = np.array([1.5, 2.5])
for binary in (True, False):
    form = "binary" if binary else "ascii"
    square.save(HERE / f"pyvista_surface_{form}.vtk", binary=binary)
    square.save(HERE / f"pyvista_surface_{form}.vtp", binary=binary)
    square.triangulate().save(HERE / f"pyvista_surface_{form}.stl", binary=binary)
    meshio.Mesh(points, [("triangle", [[0, 1, 4], [0, 4, 3]])]).write(HERE / f"meshio_surface_{form}.stl", binary=binary)
strip = pyvista.PolyData(points[[0, 1, 3, 4]], strips=[4, 0, 1, 2, 3])
strip.save(HERE / "pyvista_strip.vtp")
zigzag = pyvista.PolyData([[0, 0, 0], [1, 0.5, 0], [2, 0, 0], [2, 1, 0]], lines=[3, 0, 1, 2, 2, 2, 3])
zigzag.save(HERE / "pyvista_line.vtp")
zigzag.save(HERE / "pyvista_line.vtk")
zigzag.cast_to_unstructured_grid().save(HERE / "pyvista_line.vtu")

# TetGen and Medit
meshio.Mesh(points, [("tetra", tets)], cell_data={"tetgen:ref": [region]}).write(HERE / "meshio.node")
meshio.Mesh(points, [("tetra", tets), ("triangle", tets[:, :3])], cell_data={"medit:ref": [region, region + 7]}).write(
    HERE / "meshio.mesh")

# gmsh: every version
gmsh.initialize()
gmsh.option.setNumber("General.Verbosity", 0)
gmsh.option.setNumber("General.NumThreads", 1)
gmsh.model.occ.addBox(0, 0, 0, 2, 1, 1)
gmsh.model.occ.synchronize()
gmsh.option.setNumber("Mesh.MeshSizeMin", 0.9)
gmsh.option.setNumber("Mesh.MeshSizeMax", 0.9)
left = gmsh.model.getEntitiesInBoundingBox(-1e-3, -1e-3, -1e-3, 1e-3, 2, 2, 2)
gmsh.model.addPhysicalGroup(2, [left[0][1]], 7, "left side")
gmsh.model.addPhysicalGroup(3, [1], 3, "body")
gmsh.model.addPhysicalGroup(0, [1], 12)
gmsh.model.mesh.generate(3)
for version, binary in ((1.0, 0), (2.2, 0), (4.1, 0), (2.2, 1), (4.1, 1), (4.0, 0)):
    gmsh.option.setNumber("Mesh.MshFileVersion", version)
    gmsh.option.setNumber("Mesh.Binary", binary)
    gmsh.write(str(HERE / f"gmsh_{version}{'_binary' if binary else ''}.msh"))
again = meshio.read(HERE / "gmsh_4.1.msh")  # what meshio makes of it
for binary in (True, False):
    for version, file_format in ((2.2, "gmsh22"), (4.1, "gmsh")):
        again.write(HERE / f"meshio_{version}_{'binary' if binary else 'ascii'}.msh", file_format=file_format, binary=binary)
gmsh.model.mesh.setOrder(2)
gmsh.option.setNumber("Mesh.Binary", 0)
gmsh.option.setNumber("Mesh.MshFileVersion", 4.1)
gmsh.write(str(HERE / "gmsh_order2.msh"))
kinds, tags, nodes = gmsh.model.mesh.getElements(3)
print("gmsh tetrahedra", len(tags[0]))



def write_versions(name):
    for version, binary in ((2.2, 0), (4.1, 0), (2.2, 1), (4.1, 1)):
        gmsh.option.setNumber("Mesh.MshFileVersion", version)
        gmsh.option.setNumber("Mesh.Binary", binary)
        gmsh.write(str(HERE / f"{name}_{version}{'_binary' if binary else ''}.msh"))


def mesh_size(size):
    gmsh.option.setNumber("Mesh.MeshSizeMin", size)
    gmsh.option.setNumber("Mesh.MeshSizeMax", size)


def entities(dimension, low, high):
    """The entities within a box."""
    box = np.array([low, high], float) + np.array([[-1e-3], [1e-3]])
    return [tag for _, tag in gmsh.model.getEntitiesInBoundingBox(*box.ravel(), dimension)]


# gmsh: two boxes with groups of every dimension, some of them sharing entities
gmsh.clear()
for x in (0, 1):
    gmsh.model.occ.addBox(x, 0, 0, 1, 1, 1)
gmsh.model.occ.fragment([(3, 1)], [(3, 2)])
gmsh.model.occ.synchronize()
left, right = entities(2, [0, 0, 0], [0, 1, 1]), entities(2, [2, 0, 0], [2, 1, 1])
gmsh.model.addPhysicalGroup(3, entities(3, [0, 0, 0], [1, 1, 1]), 1, "left half")
gmsh.model.addPhysicalGroup(3, [1, 2], 2, "body")
gmsh.model.addPhysicalGroup(2, left, 1, "clamp")
gmsh.model.addPhysicalGroup(2, right, 2, "pull")
gmsh.model.addPhysicalGroup(2, left + right, 3, "ends")
gmsh.model.addPhysicalGroup(2, entities(2, [1, 0, 0], [1, 1, 1]), 4, "between")
gmsh.model.addPhysicalGroup(1, entities(1, [2, 0, 0], [2, 1, 0]), 5, "edge")
gmsh.model.addPhysicalGroup(0, entities(0, [2, 0, 0], [2, 0, 0]), 6, "corner")
mesh_size(1)
gmsh.model.mesh.generate(3)
write_versions("groups")

# gmsh: a planar mesh with groups of the sheet, boundary curves and a point, one curve in two groups; and other formats
gmsh.clear()
gmsh.model.occ.addRectangle(0, 0, 0, 2, 1)
gmsh.model.occ.synchronize()
gmsh.model.addPhysicalGroup(1, [4], 5, "left end")
gmsh.model.addPhysicalGroup(1, [2], 6, "right end")
gmsh.model.addPhysicalGroup(1, [2, 4], 7, "ends")
gmsh.model.addPhysicalGroup(2, [1], 8, "sheet")
gmsh.model.addPhysicalGroup(0, entities(0, [2, 1, 0], [2, 1, 0]), 9, "tip")
mesh_size(0.5)
gmsh.model.mesh.generate(2)
write_versions("planar")
gmsh.option.setNumber("Mesh.Binary", 0)
gmsh.write(str(HERE / "planar.mesh"))
gmsh.write(str(HERE / "planar.vtk"))
gmsh.option.setNumber("Mesh.Binary", 1)
gmsh.write(str(HERE / "planar_binary.vtk"))
gmsh.finalize()
