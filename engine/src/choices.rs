//! What "auto" stands for, and why.

use std::collections::BTreeMap;

use kerfem_fem::{
    LinearSolver, Locking, Material, Model, NEARLY_INCOMPRESSIBLE, PreconditionerKind, SolverKind, SolverOptions,
};

use crate::report::Choice;
use crate::{ModelKind, Nonlinear, PreconditionerName, Scene, Scheme, SolverName};

/// Below so many unknowns a static problem is factorised.
const DIRECT: usize = 20_000;
/// Linear solves inside Newton's method need no more than this: the next step corrects what is left.
const NEWTON_TOLERANCE: f64 = 1e-3;

/// Every choice of a run, by the key of the scene it stands for.
pub type Choices = BTreeMap<String, Choice>;

fn note(choices: &mut Choices, key: &str, chosen: &str, why: String) {
    choices.insert(
        key.into(),
        Choice {
            chosen: chosen.into(),
            why,
        },
    );
}

/// The kinematics.
pub(crate) fn model(scene: &Scene, choices: &mut Choices) -> Model {
    match scene.model.kind {
        ModelKind::Linear => Model::Linear,
        ModelKind::Corotated => Model::Corotated,
        ModelKind::Auto => {
            note(
                choices,
                "model.kind",
                "corotated",
                "right for small and large rotations".into(),
            );
            Model::Corotated
        }
    }
}

/// The cure of volumetric locking, for a body of these materials and cells of `N` corners.
pub(crate) fn locking<const N: usize>(scene: &Scene, materials: &[Material], choices: &mut Choices) -> Locking {
    match scene.model.locking.as_str() {
        "nodal" => return Locking::Nodal,
        "none" => return Locking::None,
        _ if scene.model.order == 2 => {
            note(choices, "model.locking", "none", "quadratic cells lock little".into());
            return Locking::None;
        }
        _ => {}
    }
    let cured = materials.iter().filter(|m| Locking::Auto.cures::<N>(m));
    let (chosen, why) = match cured.map(Material::poisson).reduce(f64::max) {
        Some(poisson) => (
            "nodal",
            format!("poisson = {poisson} locks plain elements; above {NEARLY_INCOMPRESSIBLE} materials are cured"),
        ),
        None => {
            let poisson = materials.iter().map(Material::poisson).fold(-1.0, f64::max);
            ("none", format!("poisson = {poisson} needs no cure"))
        }
    };
    note(choices, "model.locking", chosen, why);
    Locking::Auto
}

/// The linear solver for so many unknowns.
pub(crate) fn solver(scene: &Scene, model: Model, unknowns: usize, choices: &mut Choices) -> LinearSolver {
    let statics = scene.time.scheme == Scheme::Static;
    let explicit = scene.time.scheme == Scheme::CentralDifference;
    let kind = match scene.solver.kind {
        SolverName::Cg => SolverKind::Cg,
        SolverName::Cholesky => SolverKind::Cholesky,
        SolverName::Auto if statics && unknowns <= DIRECT => {
            let why = format!("statics with {unknowns} unknowns, up to {DIRECT} a factorisation is fastest");
            note(choices, "solver.kind", "cholesky", why);
            SolverKind::Cholesky
        }
        // nothing is solved, so nothing is chosen
        SolverName::Auto if explicit => SolverKind::Cg,
        SolverName::Auto => {
            let why = match statics {
                true => format!("statics with {unknowns} unknowns, above {DIRECT} factors are too large"),
                false => "inertia keeps the system well conditioned, and the last step gives a good start".into(),
            };
            note(choices, "solver.kind", "cg", why);
            SolverKind::Cg
        }
    };
    let preconditioner = match scene.solver.preconditioner {
        PreconditionerName::None => PreconditionerKind::None,
        PreconditionerName::Jacobi => PreconditionerKind::Jacobi,
        PreconditionerName::BlockJacobi => PreconditionerKind::BlockJacobi,
        PreconditionerName::BlockIc0 => PreconditionerKind::BlockIc0,
        PreconditionerName::Multigrid => PreconditionerKind::Multigrid,
        PreconditionerName::Auto => {
            let (name, chosen, why) = match statics {
                true => (
                    "multigrid",
                    PreconditionerKind::Multigrid,
                    "its iterations hardly depend on the size of the mesh",
                ),
                false => (
                    "block-ic0",
                    PreconditionerKind::BlockIc0,
                    "a third of the iterations of block-jacobi, and made anew at little cost in each step",
                ),
            };
            if kind == SolverKind::Cg && !explicit {
                note(choices, "solver.preconditioner", name, why.into());
            }
            chosen
        }
    };
    let newton = model == Model::Corotated && scene.time.nonlinear == Nonlinear::Newton;
    let tolerance = if newton {
        scene.solver.tolerance.max(NEWTON_TOLERANCE)
    } else {
        scene.solver.tolerance
    };
    LinearSolver::new(SolverOptions {
        kind,
        preconditioner,
        tolerance,
        max_iterations: scene.solver.max_iterations,
    })
}
