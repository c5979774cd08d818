//! Bytes to frames and back, one file a format. Sees no path.
