//! kerfem fem.
