//! A curve with knots put where something else is to begin.

use crate::math::b_spline::{Curve, Inserted, Place};

/// A curve with a knot at a place, and with others about it: the span that begins there, and how places
/// move.
pub(super) struct Cut {
    pub(super) curve: Curve,
    pub(super) span: usize,
    inserted: Vec<Inserted>,
}

impl Cut {
    /// The curve with knots at the places `about` and at `place`, all of them places of `curve`. Where a knot
    /// is already none is put.
    pub(super) fn new(curve: &Curve, place: Place, about: &[Place]) -> Self {
        let mut cut = Cut {
            curve: curve.clone(),
            span: 0,
            inserted: Vec::new(),
        };
        for &knot in about.iter().chain([&place]) {
            if let Some(inserted) = cut.curve.insert_knot(cut.place(knot)) {
                cut.curve = inserted.curve.clone();
                cut.inserted.push(inserted);
            }
        }
        let there = cut.place(place);
        cut.span = there.span + usize::from(there.offset > 0.0);
        cut
    }

    /// Where a place of the former curve is on this one.
    pub(super) fn place(&self, former: Place) -> Place {
        let moved = |place, inserted: &Inserted| inserted.place(place);
        self.inserted.iter().fold(former, moved)
    }

    /// The place; at the knot of the cut as the beginning of the span after it: one that rests there may have
    /// been the end of the span before, which is of another part of the curve.
    pub(super) fn place_after(&self, former: Place) -> Place {
        let place = self.place(former);
        if place.span + 1 == self.span && place.offset == self.curve.span_length(place.span) {
            return Place {
                span: self.span,
                offset: 0.0,
            };
        }
        place
    }

    /// The place; at the knot of the cut as the end of the span before it, since what follows there is
    /// another part of the curve.
    pub(super) fn place_before(&self, former: Place) -> Place {
        let place = self.place(former);
        if place.span == self.span && place.offset == 0.0 && self.span > 0 {
            return Place {
                span: self.span - 1,
                offset: self.curve.span_length(self.span - 1),
            };
        }
        place
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_stay_where_they_were_and_the_cut_is_a_knot() {
        let controls = (0..9).map(|j| [f64::from(j), f64::from(j * j % 5)]);
        let curve = Curve::new(vec![2.0; 10], controls.collect()).unwrap();
        let place = |span, offset| Place { span, offset };
        let (at, about) = (place(3, 1.5), [place(3, 0.5), place(3, 1.0), place(4, 1.0)]);
        let cut = Cut::new(&curve, at, &about);
        assert_eq!((cut.curve.spans(), cut.span), (10, 6));
        for span in 0..6 {
            for offset in [0.0, 0.5, 0.75, 1.5, 2.0] {
                let (p, q) = (place(span, offset), cut.place(place(span, offset)));
                let (p, q) = (curve.at(p), cut.curve.at(q));
                assert!(
                    (0..2).all(|k| (p[k] - q[k]).abs() < 1e-14),
                    "{span} {offset}"
                );
            }
        }
        assert_eq!(cut.place(at), place(6, 0.0));
        assert_eq!(cut.place_before(at), place(5, 0.5));
        assert_eq!(cut.place_after(at), place(6, 0.0));
        // where a knot is already
        let cut = Cut::new(&curve, place(3, 2.0), &[]);
        assert_eq!((cut.curve.spans(), cut.span), (6, 4));
        // the end of the span before is where the next one begins
        assert_eq!(cut.place_after(place(3, 2.0)), place(4, 0.0));
        assert_eq!(cut.place_after(place(3, 1.5)), place(3, 1.5));
    }
}
