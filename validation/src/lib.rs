//! kerfem validation.
