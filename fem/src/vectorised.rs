//! Runs a loop with the vector instructions of the processor at hand.

use pulp::{Arch, Simd, WithSimd};

/// Compiles and runs `f`, as far as it is inlined, for the widest vector instructions found at run time. Sums are not
/// reordered and products not fused, so the bits are the same on every processor.
#[inline]
pub(crate) fn vectorised(f: impl FnMut()) {
    Arch::new().dispatch(Task(f));
}

struct Task<F>(F);

impl<F: FnMut()> WithSimd for Task<F> {
    type Output = ();

    // by `FnMut`, because the shim of `FnOnce` would not be inlined
    #[inline(always)]
    fn with_simd<S: Simd>(mut self, _: S) {
        (self.0)();
    }
}
