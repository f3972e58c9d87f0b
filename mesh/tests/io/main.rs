//! Files: what is read from whom (`read`), what is written (`write`), and damaged files (`damaged`). `shared` finds the
//! reference data, which lie outside the repository.

mod damaged;
mod fuzz;
mod read;
mod shared;
mod write;
