//! f, the time signal (CH12 §2.3): time t -> pose space R^2 as f~ o rho, a cubic B-spline after a
//! monotone change of parameter.
//!
//! rho takes frame i to t_i, its place on the curve, and is a monotone cubic between frames (weakly
//! monotone where positions repeat). Frames are held as places (span, offset in it), and everything is
//! computed from the neighbourhood of a place, so frames that an edit shifts keep their bits. Changes of
//! time (reversed, slower, retimed) are kept as [`Warp`]s around rho and compose without loss.

use super::warp::Warp;
use crate::math::b_spline::{Curve, Place, Point};
use crate::math::monotone;

/// Why parts are not a time signal, or positions have none. Frames count from 0.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum TimeError {
    /// There are no frames.
    Empty,
    /// This frame's position, place or slope is not finite, or its place is not on the curve.
    Frame {
        /// The frame.
        frame: usize,
    },
    /// This frame lies before the frame before it.
    Order {
        /// The frame.
        frame: usize,
    },
    /// There are not as many slopes as frames.
    Counts,
    /// This warp asks for times that what it warps does not have.
    Warp {
        /// Which one, from 0, innermost first.
        index: usize,
    },
    /// So many control points are not possible.
    Controls {
        /// How many were asked for.
        given: usize,
        /// The least that is possible.
        least: usize,
        /// The most: two more than there are distinct consecutive positions.
        most: usize,
    },
    /// The exponent of the parametrisation is not in \[0, 1\].
    Exponent,
}

/// The time signal of n frames; t runs over \[1, n\].
#[derive(Debug, Clone, PartialEq)]
pub struct TimeSignal {
    curve: Curve,
    places: Vec<Place>,
    slopes: Vec<f64>,
    warps: Vec<Warp>,
}

impl TimeSignal {
    /// A time signal of its parts: the curve f~, each frame's place, the slopes of rho there (parameter
    /// per frame, >= 0), and changes of time, innermost first.
    ///
    /// # Errors
    /// See [`TimeError`].
    pub fn new(
        curve: Curve,
        places: Vec<Place>,
        slopes: Vec<f64>,
        warps: Vec<Warp>,
    ) -> Result<Self, TimeError> {
        if places.is_empty() {
            return Err(TimeError::Empty);
        }
        if slopes.len() != places.len() {
            return Err(TimeError::Counts);
        }
        check_places(&curve, &places)?;
        if let Some(frame) = slopes
            .iter()
            .position(|slope| !(0.0..f64::INFINITY).contains(slope))
        {
            return Err(TimeError::Frame { frame });
        }
        let mut frames = places.len();
        for (index, warp) in warps.iter().enumerate() {
            let whole = matches!(warp, Warp::Reverse { frames: all } if *all != frames);
            if whole || warp.latest() > frames as f64 {
                return Err(TimeError::Warp { index });
            }
            frames = warp.frames();
        }
        Ok(TimeSignal {
            curve,
            places,
            slopes,
            warps,
        })
    }

    /// The same with the monotone slopes (Fritsch-Carlson) through the frames' places.
    ///
    /// # Errors
    /// See [`TimeError`].
    pub fn through(curve: Curve, places: Vec<Place>) -> Result<Self, TimeError> {
        check_places(&curve, &places)?;
        let rises: Vec<f64> = places
            .windows(2)
            .map(|pair| curve.distance(pair[0], pair[1]))
            .collect();
        let slopes = monotone::slopes(&vec![1.0; rises.len()], &rises);
        TimeSignal::new(curve, places, slopes, Vec::new())
    }

    /// The same signal after one more change of time; a reversal undoes a reversal.
    ///
    /// # Errors
    /// The warp asks for times outside \[1, n\].
    pub fn with_warp(&self, warp: Warp) -> Result<Self, TimeError> {
        let mut warps = self.warps.clone();
        match (&warp, warps.last()) {
            (Warp::Reverse { .. }, Some(Warp::Reverse { .. })) => {
                warps.pop();
            }
            _ => warps.push(warp),
        }
        let (curve, places, slopes) = (&self.curve, &self.places, &self.slopes);
        TimeSignal::new(curve.clone(), places.clone(), slopes.clone(), warps)
    }

    /// The same frames and changes of time on another curve of as many spans of the same lengths.
    ///
    /// # Errors
    /// A frame's place is not on it.
    pub fn with_curve(&self, curve: Curve) -> Result<Self, TimeError> {
        let (places, slopes, warps) = (&self.places, &self.slopes, &self.warps);
        TimeSignal::new(curve, places.clone(), slopes.clone(), warps.clone())
    }

    /// How many frames there are: t runs over \[1, n\].
    pub fn frames(&self) -> usize {
        self.warps.last().map_or(self.places.len(), Warp::frames)
    }

    /// f~.
    pub fn curve(&self) -> &Curve {
        &self.curve
    }

    /// The k control points of f~; a single one where nothing moves.
    pub fn controls(&self) -> &[Point] {
        self.curve.controls()
    }

    /// Places of the frames on the curve, before any change of time.
    pub fn places(&self) -> &[Place] {
        &self.places
    }

    /// Slopes of rho at the frames, before any change of time.
    pub fn slopes(&self) -> &[f64] {
        &self.slopes
    }

    /// Changes of time, innermost first.
    pub fn warps(&self) -> &[Warp] {
        &self.warps
    }

    /// t_i: the parameters of the frames before any change of time, from the start of the domain.
    pub fn parameters(&self) -> Vec<f64> {
        let knots = self.curve.knots();
        let parameter = |place: &Place| knots[place.span + 2] + place.offset;
        self.places.iter().map(parameter).collect()
    }

    /// The time before all changes of time that output time `t` shows, in frames from 1, and its
    /// derivative. None outside \[1, n\].
    pub fn source_time(&self, t: f64) -> Option<(f64, f64)> {
        if !(1.0 <= t && t <= self.frames() as f64) {
            return None;
        }
        Some(self.warps.iter().rev().fold((t, 1.0), |(t, rate), warp| {
            let (source, slope) = warp.at(t);
            (source, rate * slope)
        }))
    }

    /// The place on the curve at `t`, and how fast it moves on (parameter per frame). None outside
    /// \[1, n\].
    pub fn place_at(&self, t: f64) -> Option<(Place, f64)> {
        let (source, rate) = self.source_time(t)?;
        let (place, slope) = self.rho(source);
        Some((place, slope * rate))
    }

    /// f(t), a point of pose space. None outside \[1, n\].
    pub fn at(&self, t: f64) -> Option<Point> {
        let (place, _) = self.place_at(t)?;
        Some(self.curve.at(place))
    }

    /// f'(t), pose-space units per frame. None outside \[1, n\].
    pub fn velocity(&self, t: f64) -> Option<Point> {
        let (place, rate) = self.place_at(t)?;
        Some(self.curve.derivatives(place)[0].map(|x| x * rate))
    }

    /// Place and slope of rho at a time before any change of time.
    fn rho(&self, t: f64) -> (Place, f64) {
        let last = self.places.len() - 1;
        let frame = ((t - 1.0) as usize).min(last);
        let x = t - (frame + 1) as f64;
        let here = self.places[frame];
        if frame == last || x <= 0.0 {
            return (here, self.slopes[frame]);
        }
        let rise = self.curve.distance(here, self.places[frame + 1]);
        let ends = [self.slopes[frame], self.slopes[frame + 1]];
        let (y, slope) = monotone::piece(1.0, rise, ends, x);
        (self.curve.advance(here, y.clamp(0.0, rise)), slope)
    }
}

/// Every place on the curve, none before the one before it.
fn check_places(curve: &Curve, places: &[Place]) -> Result<(), TimeError> {
    for (frame, place) in places.iter().enumerate() {
        let length = match curve.spans() {
            0 if place.span == 0 => 0.0,
            spans if place.span < spans => curve.span_length(place.span),
            _ => return Err(TimeError::Frame { frame }),
        };
        // A span of length 0 has no point of its own.
        let empty = curve.spans() > 0 && length == 0.0;
        if empty || !(0.0..=length).contains(&place.offset) {
            return Err(TimeError::Frame { frame });
        }
        if frame > 0 && curve.distance(places[frame - 1], *place) < 0.0 {
            return Err(TimeError::Order { frame });
        }
    }
    Ok(())
}
