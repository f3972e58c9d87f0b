//! What a user gets wrong, through the command: one table of named cases for each kind of mistake.
//!
//! `keys`: what a scene may say; `values`: numbers and formulas; `selections`: what a scene acts on; `texts`: files that are no
//! scene; `meshes`, `sweeps`: files that a scene names; `arguments`: the command line; `allowed`: what looks wrong and is not.
//! `fuzz` tries what nobody thought of. Each case must be refused as [`harness`] says: exit code 2, one line, nothing written.

mod allowed;
mod arguments;
mod fuzz;
mod harness;
mod keys;
mod meshes;
#[path = "../../../mesh/tests/io/mutate.rs"]
mod mutate;
mod selections;
mod sweeps;
mod texts;
mod values;

use harness::{PLANAR, SOLID, changed};

/// The scenes of the tables.
fn wrong_scenes() -> impl Iterator<Item = String> {
    let solid = [keys::KEYS, values::NUMBERS, values::FORMULAS, selections::SELECTIONS];
    let planar = [keys::PLANAR_KEYS, selections::PLANAR_ROWS];
    let scenes = |base: &'static str, tables: Vec<&'static [harness::Row<'static>]>| {
        let rows = tables.into_iter().flatten();
        rows.map(move |(_, from, to, ..)| changed(base, from, to))
    };
    scenes(SOLID, solid.to_vec()).chain(scenes(PLANAR, planar.to_vec()))
}
