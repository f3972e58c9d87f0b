//! What a scheme of two steps remembers of the one before.

use serde::{Deserialize, Serialize};

/// The last step: its length, and by how much it changed the state.
///
/// It does not outlive a cut: there the forces, and with them the accelerations that these increments stand for, jump.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct Past {
    /// Its length (s); zero if there is none.
    pub(crate) dt: f64,
    /// Increment of the displacement (m), flat as in [`crate::State`]; empty until it is used.
    pub(crate) du: Vec<f64>,
    /// Increment of the velocity (m/s), likewise.
    pub(crate) dv: Vec<f64>,
}

impl Past {
    /// Forgets the step, and makes room for so many dofs if it is in use.
    pub(crate) fn forget(&mut self, dofs: usize) {
        self.dt = 0.0;
        if !self.du.is_empty() {
            self.du.resize(dofs, 0.0);
            self.dv.resize(dofs, 0.0);
        }
    }

    /// Whether it belongs to a state of so many dofs.
    pub(crate) fn fits(&self, dofs: usize) -> bool {
        let sized = |field: &[f64]| field.len() == dofs || (field.is_empty() && self.dt == 0.0);
        let finite = self.du.iter().chain(&self.dv).all(|x| x.is_finite());
        sized(&self.du) && sized(&self.dv) && self.dt.is_finite() && self.dt >= 0.0 && finite
    }
}
