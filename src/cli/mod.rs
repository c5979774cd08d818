//! The command line: parses, wires, prints, exits; computes nothing.
