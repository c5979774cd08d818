//! Series to pictures with tiny-skia, or to SVG. Pure.
