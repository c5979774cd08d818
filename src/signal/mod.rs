//! The three signals of CH12 §2 and how each is fitted: shape (h), pose (g), time (f), and root motion.
