//! `cut_meshes NAME OUT.vtu`: writes the mesh that a cut leaves, for `make_references.py` to solve on.

use std::process::ExitCode;

use kerfem_mesh::io::{self, VtuGrid};
use kerfem_validation::{ValidationError, cut_beam};

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [name, out] = arguments.as_slice() else {
        eprintln!(
            "usage: cut_meshes NAME OUT.vtu, with NAME one of {}",
            cut_beam::NAMES.join(", ")
        );
        return ExitCode::from(2);
    };
    match write(name, out) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("{error}");
            ExitCode::from(2)
        }
    }
}

fn write(name: &str, out: &str) -> Result<(), ValidationError> {
    let mut mesh = cut_beam::beam();
    cut_beam::cut_by(&mut mesh, name)?;
    Ok(io::write_vtu(out, &VtuGrid::from_tet_mesh(&mesh))?)
}
