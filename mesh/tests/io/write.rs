//! Files of our own.

use kerfem_mesh::io::{self, VtuArray, VtuCells, VtuGrid};
use kerfem_mesh::{Point, generate};

#[test]
fn what_is_written_is_read_back_to_the_bit() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("a.vtu");
    // large enough for several compressed blocks
    let mesh = generate::box_tets([0.3, 0.1, 0.7], [17, 30, 23], [1e-9, -0.1, 1.0 / 3.0]);
    let mut grid = VtuGrid::from_tet_mesh(&mesh);
    let (n, m) = (mesh.num_vertices(), mesh.num_cells());
    let velocity: Vec<Point> = mesh
        .rest_positions()
        .iter()
        .map(|p| p.map(|c| (1e3 * c).sin()))
        .collect();
    let strain: Vec<f64> = (0..9 * m).map(|k| (k as f64).sqrt()).collect();
    grid.point_arrays.push(VtuArray::vectors("velocity", &velocity));
    grid.point_arrays
        .push(VtuArray::integers("vertex_id", (0..n as i64).rev().collect::<Vec<_>>()));
    grid.cell_arrays
        .push(VtuArray::reals("strain & <stress>", 9, strain.as_slice()));
    io::write_vtu(&path, &grid).unwrap();
    let read = io::read_mesh(&path).unwrap();
    assert_eq!(
        read.point_arrays["velocity"].values,
        velocity.iter().flat_map(|p| [p.x, p.y, p.z]).collect::<Vec<_>>()
    );
    assert_eq!(read.point_arrays["vertex_id"].values[0], (n - 1) as f64);
    assert_eq!(read.cell_arrays["strain & <stress>"].components, 9);
    assert_eq!(read.cell_arrays["strain & <stress>"].values, strain);
    assert_eq!(read.into_tet_mesh().unwrap(), mesh);
    let size = std::fs::metadata(&path).unwrap().len() as usize;
    assert!(
        size < 8 * (3 * n + 3 * n + n + 9 * m + 4 * m + m),
        "{size} bytes: not compressed"
    );
    io::write_vtu(dir.path().join("b.vtu"), &grid).unwrap();
    assert_eq!(
        std::fs::read(&path).unwrap(),
        std::fs::read(dir.path().join("b.vtu")).unwrap(),
        "not deterministic"
    );
}

#[test]
fn triangles_and_empty_grids_are_written() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("a.vtu");
    let points = vec![Point::zeros(), Point::x(), Point::y(), Point::new(7.0, 7.0, 7.0)];
    let mut grid = VtuGrid {
        points: points.clone().into(),
        cells: VtuCells::Triangles(vec![[0, 1, 2]].into()),
        point_arrays: vec![],
        cell_arrays: vec![VtuArray::integers("region", vec![-3])],
    };
    io::write_vtu(&path, &grid).unwrap();
    let read = io::read_mesh(&path).unwrap();
    assert_eq!((&read.points, &read.triangles), (&points, &vec![[0, 1, 2]]));
    assert_eq!(read.cell_arrays["region"].values, [-3.0]);
    assert_eq!(io::read_sweep(&path).unwrap().triangles, [[0, 1, 2]]);
    grid.cells = VtuCells::Tets(vec![].into());
    grid.cell_arrays.clear();
    io::write_vtu(&path, &grid).unwrap();
    let mesh = io::read_mesh(&path).unwrap().into_tet_mesh().unwrap();
    assert_eq!((mesh.num_vertices(), mesh.num_cells()), (4, 0));
}

#[test]
fn surfaces_and_lines_are_written_as_vtp() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("a.vtp");
    let cap = generate::cap_triangles([0.0, 0.0, 1.0], 2.0, 1.0, 3).unwrap();
    let mut grid = VtuGrid::from_tri_mesh(&cap);
    let heights: Vec<f64> = cap.rest_positions().iter().map(|p| p.z).collect();
    grid.point_arrays.push(VtuArray::reals("height", 1, heights.clone()));
    io::write_vtp(&path, &grid).unwrap();
    let read = io::read_mesh(&path).unwrap();
    assert_eq!(read.point_arrays["height"].values, heights);
    assert_eq!(read.into_tri_mesh().unwrap(), cap);

    grid.cells = VtuCells::Lines(vec![[0, 1], [5, 2]].into());
    io::write_vtp(dir.path().join("b.vtp"), &grid).unwrap();
    io::write_vtu(dir.path().join("b.vtu"), &grid).unwrap();
    for name in ["b.vtp", "b.vtu"] {
        let path = dir.path().join(name);
        let read = io::read_mesh(&path).unwrap();
        assert_eq!(
            (read.points.len(), &read.segments),
            (37, &vec![[0, 1], [5, 2]]),
            "{name}"
        );
        assert_eq!(io::read_sweep(&path).unwrap().segments, [[0, 1], [5, 2]], "{name}");
    }
    let solid = VtuGrid::from_tet_mesh(&generate::box_tets([1.0; 3], [1; 3], [0.0; 3]));
    let refused = io::write_vtp(dir.path().join("c.vtp"), &solid).unwrap_err().to_string();
    assert!(
        refused.ends_with("c.vtp: array 'connectivity': a surface is made of triangles or lines"),
        "{refused}"
    );
}

#[test]
fn arrays_that_do_not_fit_are_refused() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("a.vtu");
    let mesh = generate::box_tets([1.0; 3], [1; 3], [0.0; 3]);
    let mut grid = VtuGrid::from_tet_mesh(&mesh);
    grid.point_arrays.push(VtuArray::reals("u", 3, vec![0.0; 8]));
    let text = io::write_vtu(&path, &grid).unwrap_err().to_string();
    assert!(
        text.ends_with("a.vtu: array 'u': has 8 numbers for 8 points of 3 components"),
        "{text}"
    );
    grid.point_arrays[0] = VtuArray::reals("u", 1, vec![0.0; 8]);
    grid.point_arrays.push(VtuArray::reals("u", 1, vec![0.0; 8]));
    assert!(
        io::write_vtu(&path, &grid)
            .unwrap_err()
            .to_string()
            .contains("occurs twice")
    );
    grid.point_arrays.clear();
    grid.cells = VtuCells::Tets(vec![[0, 1, 2, 8]].into());
    assert!(
        io::write_vtu(&path, &grid)
            .unwrap_err()
            .to_string()
            .contains("names point 8, but there are 8")
    );
    assert!(!path.exists());
}
