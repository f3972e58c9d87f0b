#![doc = include_str!("../../docs/book/index.md")]

#[doc = include_str!("../../docs/book/first_cut.md")]
pub mod first_cut {}

#[doc = include_str!("../../docs/book/scene.md")]
pub mod scene {}

#[doc = include_str!("../../docs/book/methods_compare.svg")]
#[doc = ""]
#[doc = include_str!("../../docs/book/methods_f1.svg")]
#[doc = ""]
#[doc = include_str!("../../docs/book/methods.md")]
pub mod methods {}

#[doc = include_str!("../../docs/book/locking.svg")]
#[doc = ""]
#[doc = include_str!("../../docs/book/locking.md")]
pub mod locking {}

#[doc = include_str!("../../docs/book/solvers.md")]
pub mod solvers {}

#[doc = include_str!("../../docs/book/study_cut_methods.svg")]
#[doc = ""]
#[doc = include_str!("../../docs/book/study_cut_cantilever.svg")]
#[doc = ""]
#[doc = include_str!("../../docs/book/study_locking.svg")]
#[doc = ""]
#[doc = include_str!("../../docs/book/study_solvers.svg")]
#[doc = ""]
#[doc = include_str!("../../docs/book/study_schemes.svg")]
#[doc = ""]
#[doc = include_str!("../../docs/book/study_map_schemes.svg")]
#[doc = ""]
#[doc = include_str!("../../docs/book/study_map_eps.svg")]
#[doc = ""]
#[doc = include_str!("../../docs/book/study_map_quality.svg")]
#[doc = ""]
#[doc = include_str!("../../docs/book/study_map_poisson.svg")]
#[doc = ""]
#[doc = include_str!("../../docs/book/study_map_rotation.svg")]
#[doc = ""]
#[doc = include_str!("../../docs/book/study_map_cap.svg")]
#[doc = ""]
#[doc = include_str!("../../docs/book/study_map_stretch.svg")]
#[doc = ""]
#[doc = include_str!("../../docs/book/study_map_momentum.svg")]
#[doc = ""]
#[doc = include_str!("../../docs/book/study_map_scheme_eps.svg")]
#[doc = ""]
#[doc = include_str!("../../docs/book/study_map_scheme_poisson.svg")]
#[doc = ""]
#[doc = include_str!("../../docs/book/study_map_bent.svg")]
#[doc = ""]
#[doc = include_str!("../../docs/book/study_map_sliver.svg")]
#[doc = ""]
#[doc = include_str!("../../docs/book/study_map_crack.svg")]
#[doc = ""]
#[doc = include_str!("../../docs/book/studies.md")]
pub mod studies {}

#[doc = include_str!("../../docs/book/files.md")]
pub mod files {}

#[doc = include_str!("../../docs/book/conventions.md")]
pub mod conventions {}

#[doc = include_str!("../../docs/book/crates.svg")]
#[doc = ""]
#[doc = include_str!("../../docs/book/crates.md")]
pub mod crates {}
