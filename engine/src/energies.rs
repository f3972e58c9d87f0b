//! The energy of a body over time.

use serde::{Deserialize, Serialize};

use crate::equilibrium::{Body, dot, mass_times};

/// Energies (J) of a state.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Energies {
    /// Half of `v . M v`.
    pub kinetic: f64,
    /// Elastic energy.
    pub elastic: f64,
    /// Minus the work of the present loads on the present displacement.
    pub potential: f64,
    /// What the scheme and damping have taken out of the balance since the start: work of loads and supports over all
    /// steps less the change of kinetic and elastic energy. What cuts change is not part of it.
    pub dissipated: f64,
}

impl Energies {
    /// Kinetic and elastic energy of a state, `scratch` of the same length; the other two as they were.
    #[must_use]
    pub(crate) fn measured<const N: usize>(
        self,
        body: &Body<'_, N>,
        u: &[f64],
        v: &[f64],
        scratch: &mut [f64],
    ) -> Energies {
        mass_times(body, v, scratch);
        Energies {
            kinetic: 0.5 * dot(v, scratch),
            elastic: body.assembler.energy(body.mesh, body.model, u),
            ..self
        }
    }
}
