//! What can go wrong, with the place and the numbers.

/// Errors of this crate.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum FemError {
    /// Young's modulus is out of range.
    #[error("young = {0} Pa is not accepted: it must be finite and greater than 0")]
    Young(f64),
    /// Poisson's ratio is out of range.
    #[error(
        "poisson = {0} is not accepted: it must be greater than -1 and less than 0.5 (0.5, incompressible, is not possible)"
    )]
    Poisson(f64),
    /// The density is out of range.
    #[error("density = {0} kg/m3 is not accepted: it must be finite and greater than 0")]
    Density(f64),
    /// The thickness of a planar body is out of range.
    #[error("thickness = {0} m is not accepted: it must be finite and greater than 0")]
    Thickness(f64),
    /// A mesh of triangles that does not lie in the plane z = 0.
    #[error("a surface in space has no mechanics; accepted: tetrahedra, and triangles in the plane z = 0")]
    NotPlanar,
    /// A cell has no positive rest volume.
    #[error("cell {cell} is inverted or degenerate at rest: its volume is {volume:e} m3, it must be positive")]
    InvertedCell {
        /// Slot of the cell.
        cell: u32,
        /// Its signed volume (m³).
        volume: f64,
    },
    /// A change names a parent cell that the assembler has never seen.
    #[error("cell {cell} should inherit the material of cell {parent}, which is not known here")]
    UnknownParent {
        /// Slot of the new cell.
        cell: u32,
        /// Slot of the parent.
        parent: u32,
    },
    /// More neighbours around one vertex than a row can number.
    #[error("vertex {vertex} has {count} neighbours; at most 65535 are supported")]
    TooManyNeighbors {
        /// Slot of the vertex.
        vertex: u32,
        /// How many there are.
        count: usize,
    },
    /// A vector has the wrong length.
    #[error("{what} has {found} entries where {expected} are needed")]
    Length {
        /// Which vector.
        what: &'static str,
        /// The length needed.
        expected: usize,
        /// The length given.
        found: usize,
    },
    /// A number is NaN or infinite.
    #[error("{what} is not finite at entry {index}")]
    NotFinite {
        /// Where it was found.
        what: &'static str,
        /// Its entry (dof).
        index: usize,
    },
    /// The matrix is not positive definite on the free dofs.
    #[error(
        "the matrix is not positive definite ({found_by}): is a free piece without supports, or a material unstable?"
    )]
    NotPositiveDefinite {
        /// Which method noticed.
        found_by: &'static str,
    },
    /// A factorisation needs more memory than there is.
    #[error("the factorisation of {dofs} unknowns ran out of memory")]
    OutOfMemory {
        /// Number of free dofs.
        dofs: usize,
    },
}
