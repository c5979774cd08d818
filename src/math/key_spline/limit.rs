//! The bound on how far a piece leaves the range of its two keys.

use super::slopes::Keys;

impl Keys<'_> {
    /// Cuts slopes so that each piece stays in its range, widened: times the length of the piece they are
    /// at most `3 + reach` times its rise, and `reach` times against it. Slopes of 0 always do.
    pub(super) fn limit(&self, reach: f64, incoming: &mut [f64], outgoing: &mut [f64]) {
        let (n, m) = (self.count(), self.columns);
        let cut = |slope: f64, piece: usize, j: usize| {
            let along = self.secant(piece, j);
            let ends = [-reach * along, (3.0 + reach) * along];
            slope.clamp(ends[0].min(ends[1]), ends[0].max(ends[1]))
        };
        for i in 0..n {
            let before = i.checked_sub(1).or(self.periodic.then(|| n - 2));
            let after = match i + 1 < n {
                true => Some(i),
                false => self.periodic.then_some(0),
            };
            for j in 0..m {
                let at = i * m + j;
                let within = |slope: f64, pieces: [Option<usize>; 2]| {
                    let pieces = pieces.into_iter().flatten();
                    pieces.fold(slope, |slope, piece| cut(slope, piece, j))
                };
                if incoming.is_empty() || incoming[at] == outgoing[at] {
                    outgoing[at] = within(outgoing[at], [before, after]);
                    if let Some(slope) = incoming.get_mut(at) {
                        *slope = outgoing[at];
                    }
                } else {
                    outgoing[at] = within(outgoing[at], [after, None]);
                    incoming[at] = within(incoming[at], [before, None]);
                }
            }
        }
    }
}

/// How steep pieces may start and end for their overshoot to be at most `share` of their rise: the
/// largest s with u^3 - s u (1 - u) >= -share on \[0, 1\]. That is the lowest course of a piece from 0 to
/// 1 whose slopes lie in \[-s, 3 + s\]; the highest is its mirror image. s = 0 for share 0 (Fritsch &
/// Carlson 1980).
pub(super) fn steepest(share: f64) -> f64 {
    let lowest = |s: f64| {
        let u = (libm::sqrt(s * s + 3.0 * s) - s) / 3.0;
        u * u * u - s * u * (1.0 - u)
    };
    // at u = 1/2 the course is 1/8 - s/4
    let (mut low, mut high) = (0.0, 4.0 * share.max(0.0) + 0.5);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        match lowest(middle) >= -share {
            true => low = middle,
            false => high = middle,
        }
    }
    low
}
