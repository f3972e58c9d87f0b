//! Loops over cells, in parallel; every entry is computed on its own, so the bits do not depend on the threads.

use rayon::prelude::*;

use crate::vectorised::vectorised;

/// Cells per task of a parallel loop.
pub(crate) const CELL_GRAIN: usize = 256;

/// Cells whose rotations are found side by side.
pub(crate) const BATCH: usize = 8;

/// Calls `f(slot number, entry)` for all entries, in parallel.
pub(crate) fn for_each_slot<V: Send>(values: &mut [V], f: impl Fn(usize, &mut V) + Sync + Send) {
    if rayon::current_num_threads() == 1 {
        values.iter_mut().enumerate().for_each(|(i, v)| f(i, v));
    } else {
        values
            .par_iter_mut()
            .enumerate()
            .with_min_len(CELL_GRAIN)
            .for_each(|(i, v)| f(i, v));
    }
}

/// Calls `f(first slot, entries)` for batches of up to [`BATCH`] cells, in parallel and with the vector instructions there
/// are.
pub(crate) fn for_each_batch<V: Send>(values: &mut [V], f: impl Fn(usize, &mut [V]) + Sync + Send) {
    let task = |start: usize, values: &mut [V]| {
        vectorised(
            #[inline(always)]
            || {
                // a plain loop: `for_each` would not be inlined
                for (b, values) in values.chunks_mut(BATCH).enumerate() {
                    f(start + b * BATCH, values);
                }
            },
        );
    };
    if rayon::current_num_threads() == 1 {
        task(0, values);
    } else {
        values
            .par_chunks_mut(CELL_GRAIN)
            .enumerate()
            .for_each(|(c, values)| task(c * CELL_GRAIN, values));
    }
}

/// [`for_each_batch`] over two arrays.
pub(crate) fn for_each_batch_of_two<V: Send, W: Send>(
    first: &mut [V],
    second: &mut [W],
    f: impl Fn(usize, &mut [V], &mut [W]) + Sync + Send,
) {
    let task = |start: usize, v: &mut [V], w: &mut [W]| {
        vectorised(
            #[inline(always)]
            || {
                for (b, (v, w)) in v.chunks_mut(BATCH).zip(w.chunks_mut(BATCH)).enumerate() {
                    f(start + b * BATCH, v, w);
                }
            },
        );
    };
    if rayon::current_num_threads() == 1 {
        task(0, first, second);
    } else {
        let chunks = first.par_chunks_mut(CELL_GRAIN).zip(second.par_chunks_mut(CELL_GRAIN));
        chunks.enumerate().for_each(|(c, (v, w))| task(c * CELL_GRAIN, v, w));
    }
}
