//! A loom made ready for edits of its curve: time running forwards over its own frames, without changes of
//! time around it.

use std::sync::Arc;

use crate::diag::{Diagnostic, Result};
use crate::loom::{Loom, Parts};
use crate::math::b_spline::Place;
use crate::math::monotone;
use crate::signal::root::{RootFrame, RootSignal};
use crate::signal::time::TimeSignal;
/// A loom without changes of time, and whether it runs against the one it was made of.
pub(super) struct Forward {
    pub(super) loom: Loom,
    pub(super) reversed: bool,
}

/// Makes frames of the times 1..n: these keep their bits; between them the change of time is a monotone
/// cubic again. A loom that runs backwards is turned, so that its frames keep their bits too.
///
/// # Errors
/// Time runs back and forth.
pub(super) fn forward(loom: &Loom) -> Result<Forward> {
    let reversed = loom
        .time()
        .place_at(1.0)
        .zip(loom.time().place_at(loom.frames() as f64));
    let reversed =
        reversed.is_some_and(|((a, _), (b, _))| loom.time().curve().distance(a, b) < 0.0);
    let turned = if reversed {
        super::reverse(loom)?
    } else {
        loom.clone()
    };
    Ok(Forward {
        loom: baked(&turned)?,
        reversed,
    })
}

impl Forward {
    /// A stretch of the original's time on this loom's.
    pub(super) fn stretch(&self, from: f64, to: f64) -> (f64, f64) {
        let last = self.loom.frames() as f64;
        match self.reversed {
            true => (last + 1.0 - to, last + 1.0 - from),
            false => (from, to),
        }
    }

    /// A loom made of this one, running as the original did.
    pub(super) fn restore(&self, loom: &Loom) -> Result<Loom> {
        match self.reversed {
            true => super::reverse(loom),
            false => Ok(loom.clone()),
        }
    }
}

/// The loom with its times 1..n as its own frames, spans that no frame needs dropped.
///
/// # Errors
/// Time does not run forwards.
pub(super) fn baked(loom: &Loom) -> Result<Loom> {
    let time = loom.time();
    if time.warps().is_empty() {
        return Ok(loom.clone());
    }
    let times = 1..=loom.frames();
    let at = |t: usize| time.place_at(t as f64).zip(time.source_time(t as f64));
    let states: Vec<((Place, f64), (f64, f64))> = times.filter_map(at).collect();
    let curve = time.curve();
    let places: Vec<Place> = states.iter().map(|((place, _), _)| *place).collect();
    let rises: Vec<f64> = places
        .windows(2)
        .map(|p| curve.distance(p[0], p[1]))
        .collect();
    if rises.iter().any(|&rise| rise < 0.0) {
        return Diagnostic::error(
            "the loom's time runs back and forth, its curve cannot be edited",
        )
        .hint("edit it before `retime`")
        .err();
    }
    let rates: Vec<f64> = states.iter().map(|((_, rate), _)| rate.max(0.0)).collect();
    let slopes = monotone::limited(&rises, &rates);
    let root = loom.root().map(|root| {
        let frames = states
            .iter()
            .map(|(_, (source, rate))| slowed(root.frame_at(*source), *rate));
        root.with_frames(frames.collect())
    });
    let root = root.transpose().map_err(|e| {
        Box::new(Diagnostic::error("the root motion is not finite").at_frame(e.frame + 1))
    })?;
    let (curve, places) = match (places.first(), places.last(), curve.spans()) {
        (Some(first), Some(last), 1..) => {
            let start = first.span;
            let shifted = |place: &Place| Place {
                span: place.span - start,
                ..*place
            };
            let shifted = places.iter().map(shifted).collect();
            (curve.spans_of(start..last.span + 1), shifted)
        }
        _ => (curve.clone(), places),
    };
    let time = TimeSignal::new(curve, places, slopes, Vec::new()).map_err(super::impossible)?;
    assembled(loom, time, root)
}

/// A frame of root motion met at another rate.
fn slowed(frame: RootFrame, rate: f64) -> RootFrame {
    RootFrame {
        spin: frame.spin * rate,
        slope: frame.slope * rate,
        ..frame
    }
}

/// The loom with another time signal and root motion.
pub(super) fn assembled(loom: &Loom, time: TimeSignal, root: Option<RootSignal>) -> Result<Loom> {
    Loom::new(Parts {
        time: Arc::new(time),
        root: root.map(Arc::new),
        ..loom.parts()
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::edit::{retime, reverse, speed};
    use crate::loom::test_looms::travelling;

    #[test]
    fn frames_keep_their_bits_and_between_them_little_changes() {
        let loom = travelling(10, 30);
        let slow = speed(&loom, 10.0, 20.0, 0.6).unwrap().output;
        for loom in [slow.clone(), reverse(&slow).unwrap()] {
            let forward = forward(&loom).unwrap();
            assert!(forward.loom.time().warps().is_empty());
            let back = forward.restore(&forward.loom).unwrap();
            for i in 0..=10 * (loom.frames() - 1) {
                let t = 1.0 + i as f64 / 10.0;
                let (p, q) = (loom.position_at(t).unwrap(), back.position_at(t).unwrap());
                if t.fract() == 0.0 {
                    assert_eq!(loom.at(t).unwrap(), back.at(t).unwrap());
                }
                // a twentieth of the steps of 0.3 between frames, at the easing
                assert!((p[0] - q[0]).abs() < 0.015 && (p[1] - q[1]).abs() < 0.015);
            }
        }
    }

    #[test]
    fn back_and_forth_is_refused() {
        let loom = travelling(5, 10);
        let both = retime(&loom, &[[1.0, 1.0], [10.0, 10.0], [14.0, 6.0]]).unwrap();
        assert!(forward(&both).is_err());
    }
}
