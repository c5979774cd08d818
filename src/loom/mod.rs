//! psi = h o g o f: a shape space and three signals, fitted, measured, evaluated at any time.
