//! Where a motion comes back to where it was: loops that close (cf. CH12 §4.1; Prada et al. 2016 search
//! transitions by shape and motion in the same way).

use super::add_loop::{Looped, add_loop};
use crate::diag::{Diagnostic, Result};
use crate::loom::Loom;
use crate::task::Task;

/// How many loops are tried in earnest.
const TRIED: usize = 12;

/// The loop of `shortest` to `longest` whole frames whose seam shows least, added once: of those whose ends
/// are most alike in shape and in speed (rigid motion apart) the one with the smallest worst ratio, or the
/// least strange shapes ([`Looped::shown`]).
///
/// # Errors
/// No loop is that short or that long; those of [`add_loop`], `task` cancelled among them.
pub fn find_loop(loom: &Loom, shortest: usize, longest: usize, task: &Task) -> Result<Looped> {
    let mut best: Option<Looped> = None;
    for (from, to) in alike(loom, shortest.max(1), longest)? {
        let looped = add_loop(loom, from as f64, to as f64, 1, None, task)?;
        let better = |best: &Looped| looped.shown() < best.shown();
        if best.as_ref().is_none_or(better) {
            best = Some(looped);
        }
    }
    let n = loom.frames();
    let none = || {
        Diagnostic::error(format!("no loop of {shortest} to {longest} frames")).hint(format!(
            "a motion of {n} frames has loops of 1 to {}",
            n.saturating_sub(1)
        ))
    };
    best.ok_or_else(|| none().into())
}

/// Pairs of frames, from 1, that are most alike, the most alike first.
fn alike(loom: &Loom, shortest: usize, longest: usize) -> Result<Vec<(usize, usize)>> {
    let n = loom.frames();
    let states = (1..=n)
        .map(|frame| state(loom, frame as f64))
        .collect::<Result<Vec<_>>>()?;
    let mut loops = Vec::new();
    for length in shortest..=longest.min(n.saturating_sub(1)) {
        for from in 1..=n - length {
            let (a, b) = (&states[from - 1], &states[from + length - 1]);
            let apart: f64 = a.iter().zip(b).map(|(a, b)| (a - b) * (a - b)).sum();
            loops.push((apart, (from, from + length)));
        }
    }
    loops.sort_by(|a, b| a.0.total_cmp(&b.0));
    loops.truncate(TRIED);
    Ok(loops.into_iter().map(|(_, ends)| ends).collect())
}

/// Shape and velocity a frame in the shape subspace, in one row.
fn state(loom: &Loom, t: f64) -> Result<Vec<f64>> {
    let mut row = loom.coordinates_at(t)?;
    row.extend(super::seam::velocity(loom, t));
    Ok(row)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::loom::test_looms::ring;

    #[test]
    fn a_turn_of_the_ring_is_found() {
        let found = find_loop(&ring(10, 60, true), 8, 40, &Task::default()).unwrap();
        let (from, to) = found.stretch;
        // one turn takes 20.27 frames: 20 or 21, two of them 40
        let turns = (to - from) / 20.27;
        assert!((turns - turns.round()).abs() < 0.04, "{from} {to}");
        assert!(found.seam.worst() < 1.5);
    }

    #[test]
    fn lengths_that_no_loop_has_are_refused() {
        let loom = ring(5, 12, true);
        assert!(find_loop(&loom, 12, 30, &Task::default()).is_err());
        assert!(find_loop(&loom, 8, 4, &Task::default()).is_err());
    }
}
