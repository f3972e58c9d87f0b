"""Runs the command `kerfem` and judges what it writes, with code that shares nothing with it.

    python validation/check_results.py target/release/kerfem [--out DIR]

Needs the packages of validation/requirements.txt. The files are read by meshio and by VTK (PyVista, nothing is drawn),
the matrices compared with scikit-fem's on the mesh of the result. If ../shared/data/cases is there, its cases of what the
command can do are run as well; if not, that part is skipped, and fails where KERFEM_REQUIRE_SHARED=1. Exit code 1 if
anything differs.
"""
import argparse
import csv
import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path

import meshio
import numpy as np
import pyvista
from scipy.io import mmread
from scipy.sparse import diags
from skfem import Basis, BilinearForm, ElementTetP1, ElementTetP2, ElementVector, FacetBasis, LinearForm, MeshTet, asm, condense, solve
from skfem.helpers import dot
from skfem.models.elasticity import lame_parameters, linear_elasticity

HERE = Path(__file__).resolve().parent
ROOT = HERE.parent
CASES = ROOT.parent / "shared" / "data" / "cases"
YOUNG, POISSON, DENSITY, DT = 1e7, 0.3, 1000.0, 0.01  # of every scene here

# Cases of the shared set that the command is asked to pass: those in space that match.
PATTERNS = ["a_*", "b_*", "c_*", "d_*", "e_*"]
# Cases that match and are known to fail, each with the reason.
EXCEPTIONS = {}


class Failed(Exception):
    pass


def check(name, ok, figure=""):
    print("%-5s %s %s" % ("ok" if ok else "FAIL", name, figure), flush=True)
    if not ok:
        raise Failed(name)


def relative(a, b):
    """Largest difference of two arrays or sparse matrices, relative to the largest entry of the second."""
    return float(abs(a - b).max() / abs(b).max())


def run(kerfem, *arguments, code=0):
    done = subprocess.run([kerfem, *map(str, arguments)], capture_output=True, text=True, timeout=300)
    if done.returncode != code:
        raise Failed("kerfem %s: exit code %d where %d is expected\n%s" % (" ".join(map(str, arguments)), done.returncode, code, done.stderr))
    return done


# --- matrices ---------------------------------------------------------------------------------------------------------

def check_system(folder, dt):
    """`--export-system` against scikit-fem on final.vtu; `dt` of the last step, none in statics."""
    grid = meshio.read(folder / "final.vtu")
    mesh = MeshTet(*(np.ascontiguousarray(a.T) for a in (grid.points, grid.cells_dict["tetra"])))
    basis = Basis(mesh, ElementVector(ElementTetP1()), intorder=2)
    assert (basis.nodal_dofs.T.ravel() == np.arange(basis.N)).all()  # dof = 3 * vertex + axis
    stiffness = asm(linear_elasticity(*lame_parameters(YOUNG, POISSON)), basis)
    mass = asm(BilinearForm(lambda u, v, w: DENSITY * dot(u, v)), basis)
    system = {name: mmread(folder / "system" / (name + ".mtx")) for name in ("K", "K_tangent", "M", "M_lumped", "f")}
    for name, exact in (("K", stiffness), ("M", mass), ("M_lumped", lumped(mesh))):
        error = relative(system[name].tocsr(), exact)
        check("%s: %s equals scikit-fem's" % (folder.name, name), error < 1e-12, "to %.1e" % error)

    load = np.asarray(system["f"]).reshape(-1, 3)
    end = boundary_facets(grid, lambda p: p[:, 0] > 4 - 1e-9)
    exact = lumped(mesh).diagonal().reshape(-1, 3) * [0, 0, -9.81]
    corners = grid.points[end]
    areas = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1) / 2
    np.add.at(exact, end.ravel(), np.repeat(areas / 3, 3)[:, None] * [300, 40, -150])
    error = relative(load, exact)
    check("%s: f is gravity and traction" % folder.name, error < 1e-12, "to %.1e" % error)

    tangent = system["K_tangent"].tocsr()
    error = relative(tangent, tangent.T)
    check("%s: K_tangent is symmetric" % folder.name, error < 1e-12, "to %.1e" % error)
    free = np.repeat(grid.points[:, 0] > 1e-9, 3)
    u = grid.point_data["displacement"].ravel()
    if dt is None:
        error = relative(tangent, stiffness)
        check("%s: K_tangent of linear statics is K" % folder.name, error < 1e-12, "to %.1e" % error)
        error = np.linalg.norm((stiffness @ u - load.ravel())[free]) / np.linalg.norm(load)
        check("%s: the displacements balance the load" % folder.name, error < 1e-9, "to %.1e" % error)
    else:
        least = (tangent - lumped(mesh) / dt**2).diagonal().min()
        check("%s: K_tangent holds the mass over dt squared and more" % folder.name, least > 0)


def check_order_2(kerfem, folder):
    """A cut cantilever of order 2 against quadratic elements of scikit-fem on the mesh of the result."""
    scene = (HERE / "references" / "cut_plane.toml").read_text().replace("[model]", "[model]\norder = 2")
    folder.mkdir(exist_ok=True)
    path = folder / "order2.toml"
    path.write_text(scene.replace('"cut_plane.obj"', json.dumps(str(HERE / "references" / "cut_plane.obj"))))
    run(kerfem, "run", path, "-o", folder, "--verify", "--export-system", "--quiet")
    grid = meshio.read(folder / "final.vtu")
    cells = grid.cells_dict["tetra10"]
    corners, numbers = np.unique(cells[:, :4], return_inverse=True)
    mesh = MeshTet(np.ascontiguousarray(grid.points[corners].T), np.ascontiguousarray(numbers.reshape(-1, 4).T))
    basis = Basis(mesh, ElementVector(ElementTetP2()), intorder=4)
    ends = np.array([[0, 1], [1, 2], [2, 0], [0, 3], [1, 3], [2, 3]])
    middles = {tuple(sorted(edge)): v for row, own in zip(numbers.reshape(-1, 4), cells) for edge, v in zip(row[ends], own[4:])}
    edges = np.array([middles[tuple(sorted(edge))] for edge in mesh.edges.T])
    vertex = np.empty(basis.N, dtype=int)  # the vertex of final.vtu of each of scikit-fem's dofs
    vertex[basis.nodal_dofs], vertex[basis.edge_dofs] = corners, edges
    axis = np.empty(basis.N, dtype=int)
    axis[basis.nodal_dofs], axis[basis.edge_dofs] = np.arange(3)[:, None], np.arange(3)[:, None]
    order = 3 * vertex + axis
    middle = (grid.points[corners][mesh.edges[0]] + grid.points[corners][mesh.edges[1]]) / 2
    check("order 2: mid-edge vertices lie in the middle", relative(grid.points[edges], middle) < 1e-14, "%d edges" % len(edges))

    stiffness = asm(linear_elasticity(*lame_parameters(YOUNG, POISSON)), basis)
    mass = asm(BilinearForm(lambda u, v, w: DENSITY * dot(u, v)), basis)
    for name, exact in (("K", stiffness), ("M", mass)):
        error = relative(mmread(folder / "system" / (name + ".mtx")).tocsr()[order][:, order], exact)
        check("order 2: %s equals scikit-fem's" % name, error < 1e-12, "to %.1e" % error)
    load = asm(LinearForm(lambda v, w: -9.81 * DENSITY * v[2]), basis)
    end = mesh.facets_satisfying(lambda x: x[0] > 4 - 1e-9, boundaries_only=True)
    traction = LinearForm(lambda v, w: 300 * v[0] + 40 * v[1] - 150 * v[2])
    load += asm(traction, FacetBasis(mesh, basis.elem, facets=end, intorder=4))
    error = relative(np.asarray(mmread(folder / "system" / "f.mtx")).ravel()[order], load)
    check("order 2: f is gravity and traction", error < 1e-12, "to %.1e" % error)
    held = np.flatnonzero(grid.points[vertex][:, 0] < 1e-9)
    u = solve(*condense(stiffness, load, D=held))
    error = relative(grid.point_data["displacement"].ravel()[order], u)
    check("order 2: the displacements of a cut body equal scikit-fem's", error < 1e-9, "to %.1e" % error)
    verify = json.loads((folder / "report.json").read_text())["verify"]
    check("order 2: --verify", verify["invariants"] == "ok" and verify["stiffness_max_relative_difference"] == 0, verify["invariants"])
    pyvista.read(folder / "final.vtu")


def lumped(mesh):
    """A quarter of the mass of each cell to each corner."""
    p = mesh.p[:, mesh.t].transpose(2, 1, 0)
    volumes = np.abs(np.linalg.det(p[:, 1:] - p[:, :1])) / 6
    masses = np.bincount(mesh.t.ravel(), np.tile(DENSITY * volumes / 4, 4), mesh.p.shape[1])
    return diags(np.repeat(masses, 3)).tocsr()


def boundary_facets(grid, where):
    """Corners of the facets of one cell only whose corners all satisfy `where`."""
    cells = grid.cells_dict.get("tetra", grid.cells_dict.get("triangle"))
    facets = np.concatenate([np.delete(cells, k, axis=1) for k in range(cells.shape[1])])
    _, first, count = np.unique(np.sort(facets, axis=1), axis=0, return_index=True, return_counts=True)
    facets = facets[first[count == 1]]
    return facets[where(grid.points)[facets].all(axis=1)]


# --- files ------------------------------------------------------------------------------------------------------------

QUALITY = ("min_radius_ratio mean_radius_ratio min_dihedral_deg max_dihedral_deg max_edge_over_inradius max_over_min_volume "
           "max_over_min_edge").split()
MESH = {**dict.fromkeys("vertices cells volume_m3 mass_kg pieces".split()), "quality": dict.fromkeys(QUALITY)}
CUT = {"seconds": dict.fromkeys("find remesh improve update".split()), **dict.fromkeys(
    "at method cells_removed cells_added vertices_added vertices_removed vertices_moved rows_updated area_m2 "
    "max_distance_to_sweep_m volume_change_relative mass_change_relative momentum_change_relative energy_before_J "
    "energy_after_J pieces_before pieces_after refused".split()),
    "quality_before": dict.fromkeys(QUALITY), "quality_after": dict.fromkeys(QUALITY)}
REPORT = {**dict.fromkeys("name version threads quantities choices warnings".split()), "mesh": {"initial": MESH, "final": MESH},
          "solver": dict.fromkeys("iterations_total iterations_max residual_max unconverged_steps".split()),
          "seconds": dict.fromkeys("total assemble solve cut update write".split()), "cuts": [CUT],
          "verify": dict.fromkeys("stiffness_max_relative_difference mass_max_relative_difference invariants".split())}
STEPS = ("step t dt cells vertices dofs iterations residual kinetic_J elastic_J potential_J dissipated_J assemble_s solve_s "
         "cut_s write_s").split()


def missing(found, wanted, path=""):
    """Keys that `wanted` (nested; the one entry of a list stands for all) has and `found` has not."""
    if isinstance(wanted, list):
        return [m for i, entry in enumerate(found) for m in missing(entry, wanted[0], "%s[%d]" % (path, i))]
    out = []
    for key, inner in (wanted or {}).items():
        place = "%s.%s" % (path, key)
        out += missing(found[key], inner, place) if key in found else [place]
    return out


def check_report(folder):
    report = json.loads((folder / "report.json").read_text())
    lacks = missing(report, REPORT)
    check("report.json has its keys", not lacks, ", ".join(lacks))
    verify, (cut,) = report["verify"], report["cuts"]
    differences = [verify["stiffness_max_relative_difference"], verify["mass_max_relative_difference"]]
    check("--verify: K and M after the local update are those of a fresh assembly", differences == [0, 0])
    check("--verify: invariants", verify["invariants"] == "ok", verify["invariants"])
    kept = [abs(cut[k + "_change_relative"]) for k in ("volume", "mass", "momentum")]
    check("the cut keeps volume, mass and momentum", max(kept) < 1e-12, "to %.1e" % max(kept))
    check("the cut is where it should be", abs(cut["at"] - 0.05) < 1e-9 and cut["area_m2"] > 0.3 and not cut["refused"])
    final = meshio.read(folder / "final.vtu")
    counts = [report["mesh"]["final"][k] for k in ("vertices", "cells")]
    check("the report counts what final.vtu holds", counts == [len(final.points), len(final.cells_dict["tetra"])])
    mean = area_mean(final, lambda p: p[:, 0] > 4 - 1e-9, 2)
    error = abs(report["quantities"]["tip_uz"] / mean - 1)
    check("the quantity is that of final.vtu", error < 1e-12, "to %.1e" % error)

    with open(folder / "steps.csv") as file:
        rows = list(csv.DictReader(file))
    probes = ["probe.tip." + axis for axis in "xyz"]
    check("steps.csv has its columns", list(rows[0]) == STEPS + probes)
    values = np.array([[float(r[k]) for k in STEPS] for r in rows])
    check("steps.csv has its rows", np.isfinite(values).all() and np.allclose(values[:, 1], DT * np.arange(1, 11), rtol=1e-12))
    tip = [float(rows[-1][p]) for p in probes]
    nearest = np.argmin(np.linalg.norm(final.points - [4, 0.5, 0.5], axis=1))
    error = relative(np.array(tip), final.point_data["displacement"][nearest])
    check("the probe moves like its vertex", error < 1e-12, "to %.1e" % error)
    v, m = final.point_data["velocity"], np.asarray(final.point_data["mass"]).ravel()
    error = abs(float(rows[-1]["kinetic_J"]) / (0.5 * (m[:, None] * v**2).sum()) - 1)
    check("the kinetic energy is that of final.vtu", error < 1e-12, "to %.1e" % error)


def area_mean(grid, where, axis):
    facets = boundary_facets(grid, where)
    p = grid.points[facets]
    areas = np.linalg.norm(np.cross(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0]), axis=1)
    return (areas * grid.point_data["displacement"][facets, axis].mean(axis=1)).sum() / areas.sum()


def check_frames(folder):
    reader = pyvista.get_reader(folder / "results.pvd")
    times = reader.time_values
    check("results.pvd lists the frames", np.allclose(times, 0.02 * np.arange(6), rtol=1e-12), str(times))
    reader.set_active_time_value(times[-1])
    last = reader.read()[0]
    final = meshio.read(folder / "final.vtu")
    same = np.array_equal(last.points, final.points) and np.array_equal(last["displacement"], final.point_data["displacement"])
    check("the last frame is final.vtu", same)
    first = pyvista.read(folder / "frames" / "results_000000.vtu")
    check("the first frame is the body at rest", not first["displacement"].any() and first.n_points == 325)
    ids, first_ids = last.point_data["vertex_id"], first.point_data["vertex_id"]
    kept = ids < first.n_points  # improving cells takes some vertices away
    check("vertex ids are stable", np.array_equal(first_ids, np.arange(325)) and (np.diff(ids) > 0).all() and 300 < kept.sum() < last.n_points)
    fixed = [set(i[p[:, 0] < 1e-9]) for i, p in ((first_ids, first.points), (ids[kept], last.points[kept]))]
    check("points lie at rest", abs(last.volume / 4 - 1) < 1e-12 and fixed[0] == fixed[1], "%d of 325 vertices are left" % kept.sum())
    points = {"vertex_id": 1, "displacement": 3, "velocity": 3, "internal_force": 3, "mass": 1}
    cells = {"von_mises": 1, "quality": 1, "stress": 9, "strain": 9, "region": 1}
    for wanted, arrays in ((points, last.point_data), (cells, last.cell_data)):
        found = {k: 1 if arrays[k].ndim == 1 else int(np.prod(arrays[k].shape[1:])) for k in arrays.keys()}
        check("arrays", all(found.get(k) == n for k, n in wanted.items()), str(found))
    kinds = {a.dtype for a in [last.points, last["displacement"], last["velocity"], last["stress"]]}
    check("numbers are Float64", kinds == {np.dtype(np.float64)})
    stress = last["stress"].reshape(-1, 3, 3)
    deviator = stress - np.trace(stress, axis1=1, axis2=2)[:, None, None] * np.eye(3) / 3
    error = relative(last["von_mises"], np.sqrt(1.5 * (deviator**2).sum(axis=(1, 2))))
    check("von Mises stress follows from the stress", error < 1e-12, "to %.1e" % error)


def read_back(folder):
    """All files of a folder and the folders in it, by the readers of others."""
    files = sorted(f for f in folder.rglob("*") if f.suffix in (".vtu", ".vtp", ".pvd"))
    command = [sys.executable, ROOT / "mesh" / "tests" / "read_back.py", *files]
    done = subprocess.run(command, capture_output=True, text=True)
    check("%s: ParaView's readers, PyVista and meshio read the same from each file" % folder.name, done.returncode == 0 and files,
          "%d files" % len(files) if done.returncode == 0 else done.stdout + done.stderr)


def check_surface(folder, name, inside):
    """The last surface is the boundary of final.vtu; `inside` is the volume or the area that it encloses."""
    lists = [pyvista.get_reader(folder / (name + ending)) for ending in (".pvd", "_surface.pvd")]
    times = lists[1].time_values
    check("%s_surface.pvd lists the surface of each frame" % name, times == lists[0].time_values and len(times) > 2, str(times))
    lists[1].set_active_time_value(times[-1])
    surface, final = lists[1].read()[0], meshio.read(folder / "final.vtu")
    rows = np.searchsorted(final.point_data["vertex_id"], surface["vertex_id"])
    same = np.array_equal(surface.points, final.points[rows])
    for array in ("vertex_id", "displacement", "velocity"):
        same = same and np.array_equal(surface[array], final.point_data[array][rows])
    check("%s: the last surface moves as final.vtu" % name, same and set(surface.array_names) == {"vertex_id", "displacement", "velocity"})
    facets = surface.regular_faces if surface.faces.size else surface.lines.reshape(-1, 3)[:, 1:]
    found, wanted = (np.unique(np.sort(f, axis=1), axis=0) for f in (rows[facets], boundary_facets(final, lambda p: p[:, 0] < np.inf)))
    check("%s: it is the boundary of final.vtu" % name, np.array_equal(found, wanted) and len(found) == len(facets), "%d facets" % len(facets))
    p = surface.points[facets]
    size = np.linalg.det(p).sum() / 6 if facets.shape[1] == 3 else np.cross(p[:, 0], p[:, 1])[:, 2].sum() / 2
    check("%s: it encloses the body, seen from outside" % name, abs(size / inside - 1) < 1e-12, "%.15g" % size)


def check_planar(kerfem, folder):
    run(kerfem, "run", HERE / "scenes" / "planar.toml", "-o", folder, "--verify", "--quiet")
    final = meshio.read(folder / "final.vtu")
    u = final.point_data["displacement"]
    check("planar: triangles with z = 0 and three components", list(final.cells_dict) == ["triangle"]
          and not final.points[:, 2].any() and u.shape == final.points.shape and not u[:, 2].any() and u[:, 1].min() < -1e-3)
    check("planar: the mass is that of the sheet", abs(final.point_data["mass"].sum() / 200 - 1) < 1e-12)
    times = pyvista.get_reader(folder / "planar.pvd").time_values
    check("planar.pvd lists the frames", np.allclose(times, 0.02 * np.arange(4), rtol=1e-12), str(times))
    check_surface(folder, "planar", 2)
    for ending in ("vtu", "vtp"):
        run(kerfem, "cut", folder / "final.vtu", "--sweep", HERE / "scenes" / "planar_line.obj", "-o", folder / ("cut." + ending))
    sheet, surface = (pyvista.read(folder / ("cut." + ending)) for ending in ("vtu", "vtp"))
    check("kerfem cut writes a sheet as .vtu and as .vtp", np.array_equal(sheet.points, surface.points)
          and np.array_equal(sheet.cells_dict[5], surface.regular_faces) and np.array_equal(sheet["quality"], surface["quality"]))
    read_back(folder)


# --- the command ------------------------------------------------------------------------------------------------------

def check_command(kerfem, folder):
    sweep = HERE / "references" / "cut_curved.obj"
    mesh = HERE / "references" / "cantilever_gravity.vtu"
    quality = json.loads(run(kerfem, "quality", mesh, "--json").stdout)
    check("kerfem quality", quality["cells"] == 1152 and abs(quality["volume_m3"] / 4 - 1) < 1e-12)
    (folder / "cut").mkdir(exist_ok=True)
    out = folder / "cut" / "cut.vtu"
    report = json.loads(run(kerfem, "cut", mesh, "--sweep", sweep, "--method", "hybrid", "-o", out, "--json").stdout)
    cut = pyvista.read(out)
    check("kerfem cut", abs(cut.volume / 4 - 1) < 1e-12 and cut.n_cells == report["after"]["cells"] > 1152)
    said = run(kerfem, "cut", mesh, "--sweep", sweep, "-o", folder / "cut" / "cut.vtp", code=2).stderr
    check("a body is not written as a surface", said.count("\n") == 1 and ".vtu" in said, said.strip())
    read_back(folder / "cut")
    run(kerfem, "check", HERE / "scenes" / "results.toml")
    bad = folder / "bad.toml"
    bad.write_text((HERE / "scenes" / "results.toml").read_text().replace("young", "yuong"))
    said = run(kerfem, "run", bad, code=2).stderr
    check("a mistyped key ends with exit code 2 and one line", said.count("\n") == 1 and "young" in said, said.strip())
    falls = folder / "falls.toml"
    text = (HERE / "references" / "cut_plane.toml").read_text().replace("cut_plane.obj", "through.obj")
    falls.write_text(text)
    (folder / "through.obj").write_text("v 2 -1 -1\nv 2 2 -1\nv 2.1 2 2\nv 2.1 -1 2\nf 1 2 3\nf 1 3 4\n")
    said = run(kerfem, "run", falls, "-o", folder / "falls", code=3).stderr
    check("statics with a falling piece ends with exit code 3", "piece 2 of 2" in said, said.strip())
    pyvista.read(folder / "falls" / "final.vtu")


def check_threads(kerfem, folder):
    """The same bits with one thread and with four."""
    for n in (1, 4):
        run(kerfem, "run", HERE / "scenes" / "results.toml", "-o", folder / ("threads%d" % n), "--threads", n, "--quiet")
    one, four = ((folder / ("threads%d" % n) / "final.vtu").read_bytes() for n in (1, 4))
    check("one thread and four give the same bits", one == four)


# --- cases of others --------------------------------------------------------------------------------------------------

def check_cases(kerfem, folder):
    if not CASES.is_dir():
        check("../shared/data/cases", os.environ.get("KERFEM_REQUIRE_SHARED") != "1", "skipped: ../shared is absent")
        return
    chosen = []
    for path in sorted({p.parent for pattern in PATTERNS for p in CASES.glob(pattern + "/case.json")}):
        if path.name in EXCEPTIONS:
            print("left out: %s (%s)" % (path.name, EXCEPTIONS[path.name]))
        elif json.loads((path / "case.json").read_text())["dim"] == 3:
            chosen.append(path)
    check("there are cases", len(chosen) > 0, str(len(chosen)))
    # two at a time
    command = [sys.executable, CASES / "run_case.py", "--kerfem", kerfem]
    halves = [subprocess.Popen([*command, "--out", folder / ("cases%d" % k), *chosen[k::2]], stdout=subprocess.PIPE, text=True)
              for k in range(2)]
    said = [h.communicate()[0] for h in halves]
    print("".join(said), end="")
    passed = sum(line.startswith("PASS") for text in said for line in text.splitlines())
    check("all cases pass", passed == len(chosen) and all(h.returncode == 0 for h in halves), "%d of %d" % (passed, len(chosen)))


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("kerfem", type=lambda p: str(Path(p).resolve()))
    parser.add_argument("--out", type=Path, help="folder for the results (default: a temporary one)")
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as temporary:
        folder = (arguments.out or Path(temporary)).resolve()
        folder.mkdir(parents=True, exist_ok=True)
        kerfem = arguments.kerfem
        try:
            run(kerfem, "run", HERE / "scenes" / "results.toml", "-o", folder / "results", "--verify", "--export-system", "--quiet")
            check_report(folder / "results")
            check_frames(folder / "results")
            check_surface(folder / "results", "results", 4)
            read_back(folder / "results")
            check_planar(kerfem, folder / "planar")
            check_system(folder / "results", DT)
            run(kerfem, "run", HERE / "references" / "cut_plane.toml", "-o", folder / "cut_plane", "--verify", "--export-system", "--quiet")
            check_system(folder / "cut_plane", None)
            check_order_2(kerfem, folder / "order2")
            check_command(kerfem, folder)
            check_threads(kerfem, folder)
            check_cases(kerfem, folder)
        except Failed as failed:
            print(failed, file=sys.stderr)
            return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
