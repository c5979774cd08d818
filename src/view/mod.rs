//! A mesh and a camera to pixels, on the CPU. Pure.
