//! Anything with a clock: scenes, state, time integration, cuts in the middle of it, results, and the command `kerfem`.
//!
//! A newcomer's path: a [`Scene`] says what there is; a [`Simulation`] made from it steps ([`Simulation::step`] is the whole
//! frame in one place) and is cut ([`Simulation::cut`]); [`run::run`] does both until the end and writes what comes out.
//!
//! ```
//! use kerfem_engine::{Scene, Simulation};
//! let scene = r#"
//!     name = "beam"
//!     [mesh]
//!     box = { size = [4.0, 1.0, 1.0], cells = [8, 2, 2] }
//!     [material]
//!     young = 1e5
//!     poisson = 0.3
//!     density = 1000.0
//!     [[fixed]]
//!     where = "x < 1e-9"
//!     [[load]]
//!     gravity = [0, 0, -1]
//!     [time]
//!     scheme = "backward-euler"
//!     dt = 0.01
//!     end = 1.0
//! "#;
//! let mut sim = Simulation::new(Scene::parse(scene, "beam.toml")?)?;
//! for _ in 0..10 {
//!     assert!(sim.step(0.01)?.converged);
//! }
//! assert!(sim.positions().iter().any(|p| p.z < -1e-3));
//! # Ok::<(), kerfem_engine::EngineError>(())
//! ```

mod advance;
mod audit;
mod blades;
pub mod book;
pub mod chart;
mod choices;
mod conditions;
mod cutter;
mod damping;
mod energies;
mod equilibrium;
mod error;
mod explicit;
mod expression;
pub mod fit;
pub mod geometry;
mod input;
mod jump;
pub mod modes;
mod momentum;
mod nearest;
pub mod output;
mod past;
mod pending;
mod probes;
mod quantities;
pub mod report;
pub mod run;
mod save;
mod scene;
mod selections;
mod simulation;
mod state;
mod stress_intensity;
pub mod study;
mod supports;

pub use choices::Choices;
pub use energies::Energies;
pub use error::EngineError;
pub use expression::{Expression, ExpressionError};
pub use scene::*;
pub use simulation::{AnySimulation, Simulation, StepInfo};
pub use state::State;
