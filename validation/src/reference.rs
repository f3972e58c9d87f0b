//! Solutions that scikit-fem found.

use std::path::PathBuf;

use kerfem_fem::{FemError, Material};
use kerfem_mesh::{TetMesh, io};

use crate::ValidationError;

/// Young's modulus of every reference (Pa).
pub const YOUNG: f64 = 1e7;
/// Poisson's ratio of every reference.
pub const POISSON: f64 = 0.3;
/// Density of every reference (kg/m³).
pub const DENSITY: f64 = 1000.0;

/// A static solution of linear elasticity on tetrahedra of order 1, and its data. Nodal fields are flat, 3 a vertex, in the
/// order of the mesh.
#[derive(Clone, Debug)]
pub struct Reference {
    /// The mesh it was found on.
    pub mesh: TetMesh,
    /// Displacement (m).
    pub displacement: Vec<f64>,
    /// Which dofs were prescribed, at the values in `displacement`.
    pub fixed: Vec<bool>,
    /// External nodal forces (N), as scikit-fem integrated them.
    pub load: Vec<f64>,
}

impl Reference {
    /// Reads `references/NAME.vtu`.
    ///
    /// # Errors
    /// [`ValidationError`] if the file or one of its arrays is missing or damaged.
    pub fn read(name: &str) -> Result<Self, ValidationError> {
        let path = reference_file(&format!("{name}.vtu"));
        let data = io::read_mesh(&path)?;
        let array = |name: &'static str| match data.point_arrays.get(name) {
            Some(a) if a.components == 3 => Ok(a.values.clone()),
            _ => Err(ValidationError::Array {
                path: path.clone(),
                array: name,
            }),
        };
        let (displacement, load) = (array("displacement")?, array("load")?);
        let fixed = array("fixed")?.iter().map(|&f| f != 0.0).collect();
        let mesh = data
            .into_tet_mesh()
            .map_err(|problem| ValidationError::Mesh { path, problem })?;
        Ok(Reference {
            mesh,
            displacement,
            fixed,
            load,
        })
    }

    /// The material of every reference.
    ///
    /// # Errors
    /// None for the constants above.
    pub fn material() -> Result<Material, FemError> {
        Material::new(YOUNG, POISSON, DENSITY)
    }
}

/// Path of a file in `validation/references`.
pub fn reference_file(name: &str) -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("references").join(name)
}
