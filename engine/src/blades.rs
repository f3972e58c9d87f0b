//! Blades of a scene that move: what each step sweeps, and where each has come to (METHODS N1).
//!
//! In every step a blade sweeps what it moves in `[t, t + dt]` before the step's solve, one straight motion after another;
//! statics and "evaluate" sweep the whole path first. In the deformed frame the end of the incision has moved with the body
//! since, and the next motion goes on from there. A blade cuts by moving against the body: where it lies still it cuts what
//! has carried the end of an incision past it by more than its shortest motion, and nothing else.

use kerfem_cutting::{Blade, CutOptions, Tip};
use serde::{Deserialize, Serialize};

use crate::{EngineError, Frame, Scene, Scheme, Simulation};

/// A blade on its way.
#[derive(Debug)]
pub(crate) struct MovingBlade {
    /// Which `[[cut]]` it is, from zero.
    pub(crate) index: usize,
    pub(crate) blade: Blade,
    pub(crate) frame: Frame,
    pub(crate) options: CutOptions,
    progress: Progress,
}

/// How far a blade has come.
#[derive(Clone, Debug, Serialize, Deserialize)]
struct Progress {
    /// What is swept (s).
    until: f64,
    /// Where its incision ends.
    tip: Tip,
    /// Whether it has changed or refused anything.
    met: bool,
}

/// What a save holds of a blade: the rest is in the scene.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct StoredBlade {
    index: usize,
    progress: Progress,
}

impl MovingBlade {
    /// For a save.
    pub(crate) fn stored(&self) -> StoredBlade {
        StoredBlade {
            index: self.index,
            progress: self.progress.clone(),
        }
    }
}

/// The blades of a scene, in its order.
pub(crate) fn of(scene: &Scene) -> Result<Vec<MovingBlade>, EngineError> {
    let mut blades = Vec::new();
    for (index, spec) in scene.cut.iter().enumerate() {
        let Some(path) = &spec.blade else { continue };
        let blade = path
            .blade()
            .map_err(|e| scene.source.error("cut", index, "blade", e.to_string()))?;
        blades.push(MovingBlade {
            index,
            frame: spec.frame,
            options: spec.options(scene.model.order),
            progress: Progress {
                until: blade.start(),
                tip: Tip::new(blade.at(blade.start())),
                met: false,
            },
            blade,
        });
    }
    Ok(blades)
}

/// The blades of a scene that are still on their way, as a save holds them.
pub(crate) fn restored(scene: &Scene, stored: Vec<StoredBlade>, slots: usize) -> Result<Vec<MovingBlade>, String> {
    let mut all = of(scene).map_err(|e| e.to_string())?;
    let mut blades = Vec::with_capacity(stored.len());
    for StoredBlade { index, progress } in stored {
        let Some(k) = all.iter().position(|b| b.index == index) else {
            return Err(format!("cut {index} is no blade"));
        };
        if !progress.until.is_finite() || !progress.tip.fits(slots) {
            return Err(format!("the blade of cut {index} does not fit the mesh"));
        }
        blades.push(MovingBlade {
            progress,
            ..all.swap_remove(k)
        });
    }
    Ok(blades)
}

impl<const N: usize> Simulation<N> {
    /// Sweeps what the blades move until the end of the next step.
    pub(crate) fn move_blades(&mut self, dt: f64) -> Result<f64, EngineError> {
        let at_once = matches!(self.scene.time.scheme, Scheme::Static | Scheme::Evaluate);
        let to = self.state.time_after(dt) + 1e-9 * dt;
        let mut seconds = 0.0;
        let mut on_their_way = Vec::new();
        for mut blade in std::mem::take(&mut self.blades) {
            let to = if at_once { f64::INFINITY } else { to };
            seconds += self.move_blade(&mut blade, to)?;
            if blade.progress.until < blade.blade.end() {
                on_their_way.push(blade);
            } else if !blade.progress.met {
                self.warn(format!("the blade of cut {} meets no body on its way", blade.index));
            }
        }
        self.blades = on_their_way;
        Ok(seconds)
    }

    fn move_blade(&mut self, moving: &mut MovingBlade, to: f64) -> Result<f64, EngineError> {
        let (from, to) = (moving.progress.until, to.min(moving.blade.end()));
        if to <= from {
            return Ok(0.0);
        }
        let mut seconds = 0.0;
        self.prepare_cut(moving.frame);
        for stop in moving.blade.stops(from, to) {
            let line = moving.blade.at(stop);
            let due = stop == moving.blade.end();
            moving.progress.until = stop;
            let tip = &mut moving.progress.tip;
            let sweep = self.cutter.sweep_of(&self.mesh, tip, line, &moving.options, due);
            if sweep.is_empty() {
                continue;
            }
            let mut record = self.cut_prepared(moving.frame, &sweep, &moving.options, false)?;
            seconds += record.seconds.find + record.seconds.remesh + record.seconds.update;
            // what is refused stays to be cut
            if record.refused.is_empty() {
                self.cutter.arrive(&self.mesh, tip, line, &moving.options);
                record.tip_distance_m = Some(tip.distance());
            }
            if !record.refused.is_empty() || record.changes_something() {
                moving.progress.met = true;
                self.cuts.push(record);
            }
        }
        Ok(seconds)
    }

    /// What the run ended too early for.
    pub(crate) fn unmoved_blades(&self) -> Vec<String> {
        let left = self.blades.iter().filter(|b| b.blade.end() > self.state.time);
        left.map(|b| {
            format!(
                "the blade of cut {} moves until {} s: the run ended at {} s",
                b.index,
                b.blade.end(),
                self.state.time
            )
        })
        .collect()
    }
}
