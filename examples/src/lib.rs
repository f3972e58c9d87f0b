//! kerfem examples.
