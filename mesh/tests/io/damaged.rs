//! Damaged files: an error or a valid mesh, never a panic, and no more memory than the bytes there are can ask for.

use std::path::Path;

use kerfem_mesh::io::{self, IoError, MeshData};

use crate::mutate::{Random, WILD};
use crate::shared::sample;

/// Reads damaged bytes under the name of a format; what is accepted must be sound.
pub(crate) fn read(directory: &Path, extension: &str, bytes: &[u8]) -> Result<(), IoError> {
    let path = directory.join("damaged").with_extension(extension);
    std::fs::write(&path, bytes).unwrap();
    if ["obj", "stl", "vtp"].contains(&extension) {
        let sweep = io::read_sweep(&path)?;
        assert!(sweep.points.iter().all(|p| p.iter().all(|c| c.is_finite())));
        assert!(sweep.triangles.iter().flatten().all(|&v| v < sweep.points.len()));
        assert!(sweep.segments.iter().flatten().all(|&v| v < sweep.points.len()));
        return Ok(());
    }
    // TetGen's other file is whole
    for (own, other) in [("node", "ele"), ("ele", "node")] {
        if extension == own {
            std::fs::copy(sample("meshio").with_extension(other), path.with_extension(other)).unwrap();
        }
    }
    let mesh = io::read_mesh(&path)?;
    check(&mesh);
    let _ = mesh.clone().into_tri_mesh();
    let _ = mesh.into_tet_mesh();
    Ok(())
}

/// Whether a file of this kind may stop early and still be whole: nothing in it says where it ends.
fn has_no_end(extension: &str) -> bool {
    ["obj", "vtk", "node", "ele"].contains(&extension)
}

fn check(mesh: &MeshData) {
    assert!(mesh.points.iter().all(|p| p.iter().all(|c| c.is_finite())));
    let n = mesh.points.len();
    assert!(
        mesh.tets
            .iter()
            .flatten()
            .chain(mesh.triangles.iter().flatten())
            .chain(mesh.segments.iter().flatten())
            .all(|&v| v < n)
    );
    assert!(mesh.point_arrays.values().all(|a| a.values.len() == n * a.components));
    let m = mesh.tets.len() + mesh.triangles.len() + mesh.segments.len();
    assert!(mesh.cell_arrays.values().all(|a| a.values.len() == m * a.components));
    for group in mesh.groups.values() {
        assert!(group.vertices.iter().all(|&v| v < n) && group.vertices.is_sorted());
        assert!(group.tets.iter().all(|&t| t < mesh.tets.len()));
        assert!(group.triangles.iter().all(|&t| t < mesh.triangles.len()));
    }
}

/// Names, extensions and bytes of all samples.
pub(crate) fn samples() -> Vec<(String, String, Vec<u8>)> {
    let mut samples: Vec<_> = std::fs::read_dir(sample(""))
        .unwrap()
        .map(|file| {
            let path = file.unwrap().path();
            let part = |p: Option<&std::ffi::OsStr>| p.unwrap().to_string_lossy().into_owned();
            (
                part(path.file_name()),
                part(path.extension()),
                std::fs::read(&path).unwrap(),
            )
        })
        .collect();
    let obj = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0.5\nvn 0 0 1\nf 1//1 2//1 3//1 4//1\nf -4 -3 -2\n";
    samples.push(("a.obj".into(), "obj".into(), obj.into()));
    samples.sort();
    samples
}

/// How often a sample is damaged: an LZMA decoder takes megabytes for each block, and these have many.
fn tries(name: &str, most: usize) -> usize {
    if name.contains("lzma") { most / 20 } else { most / 4 }
}

#[test]
fn a_truncated_file_is_an_error() {
    let dir = tempfile::tempdir().unwrap();
    for (name, extension, bytes) in samples() {
        let whole = bytes.trim_ascii_end().len();
        let step = (whole / tries(&name, 400)).max(1);
        for end in (0..whole).step_by(step).chain(whole - 1..whole) {
            let result = read(dir.path(), &extension, &bytes[..end]);
            assert!(
                result.is_err() || has_no_end(&extension),
                "{name}: {end} of {whole} bytes are read as a mesh"
            );
            if let Err(error) = result {
                assert!(!error.to_string().contains('\n'), "{error}");
            }
        }
    }
}

#[test]
fn flipped_bytes_are_an_error_or_a_valid_mesh() {
    let dir = tempfile::tempdir().unwrap();
    let mut random = Random(0x9e37_79b9_7f4a_7c15);
    for (name, extension, bytes) in samples() {
        for _ in 0..tries(&name, 400) {
            let mut damaged = bytes.clone();
            for _ in 0..1 + random.below(3) {
                let at = random.below(damaged.len());
                damaged[at] ^= 1 << random.below(8);
            }
            if let Err(error) = read(dir.path(), &extension, &damaged) {
                assert!(!error.to_string().contains('\n'), "{error}");
            }
        }
    }
}

#[test]
fn words_replaced_by_wild_numbers_are_an_error_or_a_valid_mesh() {
    let dir = tempfile::tempdir().unwrap();
    let mut random = Random(0x2545_f491_4f6c_dd1d);
    for (name, extension, bytes) in samples() {
        let digits: Vec<usize> = (0..bytes.len()).filter(|&i| bytes[i].is_ascii_digit()).collect();
        if digits.is_empty() {
            continue;
        }
        for _ in 0..tries(&name, 200) {
            let start = digits[random.below(digits.len())];
            let length = bytes[start..]
                .iter()
                .take_while(|b| b.is_ascii_alphanumeric() || **b == b'.')
                .count();
            let wild = WILD[random.below(WILD.len())];
            let damaged = [&bytes[..start], wild.as_bytes(), &bytes[start + length..]].concat();
            let _ = read(dir.path(), &extension, &damaged);
        }
    }
}

fn message(extension: &str, text: &str) -> String {
    let dir = tempfile::tempdir().unwrap();
    let error = read(dir.path(), extension, text.as_bytes()).unwrap_err().to_string();
    error.split_once("damaged.").unwrap().1.to_string()
}

#[test]
fn messages_name_place_fault_and_what_is_accepted() {
    let nodes = "$NOD\n4\n1 0 0 0\n2 1 0 0\n5 0 1 0\n9 0 0 1\n$ENDNOD\n";
    for (text, expected) in [
        ("", "msh: line 1: the file is empty; gmsh 1"),
        (
            "$NOD\n-4\n",
            "msh: line 2, $NOD: the number of nodes is -4; zero or more is accepted",
        ),
        (
            "$NOD\n400000000000\n1 0 0 0\n",
            "msh: line 2, $NOD: the number of nodes is 400000000000, but only 9 bytes follow",
        ),
        (
            "$NOD\n1\n1 0 nan 0\n",
            "msh: line 3, $NOD: y is NaN; a finite number is accepted",
        ),
        ("$NOD\n2\n1 0 0 0\n1 0 0 1\n", "msh: line 4, $NOD: node 1 occurs twice"),
    ] {
        assert!(message("msh", text).starts_with(expected), "{}", message("msh", text));
    }
    for (elements, expected) in [
        (
            "1\n1 4 0 0 4 1 2 5 8\n",
            "msh: line 10, $ELM: an element names node 8, which does not exist",
        ),
        (
            "1\n1 4 0 0 3 1 2 5\n",
            "msh: line 10, $ELM: an element of 4 nodes is said to have 3",
        ),
        (
            "1\n1 5 0 0 8 1 2 5 9 1 2 5 9\n",
            "msh: line 10, $ELM: a hexahedron (gmsh element type 5); tetrahedra",
        ),
        (
            "2\n1 4 0 0 4 1 2 5 9\n$ENDELM\n",
            "msh: line 11, $ELM: an element number is '$ENDELM'; a whole number",
        ),
        (
            "0\n1 4 0 0 4 1 2 5 9\n$ENDELM\n",
            "msh: line 10, $ELM: found '1' where $ENDELM should follow",
        ),
    ] {
        let text = message("msh", &format!("{nodes}$ELM\n{elements}"));
        assert!(text.starts_with(expected), "{text}");
    }
}

#[test]
fn messages_on_vtu_name_section_and_array() {
    let vtu = |points: &str, ends: &str, kinds: &str| {
        format!(
            "<VTKFile type='UnstructuredGrid' byte_order='LittleEndian'><UnstructuredGrid>\
             <Piece NumberOfPoints='4' NumberOfCells='1'>\
             <Points><DataArray type='Float64' NumberOfComponents='3' format='ascii'>{points}</DataArray></Points><Cells>\
             <DataArray type='Int64' Name='connectivity' format='ascii'>0 1 2 3</DataArray>\
             <DataArray type='Int64' Name='offsets' format='ascii'>{ends}</DataArray>\
             <DataArray type='UInt8' Name='types' format='ascii'>{kinds}</DataArray>\
             </Cells></Piece></UnstructuredGrid></VTKFile>"
        )
    };
    let good = "0 0 0 1 0 0 0 1 0 0 0 1";
    let dir = tempfile::tempdir().unwrap();
    read(dir.path(), "vtu", vtu(good, "4", "10").as_bytes()).unwrap();
    let oversized = vtu(good, "4", "10").replace("NumberOfPoints='4'", "NumberOfPoints='6148914691236517206'");
    for (text, expected) in [
        (
            vtu("0 0", "4", "10"),
            "vtu: <Piece>, <Points>, array '': has 2 numbers where 12 are announced",
        ),
        (
            vtu("0 0 a", "4", "10"),
            "vtu: <Piece>, <Points>, array '': 'a'; a number is accepted",
        ),
        (
            vtu("0 0 0 1 0 0 0 1 0 0 0 inf", "4", "10"),
            "vtu: point 3 (from zero): (0, 0, inf) is not finite",
        ),
        (
            vtu(good, "5", "10"),
            "vtu: <Piece>, <Cells>, array 'connectivity': has 4 numbers where 5 are announced",
        ),
        (
            vtu(good, "-4", "10"),
            "vtu: <Piece>, <Cells>, array 'offsets': must be zero or more",
        ),
        (
            vtu(good, "4", "5"),
            "vtu: cell 0 (from zero): is a triangle with 4 corners; 3 are accepted",
        ),
        (
            vtu(good, "4", "9"),
            "vtu: cell 0 (from zero): is a quadrilateral (VTK cell type 9); tetrahedra",
        ),
        (
            vtu(good, "4", "14"),
            "vtu: cell 0 (from zero): is a pyramid (VTK cell type 14); tetrahedra",
        ),
        (
            oversized,
            "vtu: <Piece>, <Points>, array '': 6148914691236517206 rows of 3 numbers are announced",
        ),
        (
            vtu(good, "4", "10").replace("'Float64'", "'Float16'"),
            "vtu: <Piece>, <Points>, array '': type 'Float16'; Fl",
        ),
        (
            vtu(good, "4", "10").replace("<Cells>", "<Cell>"),
            "vtu: line 1: is not XML that can be read",
        ),
    ] {
        assert!(message("vtu", &text).starts_with(expected), "{}", message("vtu", &text));
    }
}
