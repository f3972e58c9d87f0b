//! kerfem engine.
