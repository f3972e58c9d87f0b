//! The cure of volumetric locking: strains averaged over the cells of each vertex.

use crate::material::Lame;
use crate::{Material, Plane};

/// Poisson's ratio above which [`Locking::Auto`] cures a material.
pub const NEARLY_INCOMPRESSIBLE: f64 = 0.45;

/// The part of the stiffness that stays in the cells and keeps averages from hiding strains that change sign from cell to cell.
const KEPT: f64 = 0.2;

/// The first Lamé parameter of what stays is at most so many times the second: more would lock again.
const KEPT_LAMBDA: f64 = 2.0;

/// What keeps linear cells from locking, that is, from being too stiff, as nearly incompressible ones are by far.
///
/// The cure is the uniform nodal strain of Gee, Dohrmann, Key and Wall, "A uniform nodal strain tetrahedron with isochoric
/// stabilization", IJNME 78 (2009), after Puso and Solberg, "A stabilized nodally integrated tetrahedral", IJNME 67 (2006): each
/// vertex has a patch, the cells around it of its material, whose deformation gradient is their average by volume. A fifth of
/// the stiffness stays in the cells, with `lambda` at most `2 mu`; the rest is that of the patches. Both are bodies of the same
/// law (linear or corotated), so energy, forces and tangents are as exact as without; K stays symmetric and
/// positive definite, is never stiffer than without, but its rows reach two rings of neighbours.
///
/// Patches are made of the mesh as it is: they never reach across a cut or into another material. At Poisson's ratios where
/// nothing locks the cure makes coarse meshes more accurate too, at the cost of rows three to four times as long.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Locking {
    /// No cure: each cell has all of its stiffness.
    #[default]
    None,
    /// Cured are materials with a Poisson's ratio above [`NEARLY_INCOMPRESSIBLE`], except in plane stress, where nothing locks.
    Auto,
    /// All materials are cured.
    Nodal,
}

impl Locking {
    /// Whether cells of `N` corners and of this material are cured.
    pub fn cures<const N: usize>(self, material: &Material) -> bool {
        match self {
            Locking::None => false,
            Locking::Auto => {
                material.poisson() > NEARLY_INCOMPRESSIBLE && !(N == 3 && material.plane() == Plane::Stress)
            }
            Locking::Nodal => true,
        }
    }

    /// The law of a cell alone.
    pub(crate) fn law_of_cells<const N: usize>(self, material: &Material) -> Lame {
        let all = material.lame::<N>();
        match self.cures::<N>(material) {
            true => kept_in_cells(&all),
            false => all,
        }
    }
}

fn kept_in_cells(all: &Lame) -> Lame {
    Lame {
        lambda: KEPT * all.lambda.min(KEPT_LAMBDA * all.mu),
        mu: KEPT * all.mu,
    }
}

/// The law of the patches of a material that is cured.
pub(crate) fn law_of_patches<const N: usize>(material: &Material) -> Lame {
    let all = material.lame::<N>();
    let kept = kept_in_cells(&all);
    Lame {
        lambda: all.lambda - kept.lambda,
        mu: all.mu - kept.mu,
    }
}
