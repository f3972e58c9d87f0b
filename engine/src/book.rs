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

#[doc = include_str!("../../docs/book/files.md")]
pub mod files {}

#[doc = include_str!("../../docs/book/conventions.md")]
pub mod conventions {}

#[doc = include_str!("../../docs/book/crates.svg")]
#[doc = ""]
#[doc = include_str!("../../docs/book/crates.md")]
pub mod crates {}
