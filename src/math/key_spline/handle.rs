//! How an animator turns the tangents at a key.

/// How the curve passes a key (Kochanek & Bartels 1984), each from -1 to 1 and 0 by default.
///
/// With m the slope that the key would have without a handle and d-, d+ the slopes of the straight lines
/// to its neighbours, the curve leaves with (1 - tension) ((1 + c b) m + (b + c) (d- - d+) / 2) and comes
/// in with (1 - tension) ((1 - c b) m + (b - c) (d- - d+) / 2): theirs, with m in the place of the mean
/// of d- and d+. At an end of the curve only the tension counts.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Handle {
    /// 1: the curve comes to rest at the key; -1: it rushes through it.
    pub tension: f64,
    /// Not 0: a corner. -1 with tension 0 is nearly the straight lines.
    pub continuity: f64,
    /// Positive: the turn comes after the key; negative: before it.
    pub bias: f64,
}

impl Handle {
    pub(super) fn is_default(&self) -> bool {
        *self == Handle::default()
    }

    /// The incoming and the outgoing slope, for the slope m without a handle and those of the lines before
    /// and after.
    #[must_use]
    pub fn slopes(&self, m: f64, before: f64, after: f64) -> [f64; 2] {
        let (c, b) = (self.continuity, self.bias);
        let half = 0.5 * (before - after);
        [
            (1.0 - self.tension) * ((1.0 - c * b) * m + (b - c) * half),
            (1.0 - self.tension) * ((1.0 + c * b) * m + (b + c) * half),
        ]
    }
}
