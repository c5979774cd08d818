//! Where a time lies between keys, and what value and slope at both weigh there.

/// A time within the knots: the piece, the share of it that has passed, its length. Shares outside of
/// \[0, 1\] lie on the tangent at that end.
pub(super) struct Place {
    pub(super) piece: usize,
    share: f64,
    length: f64,
}

impl Place {
    pub(super) fn new(times: &[f64], t: f64) -> Self {
        let Some(last_piece) = times.len().checked_sub(2) else {
            return Place {
                piece: 0,
                share: 0.0,
                length: 0.0,
            };
        };
        let after = times.partition_point(|&time| time <= t);
        let piece = after.saturating_sub(1).min(last_piece);
        let length = times[piece + 1] - times[piece];
        Place {
            piece,
            share: (t - times[piece]) / length,
            length,
        }
    }

    /// Weights of value and slope at the start of the piece, then at its end.
    pub(super) fn values(&self) -> [f64; 4] {
        let (u, h) = (self.share, self.length);
        if u < 0.0 {
            return [1.0, u * h, 0.0, 0.0];
        }
        if u > 1.0 {
            return [0.0, 0.0, 1.0, (u - 1.0) * h];
        }
        let v = 1.0 - u;
        [
            v * v * (1.0 + 2.0 * u),
            h * u * v * v,
            u * u * (3.0 - 2.0 * u),
            -h * u * u * v,
        ]
    }

    pub(super) fn slopes(&self) -> [f64; 4] {
        let (u, h) = (self.share, self.length);
        if u < 0.0 || h == 0.0 {
            return [0.0, 1.0, 0.0, 0.0];
        }
        if u > 1.0 {
            return [0.0, 0.0, 0.0, 1.0];
        }
        let rise = 6.0 * u * (1.0 - u) / h;
        [
            -rise,
            (1.0 - u) * (1.0 - 3.0 * u),
            rise,
            u * (3.0 * u - 2.0),
        ]
    }

    pub(super) fn seconds(&self) -> [f64; 4] {
        let (u, h) = (self.share, self.length);
        if !(0.0..=1.0).contains(&u) || h == 0.0 {
            return [0.0; 4];
        }
        let bend = 6.0 * (1.0 - 2.0 * u) / (h * h);
        [-bend, (6.0 * u - 4.0) / h, bend, (6.0 * u - 2.0) / h]
    }
}
