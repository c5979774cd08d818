//! Numerics that have never heard of a mesh. Deterministic: the same bits on any number of threads.
