//! The one door to everything outside: files in, files out. No `std::fs` here; `io` opens the door.
