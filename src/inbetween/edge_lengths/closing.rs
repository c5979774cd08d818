//! Dihedral angles that close the walks around all inner vertices: damped Gauss-Newton steps
//! (Levenberg-Marquardt) on equation (3) of Rojas et al. 2014.
//!
//! The step is d = -J^T (J J^T + mu I)^-1 r, which is -(J^T J + mu I)^-1 J^T r: among all changes that
//! close the walks the least one, so angles that nothing fixes (next to borders) stay where the
//! interpolation put them. J J^T has a 3 x 3 block for each pair of vertices joined by a hinge, the pattern
//! of the finishing solve, analysed once.

use super::damping::Damping;
use super::fans::{Fans, NO_HINGE};
use super::shape::point;
use super::walk::{Errors, corner_halves};
use crate::math::block_sparse::BlockPattern;
use crate::math::sparse::Factor;

/// Steps at most; a blend of poses needs four to eight.
const STEPS: usize = 24;

/// Walks are closed below this energy a walk, a millionth of a radian each: the finishing solve takes over.
const CLOSED: f64 = 1e-12;

/// This many steps in a row that each gain less than this part of the energy end the iteration: where
/// walks close it shrinks by orders of magnitude a step, where they cannot the finishing solve does better.
const IDLE: usize = 3;
const GAIN: f64 = 0.5;

/// Below this energy of all walks a step that gains less than this part ends it: walks that can close do so
/// ten times better a step, and the finishing solve does the rest.
const NEAR: f64 = 1e-7;
const SLOW: f64 = 0.75;

/// Damping, in parts of the mean diagonal: at the start, least and most.
const DAMPING: [f64; 3] = [1e-2, 1e-12, 1e4];

/// What the iteration did.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Closing {
    /// E(A) of the angles given.
    pub(super) before: f64,
    /// E(A) at the end.
    pub(super) after: f64,
    /// Factorisations made.
    pub(super) steps: usize,
}

/// The hinges between closed fans and the pattern of J J^T.
#[derive(Debug)]
pub(super) struct Closer {
    pattern: BlockPattern,
    /// For each hinge the steps that turn at it, in the order of the fans.
    turns: Vec<Turn>,
}

/// A hinge and the closed walks that turn there: two, or one where the other is open.
#[derive(Debug, Clone, Copy)]
struct Turn {
    hinge: u32,
    ends: [Option<End>; 2],
    link: Option<u32>,
}

/// A step of a closed fan.
#[derive(Debug, Clone, Copy)]
struct End {
    step: u32,
    fan: u32,
}

/// Pairs of closed fans that share a hinge: the links of the pattern.
pub(super) fn links(fans: &Fans) -> Vec<[u32; 2]> {
    let both = |turn: &Turn| Some([turn.ends[0]?.fan, turn.ends[1]?.fan]);
    turns(fans).iter().filter_map(both).collect()
}

/// The closed walks' steps at each hinge, ascending.
fn turns(fans: &Fans) -> Vec<Turn> {
    let mut at: Vec<(u32, u32)> = Vec::with_capacity(fans.steps.len());
    for fan in fans.fans.iter().filter(|fan| fan.closed) {
        at.extend(
            fan.steps()
                .map(|step| (fans.steps[step].hinge, step as u32)),
        );
    }
    at.retain(|(hinge, _)| *hinge != NO_HINGE);
    at.sort_unstable();
    let mut link = 0;
    at.chunk_by(|a, b| a.0 == b.0)
        .map(|run| {
            let end = |&(_, step): &(u32, u32)| End {
                step,
                fan: fans.fan_of[step as usize],
            };
            let ends = [run.first().map(end), run.get(1).map(end)];
            let joined = ends[1].is_some();
            link += u32::from(joined);
            Turn {
                hinge: run[0].0,
                ends,
                link: joined.then(|| link - 1),
            }
        })
        .collect()
}

impl Closer {
    /// `pattern` has the fans as nodes and [`links`] as links.
    pub(super) fn new(fans: &Fans, pattern: BlockPattern) -> Self {
        Closer {
            pattern,
            turns: turns(fans),
        }
    }

    /// Changes `dihedrals` until the walks close or no step gains. `kept` is the factor of an earlier
    /// frame; a new one is left there.
    pub(super) fn close(
        &self,
        fans: &Fans,
        corner_angles: &[f64],
        dihedrals: &mut [f64],
        kept: &mut Option<Factor>,
    ) -> Closing {
        let corners = corner_halves(corner_angles);
        let mut errors = fans.errors(&corners, dihedrals);
        let enough = CLOSED * fans.closed() as f64;
        let mut done = Closing {
            before: errors.energy(),
            after: errors.energy(),
            steps: 0,
        };
        let (mut damping, mut idle) = (Damping::new(DAMPING), 0);
        while done.after > enough && done.steps < STEPS && !damping.spent() {
            done.steps += 1;
            let better = self
                .step(&errors, damping.value(), kept)
                .map(|(step, promised)| {
                    let moved = self.moved(&errors, dihedrals, &step);
                    (fans.errors(&corners, &moved), moved, promised)
                })
                .filter(|(found, ..)| found.energy() < done.after);
            let Some((found, moved, promised)) = better else {
                damping.refused();
                continue;
            };
            let energy = found.energy();
            let gain = (done.after - energy) / done.after;
            damping.taken((done.after - energy) / promised);
            dihedrals.copy_from_slice(&moved);
            (errors, done.after) = (found, energy);
            idle = if gain < GAIN { idle + 1 } else { 0 };
            if idle == IDLE || (energy < NEAR && gain < SLOW) {
                break;
            }
        }
        done
    }

    /// y = (J J^T + mu I)^-1 r, for each fan, and by how much the energy would fall if r were linear:
    /// what would be left of r is mu y. None where the factorisation breaks down.
    fn step(
        &self,
        errors: &Errors,
        damping: f64,
        kept: &mut Option<Factor>,
    ) -> Option<(Vec<f64>, f64)> {
        let mut entries = vec![0.0; self.pattern.analysis().pattern().entries()];
        for turn in &self.turns {
            let columns = turn
                .ends
                .map(|end| end.map(|end| errors.columns[end.step as usize]));
            for (end, column) in turn.ends.iter().flatten().zip(columns.iter().flatten()) {
                let block = column * column.transpose();
                self.pattern
                    .add_node(&mut entries, end.fan as usize, &block);
            }
            if let ([Some(one), Some(two)], Some(link)) = (columns, turn.link) {
                self.pattern
                    .add_link(&mut entries, link as usize, &(one * two.transpose()));
            }
        }
        let shift = damping * self.pattern.mean_diagonal(&entries);
        self.pattern.shift(&mut entries, shift);
        match kept {
            Some(factor) => factor.refactor(&entries).ok()?,
            None => *kept = Some(self.pattern.analysis().factor(&entries).ok()?),
        }
        let mut side: Vec<f64> = errors
            .residuals
            .iter()
            .flat_map(|r| [r.x, r.y, r.z])
            .collect();
        kept.as_ref()?.solve(1, &mut side);
        let left: f64 = side.iter().map(|y| shift * y * shift * y).sum();
        Some((side, errors.energy() - 2.0 * left))
    }

    /// The angles after the step -J^T y.
    fn moved(&self, errors: &Errors, dihedrals: &[f64], y: &[f64]) -> Vec<f64> {
        let mut moved = dihedrals.to_vec();
        for turn in &self.turns {
            for end in turn.ends.iter().flatten() {
                let pull = point(y, end.fan);
                moved[turn.hinge as usize] -= errors.columns[end.step as usize].dot(&pull);
            }
        }
        moved
    }
}
