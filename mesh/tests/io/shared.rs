//! Where test files lie.

use std::path::{Path, PathBuf};

/// A file of `tests/samples`.
pub(crate) fn sample(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/samples").join(name)
}

/// The folder of reference data beside the repository, or `None`, with a note, where it is absent. With the environment
/// variable KERFEM_REQUIRE_SHARED=1 its absence is a failure.
pub(crate) fn shared_data() -> Option<PathBuf> {
    let data = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/data");
    if data.is_dir() {
        return Some(data);
    }
    let required = std::env::var("KERFEM_REQUIRE_SHARED").is_ok_and(|v| v == "1");
    assert!(
        !required,
        "../shared is absent, and KERFEM_REQUIRE_SHARED=1 asks for it"
    );
    eprintln!("skipped: ../shared is absent");
    None
}
