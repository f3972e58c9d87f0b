"""Makes organ.msh, blade.obj and blade_through.obj beside this script. Needs numpy and gmsh; the files are committed, so
that nobody needs to run it.

    python examples/scenes/make_organ.py

The organ is a smooth body like a liver, 0.15 m wide: the image of a sphere of triangles, filled with tetrahedra by gmsh.
Groups: "body" (all of it) and "clamp" (a patch of the surface, where the ligaments would hold it). x points from the thick
lobe to the thin one, z upwards. The blades are arcs of a cylinder whose axis is parallel to y: `blade` comes from above and
reaches half through, `blade_through` cuts the body in two.
"""
import pathlib

import gmsh
import numpy as np

HERE = pathlib.Path(__file__).parent
EDGE_PARTS = 8  # parts of each edge of the icosahedron


def sphere(n):
    """Unit sphere: each triangle of an icosahedron in n * n triangles."""
    g = (1 + 5**0.5) / 2
    corners = np.array([[-1, g, 0], [1, g, 0], [-1, -g, 0], [1, -g, 0], [0, -1, g], [0, 1, g], [0, -1, -g], [0, 1, -g],
                        [g, 0, -1], [g, 0, 1], [-g, 0, -1], [-g, 0, 1]])
    faces = [[0, 11, 5], [0, 5, 1], [0, 1, 7], [0, 7, 10], [0, 10, 11], [1, 5, 9], [5, 11, 4], [11, 10, 2], [10, 7, 6],
             [7, 1, 8], [3, 9, 4], [3, 4, 2], [3, 2, 6], [3, 6, 8], [3, 8, 9], [4, 9, 5], [2, 4, 11], [6, 2, 10],
             [8, 6, 7], [9, 8, 1]]
    points, triangles, index = [], [], {}

    def vertex(face, i, j):
        weights = {face[0]: n - i - j, face[1]: i, face[2]: j}
        key = tuple(sorted((c, w) for c, w in weights.items() if w))
        if key not in index:
            index[key] = len(points)
            p = sum(w * corners[c] for c, w in key)
            points.append(p / np.linalg.norm(p))
        return index[key]

    for face in faces:
        for i in range(n):
            for j in range(n - i):
                triangles.append([vertex(face, i, j), vertex(face, i + 1, j), vertex(face, i, j + 1)])
                if i + j < n - 1:
                    triangles.append([vertex(face, i + 1, j), vertex(face, i + 1, j + 1), vertex(face, i, j + 1)])
    return np.array(points), np.array(triangles)


def organ(s):
    """Image of points of the unit sphere (m): thick at -x, thin at +x, hollow below."""
    x, y, z = s.T
    thickness = 1 - 0.38 * x - 0.12 * x**2
    width = 1 - 0.25 * x
    flat = np.where(z < 0, 0.75, 1.0) * z  # smooth enough: the slope changes only along the rim
    hollow = 0.012 * np.exp(-((x - 0.15) ** 2 + (y + 0.1) ** 2) / 0.25) * (z < 0) * z**2
    return np.column_stack([
        0.077 * x + 0.004 * y**2,
        0.050 * width * y + 0.010 * x**2,
        0.042 * thickness * flat + hollow - 0.014 * x**2,
    ])


def even(s, triangles, rounds=200):
    """Moves points on the unit sphere so that the edges of their image become more alike."""
    edges = np.unique(np.sort(np.concatenate([triangles[:, [i, (i + 1) % 3]] for i in range(3)]), axis=1), axis=0)
    for _ in range(rounds):
        p = organ(s)
        weight = np.linalg.norm(p[edges[:, 0]] - p[edges[:, 1]], axis=1)[:, None]
        mean = np.zeros_like(s)
        for i, j in ((0, 1), (1, 0)):
            np.add.at(mean, edges[:, i], weight * (s[edges[:, j]] - s[edges[:, i]]))
        total = np.bincount(edges.ravel(), np.repeat(weight[:, 0], 2))
        s = s + 0.5 * mean / total[:, None]
        s /= np.linalg.norm(s, axis=1)[:, None]
    return s


def fill(points, triangles):
    """Nodes and tetrahedra inside a closed surface; the surface keeps its points, as the first nodes."""
    gmsh.model.add("fill")
    gmsh.model.addDiscreteEntity(2, 1)
    gmsh.model.mesh.addNodes(2, 1, range(1, len(points) + 1), points.ravel())
    gmsh.model.mesh.addElementsByType(1, 2, [], (triangles + 1).ravel())
    gmsh.model.geo.addVolume([gmsh.model.geo.addSurfaceLoop([1])], 1)
    gmsh.model.geo.synchronize()
    gmsh.model.mesh.generate(3)
    for method in ("Netgen", "Netgen"):
        gmsh.model.mesh.optimize(method)
    tags, coordinates, _ = gmsh.model.mesh.getNodes()
    order = np.argsort(tags)
    tets = np.searchsorted(tags[order], gmsh.model.mesh.getElementsByType(4)[1]).reshape(-1, 4)
    return coordinates.reshape(-1, 3)[order], tets


def write_mesh(path, points, tets, clamp, rest):
    """One volume, one surface in two parts, as gmsh 4.1 ASCII with physical groups."""
    gmsh.model.add("organ")
    for dimension, tag, boundary in ((2, 1, []), (2, 2, []), (3, 1, [1, 2])):
        gmsh.model.addDiscreteEntity(dimension, tag, boundary)
    gmsh.model.mesh.addNodes(3, 1, range(1, len(points) + 1), np.round(points, 9).ravel())
    for tag, triangles in ((1, clamp), (2, rest)):
        gmsh.model.mesh.addElementsByType(tag, 2, [], (triangles + 1).ravel())
    gmsh.model.mesh.addElementsByType(1, 4, [], (tets + 1).ravel())
    gmsh.model.addPhysicalGroup(3, [1], 1, "body")
    gmsh.model.addPhysicalGroup(2, [1], 2, "clamp")
    gmsh.option.setNumber("Mesh.MshFileVersion", 4.1)
    gmsh.write(str(path))


def blade(path, x0, radius, z_low, z_high, rows, columns):
    """An arc of a cylinder between two heights, right across the organ where it hangs at the time of the cut, as .obj."""
    z, y = np.meshgrid(np.linspace(z_low, z_high, rows + 1), np.linspace(-0.075, 0.09, columns + 1), indexing="ij")
    x = x0 + radius - np.sqrt(radius**2 - (z - 0.01) ** 2)
    with open(path, "w", newline="\n") as out:
        out.write(f"# arc of a cylinder, radius {radius} m (made by make_organ.py)\n")
        for p in np.column_stack([x.ravel(), y.ravel(), z.ravel()]):
            out.write("v {:.9g} {:.9g} {:.9g}\n".format(*p))
        for i in range(rows):
            for j in range(columns):
                a = 1 + i * (columns + 1) + j
                b = a + columns + 1
                out.write(f"f {a} {a + 1} {b + 1}\nf {a} {b + 1} {b}\n")


def radius_ratios(points, tets):
    a, b, c = (points[tets[:, k]] - points[tets[:, 0]] for k in (1, 2, 3))
    six_v = np.einsum("ij,ij->i", np.cross(a, b), c)
    norm = lambda v: np.linalg.norm(v, axis=1)
    areas2 = norm(np.cross(a, b)) + norm(np.cross(b, c)) + norm(np.cross(c, a)) + norm(np.cross(b - a, c - a))
    square = lambda v: (v**2).sum(axis=1, keepdims=True)
    q = square(a) * np.cross(b, c) + square(b) * np.cross(c, a) + square(c) * np.cross(a, b)
    return 6 * six_v**2 / (areas2 * norm(q)), six_v.sum() / 6


gmsh.initialize()
for option, value in {"General.Verbosity": 2, "General.NumThreads": 1, "Mesh.RandomSeed": 1, "Mesh.Algorithm3D": 10,
                      "Mesh.OptimizeThreshold": 0.5, "Mesh.MeshSizeFactor": 1.0}.items():
    gmsh.option.setNumber(option, value)
on_sphere, triangles = sphere(EDGE_PARTS)
on_sphere = even(on_sphere, triangles)
points, tets = fill(organ(on_sphere), triangles)
middle = on_sphere[triangles].mean(axis=1)
held = (middle @ [-0.25, 0.85, 0.45] > 0.8)  # behind and above
write_mesh(HERE / "organ.msh", points, tets, triangles[held], triangles[~held])
gmsh.finalize()
blade(HERE / "blade.obj", -0.018, 0.08, 0.0, 0.055, 8, 18)
blade(HERE / "blade_through.obj", 0.004, 0.12, -0.09, 0.06, 20, 18)
quality, volume = radius_ratios(np.round(points, 9), tets)
print(f"{len(points)} nodes, {len(tets)} tetrahedra, {held.sum()} clamped triangles, volume {volume:.6g} m3, "
      f"size {np.ptp(points, axis=0).round(4)} m, radius ratio min {quality.min():.3f} mean {quality.mean():.3f}")
