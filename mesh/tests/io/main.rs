//! Files: what is read from whom (`read`), what is written (`write`), and damaged files (`damaged`, `fuzz`; `mutate` damages
//! them). `shared` finds the reference data, which lie outside the repository.

mod damaged;
mod fuzz;
mod mutate;
mod read;
mod shared;
mod write;
