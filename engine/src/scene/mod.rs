//! The scene: what a `SCENE.toml` says, read and checked.

pub(crate) mod check;
mod plane;
pub(crate) mod source;
mod values;

#[cfg(test)]
mod reference;
#[cfg(test)]
mod tests;

use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use crate::{EngineError, Expression};
use source::Source;
use values::exactly;
pub use values::{BladePath, Components, Condition, Field, InitialField, NodalForces};

/// A scene as its file says it, checked as far as that is possible without the mesh.
///
/// SI units; indices count from zero in the order of the mesh file. Read one with [`Scene::read`] or [`Scene::parse`].
#[derive(Clone, Debug, Deserialize, Serialize, PartialEq)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct Scene {
    /// Names the results.
    pub name: String,
    /// Where the mesh comes from.
    pub mesh: MeshSpec,
    /// The material, where no region says otherwise.
    pub material: MaterialSpec,
    /// Parts of another material; a later one wins.
    #[serde(default)]
    pub region: Vec<RegionSpec>,
    /// Kinematics and elements.
    #[serde(default)]
    pub model: ModelSpec,
    /// Prescribed displacements; a later one wins.
    #[serde(default)]
    pub fixed: Vec<FixedSpec>,
    /// Loads; they add up.
    #[serde(default)]
    pub load: Vec<LoadSpec>,
    /// State at the start.
    #[serde(default)]
    pub initial: InitialSpec,
    /// Scheme and clock.
    #[serde(default)]
    pub time: TimeSpec,
    /// Linear solver and tolerances.
    #[serde(default)]
    pub solver: SolverSpec,
    /// Cuts, in any order of time.
    #[serde(default)]
    pub cut: Vec<CutSpec>,
    /// Time series at points.
    #[serde(default)]
    pub probe: Vec<ProbeSpec>,
    /// Single numbers of the last state.
    #[serde(default)]
    pub quantity: Vec<QuantitySpec>,
    /// What is written.
    #[serde(default)]
    pub output: OutputSpec,
    #[serde(skip)]
    pub(crate) source: Source,
}

/// Where the mesh comes from: exactly one of `file`, `box`, `ball`, `cylinder`, `plate`.
#[derive(Clone, Debug, Default, Deserialize, Serialize, PartialEq)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields, default)]
pub struct MeshSpec {
    /// A mesh file, relative to the scene: tetrahedra, or triangles with z = 0.
    pub file: Option<PathBuf>,
    /// A box of tetrahedra.
    pub r#box: Option<BoxSpec>,
    /// A ball of tetrahedra.
    pub ball: Option<BallSpec>,
    /// A cylinder of tetrahedra.
    pub cylinder: Option<CylinderSpec>,
    /// A rectangle of triangles in the plane.
    #[serde(alias = "plate2d")]
    pub plate: Option<PlateSpec>,
    /// Factor on all coordinates (default 1). Conditions and points of the scene, and sweeps, are in metres: after it.
    pub scale: Option<f64>,
}

/// A box of `cells` hexahedra, six tetrahedra each.
#[derive(Clone, Debug, Deserialize, Serialize, PartialEq)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct BoxSpec {
    /// Side lengths (m).
    #[serde(deserialize_with = "exactly")]
    pub size: [f64; 3],
    /// Hexahedra along each side.
    #[serde(deserialize_with = "exactly")]
    pub cells: [usize; 3],
    /// The corner with the smallest coordinates (m).
    #[serde(default, deserialize_with = "exactly")]
    pub origin: [f64; 3],
}

/// A rectangle of `cells` smaller ones, two triangles each, in the plane z = 0.
#[derive(Clone, Debug, Deserialize, Serialize, PartialEq)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct PlateSpec {
    /// Side lengths (m).
    #[serde(deserialize_with = "exactly")]
    pub size: [f64; 2],
    /// Rectangles along each side.
    #[serde(deserialize_with = "exactly")]
    pub cells: [usize; 2],
    /// The corner with the smallest coordinates (m).
    #[serde(default, deserialize_with = "exactly")]
    pub origin: [f64; 2],
}

/// A ball of `20 layers³` tetrahedra.
#[derive(Clone, Debug, Deserialize, Serialize, PartialEq)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct BallSpec {
    /// Radius (m).
    pub radius: f64,
    /// Shells of tetrahedra from the centre to the surface.
    pub layers: usize,
    /// Centre (m).
    #[serde(default, deserialize_with = "exactly")]
    pub center: [f64; 3],
}

/// A cylinder of `18 layers² slices` tetrahedra. Good cells have about the same size both ways: `length / slices` about
/// `radius / layers`.
#[derive(Clone, Debug, Deserialize, Serialize, PartialEq)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct CylinderSpec {
    /// Radius (m).
    pub radius: f64,
    /// Length (m).
    pub length: f64,
    /// Rings of cells from the axis to the surface.
    pub layers: usize,
    /// Slices of cells along the axis.
    pub slices: usize,
    /// Direction of the axis, of any length.
    #[serde(default = "default_axis", deserialize_with = "exactly")]
    pub axis: [f64; 3],
    /// The centre of the end where the axis begins (m).
    #[serde(default, deserialize_with = "exactly")]
    pub origin: [f64; 3],
}

fn default_axis() -> [f64; 3] {
    [0.0, 0.0, 1.0]
}

/// Isotropic material.
#[derive(Clone, Debug, Deserialize, Serialize, PartialEq)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct MaterialSpec {
    /// Young's modulus (Pa).
    pub young: f64,
    /// Poisson's ratio.
    pub poisson: f64,
    /// Density at rest (kg/m³).
    pub density: f64,
    /// Rayleigh damping.
    #[serde(default)]
    pub damping: DampingSpec,
    /// Planar meshes: what happens along z (default "strain").
    pub plane: Option<PlaneName>,
    /// Planar meshes: extent along z (m, default 1).
    pub thickness: Option<f64>,
}

/// What a planar body does along z.
#[derive(Clone, Copy, Debug, Default, Deserialize, Serialize, PartialEq, Eq)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "kebab-case")]
pub enum PlaneName {
    /// No strain along z: a slice of a long body.
    #[default]
    Strain,
    /// No stress along z: a thin sheet.
    Stress,
}

impl From<PlaneName> for kerfem_fem::Plane {
    fn from(name: PlaneName) -> Self {
        match name {
            PlaneName::Strain => kerfem_fem::Plane::Strain,
            PlaneName::Stress => kerfem_fem::Plane::Stress,
        }
    }
}

/// Rayleigh damping: the force `-(mass M + stiffness K) v`, in schemes that step. Of a corotated body `K` turns with its cells,
/// so that turning is not damped.
#[derive(Clone, Copy, Debug, Default, Deserialize, Serialize, PartialEq)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields, default)]
pub struct DampingSpec {
    /// Factor of the mass matrix (1/s).
    pub mass: f64,
    /// Factor of the stiffness matrix (s).
    pub stiffness: f64,
}

/// Another material for some cells: exactly one of `group`, `where`.
#[derive(Clone, Debug, Default, Deserialize, Serialize, PartialEq)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields, default)]
pub struct RegionSpec {
    /// A named set of the mesh file.
    pub group: Option<String>,
    /// A condition on the centroids of cells.
    pub r#where: Option<Condition>,
    /// Young's modulus (Pa), if it differs.
    pub young: Option<f64>,
    /// Poisson's ratio, if it differs.
    pub poisson: Option<f64>,
    /// Density (kg/m³), if it differs.
    pub density: Option<f64>,
}

/// Kinematics and elements.
#[derive(Clone, Debug, Deserialize, Serialize, PartialEq)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields, default)]
pub struct ModelSpec {
    /// Small or large rotations.
    pub kind: ModelKind,
    /// How mass is spread.
    pub mass: MassKind,
    /// Order of the elements: 1, or 2 with a node in the middle of each edge. A set of vertices given one by one or as a group holds
    /// the middle of an edge if it holds both ends; between the vertices of two sets given one by one it follows the mean of the
    /// ends, on the boundary of the body.
    pub order: u32,
    /// Cure of volumetric locking: "none"; "nodal", strains averaged at the vertices, for all materials; "auto", for those with a
    /// Poisson's ratio above 0.45.
    pub locking: String,
    /// Relative error that is wanted; what is chosen by "auto" may use it.
    pub accuracy: f64,
}

impl Default for ModelSpec {
    fn default() -> Self {
        ModelSpec {
            kind: ModelKind::Auto,
            mass: MassKind::Lumped,
            order: 1,
            locking: "auto".into(),
            accuracy: 0.01,
        }
    }
}

/// Kinematics of the elements.
#[derive(Clone, Copy, Debug, Deserialize, Serialize, PartialEq, Eq)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "kebab-case")]
pub enum ModelKind {
    /// Small strains and rotations.
    Linear,
    /// Small strains, any rotation.
    Corotated,
    /// Left to the engine.
    Auto,
}

/// How mass is spread over the vertices.
#[derive(Clone, Copy, Debug, Deserialize, Serialize, PartialEq, Eq)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "kebab-case")]
pub enum MassKind {
    /// A quarter of each cell to each corner.
    Lumped,
    /// The integral of products of shape functions.
    Consistent,
}

/// A prescribed displacement on exactly one of `where`, `vertices`, `group`. Where two disagree the later one wins, and a
/// warning says so.
#[derive(Clone, Debug, Default, Deserialize, Serialize, PartialEq)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields, default)]
pub struct FixedSpec {
    /// Vertices whose rest position satisfies this.
    pub r#where: Option<Condition>,
    /// Vertices by index.
    pub vertices: Option<Vec<usize>>,
    /// A named set of the mesh file.
    pub group: Option<String>,
    /// Which components are prescribed (default "xyz", planar "xy").
    pub axes: Option<String>,
    /// Their values (m), one an axis of `axes` or all of them; default zero.
    pub displacement: Option<Vec<Expression>>,
}

/// A load: exactly one of `gravity`, `traction`, `pressure`, `force`, `nodal`.
#[derive(Clone, Debug, Default, Deserialize, Serialize, PartialEq)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields, default)]
pub struct LoadSpec {
    /// Acceleration of the whole body (m/s²); expressions in `t`.
    pub gravity: Option<Components<Expression>>,
    /// Force per rest area (Pa) on facets; expressions in `x, y, z, t`. On the edges of a planar mesh the area is length times
    /// thickness.
    pub traction: Option<Components<Expression>>,
    /// Pressure (Pa) along the inward rest normal of facets; an expression in `x, y, z, t`.
    pub pressure: Option<Expression>,
    /// The total force (N), shared equally by vertices; expressions in `t`.
    pub force: Option<Components<Expression>>,
    /// A force (N) for each of `vertices`, which add up where one is listed twice; or for all vertices, from a file.
    pub nodal: Option<NodalForces>,
    /// Boundary facets whose vertices all satisfy this; for a force: vertices.
    pub r#where: Option<Condition>,
    /// Boundary facets by their vertices: three each, two for the edges of a planar mesh.
    pub facets: Option<Vec<Vec<usize>>>,
    /// Boundary facets whose vertices are all listed; for a force, or forces one by one: vertices.
    pub vertices: Option<Vec<usize>>,
    /// A named set of the mesh file, as vertices or facets.
    pub group: Option<String>,
}

/// State at the start; zero where nothing is said.
#[derive(Clone, Debug, Default, Deserialize, Serialize, PartialEq)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields, default)]
pub struct InitialSpec {
    /// Displacement (m).
    pub displacement: Option<InitialField>,
    /// Velocity (m/s).
    pub velocity: Option<InitialField>,
}

/// Scheme and clock.
#[derive(Clone, Debug, Default, Deserialize, Serialize, PartialEq)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields, default)]
pub struct TimeSpec {
    /// How time is treated.
    pub scheme: Scheme,
    /// Time step (s); needed by schemes that step.
    pub dt: Option<f64>,
    /// Time of the end (s); needed by schemes that step. For statics the time that formulas in `t` are taken at (default 0).
    pub end: Option<f64>,
    /// How far each step is solved.
    pub nonlinear: Nonlinear,
}

/// How time is treated.
#[derive(Clone, Copy, Debug, Default, Deserialize, Serialize, PartialEq, Eq)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "kebab-case")]
pub enum Scheme {
    /// Equilibrium, no inertia; cuts are done first.
    #[default]
    Static,
    /// The initial state with the cuts applied; nothing is solved.
    Evaluate,
    /// First order, damps.
    BackwardEuler,
    /// Second order, keeps momenta.
    Midpoint,
    /// Average acceleration (beta 1/4, gamma 1/2): second order, keeps linear momentum, and of a linear body the energy.
    Newmark,
    /// Two-step backward differences: second order, damps what the step does not resolve. Starts, and starts anew after each
    /// change by a cut, with a step of backward Euler.
    Bdf2,
    /// Explicit, lumped mass: second order, keeps momenta. A step longer than what is stable is made of several.
    CentralDifference,
}

impl Scheme {
    /// Whether it goes from one time to the next by steps of `dt`.
    pub(crate) fn steps(self) -> bool {
        !matches!(self, Scheme::Static | Scheme::Evaluate)
    }
}

/// How far each implicit step is solved.
#[derive(Clone, Copy, Debug, Default, Deserialize, Serialize, PartialEq, Eq)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "kebab-case")]
pub enum Nonlinear {
    /// To the tolerance of the solver.
    #[default]
    Newton,
    /// One linear solve with the warped stiffness.
    OneStep,
}

/// Linear solver and tolerances.
#[derive(Clone, Debug, Deserialize, Serialize, PartialEq)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields, default)]
pub struct SolverSpec {
    /// Direct or iterative.
    pub kind: SolverName,
    /// Preconditioner of the iterative solver.
    pub preconditioner: PreconditionerName,
    /// Relative residual.
    pub tolerance: f64,
    /// Iterations of one linear solve, for each piece of a body.
    pub max_iterations: usize,
}

impl Default for SolverSpec {
    fn default() -> Self {
        SolverSpec {
            kind: SolverName::Auto,
            preconditioner: PreconditionerName::Auto,
            tolerance: 1e-8,
            max_iterations: 2000,
        }
    }
}

/// Direct or iterative.
#[derive(Clone, Copy, Debug, Deserialize, Serialize, PartialEq, Eq)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "kebab-case")]
pub enum SolverName {
    /// Conjugate gradients.
    Cg,
    /// Sparse Cholesky factors.
    Cholesky,
    /// By size and scheme.
    Auto,
}

/// Preconditioner of conjugate gradients.
#[derive(Clone, Copy, Debug, Deserialize, Serialize, PartialEq, Eq)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "kebab-case")]
pub enum PreconditionerName {
    /// None.
    None,
    /// The diagonal.
    Jacobi,
    /// The 3x3 blocks of the diagonal.
    BlockJacobi,
    /// Incomplete Cholesky factors in the pattern of the matrix.
    BlockIc0,
    /// Smoothed aggregation multigrid: iterations that hardly depend on the size of the mesh.
    Multigrid,
    /// Left to the engine.
    Auto,
}

/// A cut: by exactly one of `sweep`, `blade`.
#[derive(Clone, Debug, Deserialize, Serialize, PartialEq)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct CutSpec {
    /// When a sweep cuts (s, default 0): before the first step that begins then or later. In statics all cuts are made first.
    pub at: Option<f64>,
    /// How the mesh is made to follow the sweep.
    #[serde(default)]
    pub method: MethodName,
    /// A triangulated surface, for a planar mesh line segments; relative to the scene.
    pub sweep: Option<PathBuf>,
    /// The two end points (m) of a blade over time (s), linear between samples: it cuts tetrahedra as it moves, each step what
    /// it moves until the end of the step. In statics it moves all its way first.
    pub blade: Option<BladePath>,
    /// Which positions the sweep or the blade is in.
    #[serde(default)]
    pub frame: Frame,
    /// Snapping distance as a fraction of the local mean edge. Default: 0.2; of order 2, which tells places of the cut apart that
    /// order 1 does not, 0.1.
    pub snap: Option<f64>,
    /// Whether cells that come out badly are improved: by smoothing, swaps, collapses and new vertices; tetrahedra only. Default:
    /// yes for "hybrid", "collapse" and "merge".
    pub improve: Option<bool>,
    /// Whether vertices around those that were moved onto the sweep are relaxed by springs; tetrahedra only.
    #[serde(default)]
    pub relax: bool,
    /// Radius ratio (3 r/R) below which a cell counts as bad and is worked on, 0 to 0.7.
    #[serde(default = "default_quality")]
    pub quality: f64,
    /// How many operations may be made in one step to improve cells; later steps go on with what is left. Default: no limit.
    pub operations: Option<usize>,
}

fn default_quality() -> f64 {
    0.3
}

impl CutSpec {
    /// The settings of the cut for elements of an order.
    ///
    /// What snapping puts the edge of a cut off by is an error of the order of d h. With d = 0.2 it is small against the others
    /// that elements of order 1 make near the edge, which are of the order of h with a larger factor, not against those of order
    /// 2. The price of a smaller d is a few more cells, somewhat worse.
    pub(crate) fn options(&self, order: u32) -> kerfem_cutting::CutOptions {
        let method = kerfem_cutting::Method::from(self.method);
        kerfem_cutting::CutOptions {
            method,
            snap: self.snap.unwrap_or(if order == 2 { 0.1 } else { 0.2 }),
            improve: self.improve.unwrap_or(method.improves()),
            relax: self.relax,
            quality: self.quality,
            operations: self.operations.unwrap_or(usize::MAX),
        }
    }
}

/// How the mesh is made to follow a sweep.
#[derive(Clone, Copy, Debug, Default, Deserialize, Serialize, PartialEq, Eq)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "kebab-case")]
pub enum MethodName {
    /// Cells that the sweep crosses are removed.
    Delete,
    /// Cells are split along the sweep.
    Subdivide,
    /// Vertices are moved onto the sweep.
    Snap,
    /// Vertices near the sweep are moved onto it, other cells are split.
    #[default]
    Hybrid,
    /// Cells are split, then short edges of bad cells collapse; tetrahedra only.
    Collapse,
    /// Cells are split, then edges of cells that are small and uneven compared with their neighbours merge; tetrahedra only.
    Merge,
}

impl From<MethodName> for kerfem_cutting::Method {
    fn from(name: MethodName) -> Self {
        match name {
            MethodName::Delete => kerfem_cutting::Method::Delete,
            MethodName::Subdivide => kerfem_cutting::Method::Subdivide,
            MethodName::Snap => kerfem_cutting::Method::Snap,
            MethodName::Hybrid => kerfem_cutting::Method::Hybrid,
            MethodName::Collapse => kerfem_cutting::Method::Collapse,
            MethodName::Merge => kerfem_cutting::Method::Merge,
        }
    }
}

/// Which positions a sweep is given in.
#[derive(Clone, Copy, Debug, Default, Deserialize, Serialize, PartialEq, Eq)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "kebab-case")]
pub enum Frame {
    /// Current positions.
    #[default]
    Deformed,
    /// Rest positions.
    Rest,
}

/// A time series at a point.
#[derive(Clone, Debug, Deserialize, Serialize, PartialEq)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct ProbeSpec {
    /// Names its columns in `steps.csv`.
    pub name: String,
    /// Rest position (m).
    pub point: Components<f64>,
}

/// One number of the last state: exactly one of `mean`, `max`, `min`, `point`, `jump`, `energy`, `momentum`, `angular_momentum`,
/// `reaction`, `KI`.
#[derive(Clone, Debug, Default, Deserialize, Serialize, PartialEq)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields, default)]
pub struct QuantitySpec {
    /// Names it in `report.json`.
    pub name: String,
    /// Mean of "ux", "uy", "uz" over the boundary facets of `where`, by rest area.
    pub mean: Option<Component>,
    /// Largest value over the vertices of `where`.
    pub max: Option<Component>,
    /// Smallest value over the vertices of `where`.
    pub min: Option<Component>,
    /// Value of `component` at a rest position (m).
    pub point: Option<Components<f64>>,
    /// How far a cut has opened along a normal (m), or along `component`; no value where there is no cut.
    pub jump: Option<JumpSpec>,
    /// The component for `point` (default "uz", planar "uy") and for `jump` (default along its normal).
    pub component: Option<Component>,
    /// The elastic energy (J).
    pub energy: Option<bool>,
    /// Momentum along an axis (kg m/s), of the mass that the body moves with.
    pub momentum: Option<Axis>,
    /// Angular momentum about an axis through the origin (kg m²/s), of that mass at current positions. Cuts keep that of the consistent
    /// mass.
    pub angular_momentum: Option<Axis>,
    /// Sum of the reaction forces (N) along an axis over the fixed vertices of `where`.
    pub reaction: Option<Axis>,
    /// Stress intensity factor of a crack in opening mode (Pa sqrt(m)), by the opening of its lips; no value where no crack ends.
    #[serde(rename = "KI")]
    pub stress_intensity: Option<StressIntensitySpec>,
    /// Where it is taken.
    pub r#where: Option<Condition>,
}

/// Where the displacement jumps: its value on the lip of a cut on the side of `normal` less that on the other lip.
#[derive(Clone, Debug, Deserialize, Serialize, PartialEq)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct JumpSpec {
    /// Rest position (m); the nearest points of both lips are taken, at most as far away as their facets are large.
    pub at: Components<f64>,
    /// Across the cut, of any length; lips face along it within 60 degrees.
    pub normal: Components<f64>,
}

/// Where a crack ends. Plane strain is assumed along its front; a planar mesh knows better.
#[derive(Clone, Debug, Deserialize, Serialize, PartialEq)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct StressIntensitySpec {
    /// A rest position on the front of the crack (m).
    pub front: Components<f64>,
    /// Across the crack, of any length.
    pub normal: Components<f64>,
    /// The smallest and the largest distance behind the front at which the opening is taken (m); default 2 and 5 mean edges of the
    /// cell at the front.
    pub radii: Option<[f64; 2]>,
}

/// A component of the displacement.
#[derive(Clone, Copy, Debug, Deserialize, Serialize, PartialEq, Eq)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "lowercase")]
pub enum Component {
    /// Along x.
    Ux,
    /// Along y.
    Uy,
    /// Along z.
    Uz,
}

/// A coordinate axis.
#[derive(Clone, Copy, Debug, Deserialize, Serialize, PartialEq, Eq)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "lowercase")]
pub enum Axis {
    /// x.
    X,
    /// y.
    Y,
    /// z.
    Z,
}

/// What is written.
#[derive(Clone, Debug, Deserialize, Serialize, PartialEq)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields, default)]
pub struct OutputSpec {
    /// Time between frames (s); default each step.
    pub every: Option<f64>,
    /// Fields of the frames.
    pub fields: Vec<FieldName>,
    /// Whether the boundary is written beside each frame, into `surface/`.
    pub surface: bool,
}

impl Default for OutputSpec {
    fn default() -> Self {
        OutputSpec {
            every: None,
            fields: vec![FieldName::Displacement, FieldName::Velocity],
            surface: false,
        }
    }
}

/// A field that frames can hold. Displacement and velocity are always written.
#[derive(Clone, Copy, Debug, Deserialize, Serialize, PartialEq, Eq)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
pub enum FieldName {
    /// Points: displacement (m).
    Displacement,
    /// Points: velocity (m/s).
    Velocity,
    /// Cells: von Mises stress (Pa).
    VonMises,
    /// Cells: radius ratio at rest.
    Quality,
    /// Points: derivative of the elastic energy (N).
    InternalForce,
    /// Points: lumped mass (kg).
    Mass,
    /// Cells: Cauchy stress (Pa), nine components.
    Stress,
    /// Cells: strain, nine components.
    Strain,
    /// Cells: number of the region, zero for `[material]`.
    Region,
}

impl Scene {
    /// This scene as one that a run of `saved` can go on with: `[time]`, `[solver]`, `[output]` and `[[quantity]]` may differ.
    ///
    /// # Errors
    /// [`EngineError::Scene`] with the first section that differs where it may not.
    pub(crate) fn resuming(self, saved: &Scene) -> Result<Scene, EngineError> {
        let sections = [
            ("name", self.name == saved.name),
            ("mesh", self.mesh == saved.mesh),
            ("material", self.material == saved.material),
            ("region", self.region == saved.region),
            ("model", self.model == saved.model),
            ("fixed", self.fixed == saved.fixed),
            ("load", self.load == saved.load),
            ("initial", self.initial == saved.initial),
            ("cut", self.cut == saved.cut),
            ("probe", self.probe == saved.probe),
        ];
        match sections.iter().find(|(_, same)| !same) {
            None => Ok(self),
            Some((section, _)) => self.fail(
                section,
                0,
                "",
                "it differs from the run that was saved; with --resume only [time], [solver], [output] and [[quantity]] may",
            ),
        }
    }

    /// Reads and checks a scene file.
    ///
    /// # Errors
    /// [`EngineError::Scene`] with file, line, key, what is wrong and what is accepted.
    pub fn read(path: impl AsRef<Path>) -> Result<Scene, EngineError> {
        let path = path.as_ref();
        Self::parse(&source::read_text(path, "scene")?, path)
    }

    /// Reads and checks the text of a scene; `path` names it in messages, and files are relative to its folder.
    ///
    /// # Errors
    /// As [`Self::read`].
    pub fn parse(text: &str, path: impl Into<PathBuf>) -> Result<Scene, EngineError> {
        let source = Source {
            path: path.into(),
            text: text.to_owned(),
        };
        let mut scene: Scene = toml::from_str(text).map_err(|e| source.toml_error(&e))?;
        scene.source = source;
        scene.check()?;
        Ok(scene)
    }
}
