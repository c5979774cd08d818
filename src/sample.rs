//! Which times, and the frames of a loom at them.
