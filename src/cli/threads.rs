//! How many worker threads, and why.

use std::num::NonZero;
use std::thread::available_parallelism;

/// The number of worker threads and what decided it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Threads {
    pub(super) count: usize,
    pub(super) cores: usize,
    pub(super) from: &'static str,
}

impl Threads {
    /// `--threads`, else RAYON_NUM_THREADS, else SLURM_CPUS_PER_TASK (a render node's share of the
    /// machine), else the cores that this process may use.
    pub(super) fn choose(asked: Option<u16>) -> Self {
        let variable = |name: &'static str| -> Option<(usize, &'static str)> {
            let count = std::env::var(name).ok()?.trim().parse().ok()?;
            (count > 0).then_some((count, name))
        };
        let cores = available_parallelism().map_or(1, NonZero::get);
        let (count, from) = asked
            .map(|count| (usize::from(count), "--threads"))
            .or_else(|| variable("RAYON_NUM_THREADS"))
            .or_else(|| variable("SLURM_CPUS_PER_TASK"))
            .unwrap_or((cores, "cores"));
        Threads { count, cores, from }
    }

    /// Starts the workers. Results do not depend on how many there are, so a pool that somebody else
    /// has started already serves as well.
    pub(super) fn start(self) {
        let _ = rayon::ThreadPoolBuilder::new()
            .num_threads(self.count)
            .build_global();
    }
}
