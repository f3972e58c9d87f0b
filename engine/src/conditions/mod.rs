//! What acts on the body: prescribed displacements and loads, kept true through cuts.

mod copies;
mod fixed;
mod loads;
mod select;
#[cfg(test)]
mod tests;

pub(crate) use fixed::{FixedDofs, FixedSet};
pub(crate) use loads::Loads;
pub(crate) use select::Selector;
