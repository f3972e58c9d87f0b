//! kerfem cutting.
