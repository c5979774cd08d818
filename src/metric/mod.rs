//! How far apart two sequences are.
