//! Tracks of an animation: what moves, its keys, and its value between them.

use gltf::animation::{Interpolation, Property};
use gltf::{Animation, accessor::Dimensions};

use super::accessor::{Buffers, finite};
use super::damaged;
use crate::diag::Result;

/// Keys of one property of one node.
#[derive(Debug, Clone)]
pub(super) struct Track {
    pub(super) node: usize,
    pub(super) property: Property,
    /// In seconds, increasing.
    pub(super) times: Vec<f32>,
    /// `width` numbers a key; with cubic splines the slope before, the value, the slope after.
    values: Vec<f32>,
    pub(super) width: usize,
    interpolation: Interpolation,
}

/// The tracks of an animation.
pub(super) fn tracks(animation: &Animation, buffers: &Buffers) -> Result<Vec<Track>> {
    let mut tracks = Vec::new();
    for channel in animation.channels() {
        let sampler = channel.sampler();
        let times = buffers.vectors(&sampler.input(), Dimensions::Scalar)?;
        let values = buffers.floats(&sampler.output())?;
        finite(&times, "key times")?;
        finite(&values, "keys")?;
        let interpolation = sampler.interpolation();
        let parts = match interpolation {
            Interpolation::CubicSpline => 3,
            Interpolation::Linear | Interpolation::Step => 1,
        };
        let (node, property) = (channel.target().node(), channel.target().property());
        let width = match property {
            Property::Translation | Property::Scale => 3,
            Property::Rotation => 4,
            Property::MorphTargetWeights => values.len() / (parts * times.len()).max(1),
        };
        if times.is_empty() || width == 0 {
            continue;
        }
        if !times.is_sorted_by(|a, b| a < b) {
            return damaged("key times that do not increase").err();
        }
        if values.len() != times.len() * parts * width {
            return damaged("an animation with other counts of times and values").err();
        }
        tracks.push(Track {
            node: node.index(),
            property,
            times,
            values,
            width,
            interpolation,
        });
    }
    Ok(tracks)
}

impl Track {
    /// The value at time `t`; before the first and after the last key it stays. `value` has `width`
    /// numbers. (glTF 2.0, appendix C)
    pub(super) fn at(&self, t: f64, value: &mut [f64]) {
        let next = self.times.partition_point(|&time| f64::from(time) <= t);
        let last = self.times.len() - 1;
        let key = next.saturating_sub(1);
        if next == 0 || key == last || self.interpolation == Interpolation::Step {
            self.key(key, value);
            return;
        }
        let (from, to) = (f64::from(self.times[key]), f64::from(self.times[next]));
        let (step, u) = (to - from, (t - from) / (to - from));
        match (self.interpolation, self.property) {
            (Interpolation::CubicSpline, _) => self.cubic(key, u, step, value),
            (_, Property::Rotation) => {
                let (mut a, mut b) = ([0.0; 4], [0.0; 4]);
                self.key(key, &mut a);
                self.key(next, &mut b);
                value.copy_from_slice(&slerp(a, b, u));
            }
            _ => {
                for (component, value) in value.iter_mut().enumerate() {
                    let [a, b] = [key, next].map(|key| self.number(key, 0, component));
                    *value = a + u * (b - a);
                }
            }
        }
    }

    /// The value of a key.
    fn key(&self, key: usize, value: &mut [f64]) {
        let part = usize::from(self.interpolation == Interpolation::CubicSpline);
        for (component, value) in value.iter_mut().enumerate() {
            *value = self.number(key, part, component);
        }
    }

    fn number(&self, key: usize, part: usize, component: usize) -> f64 {
        let parts = self.values.len() / (self.times.len() * self.width);
        f64::from(self.values[(key * parts + part) * self.width + component])
    }

    /// Hermite's cubic between two keys, `step` seconds apart.
    fn cubic(&self, key: usize, u: f64, step: f64, value: &mut [f64]) {
        let (u2, u3) = (u * u, u * u * u);
        for (component, value) in value.iter_mut().enumerate() {
            let (p0, m0) = (
                self.number(key, 1, component),
                self.number(key, 2, component),
            );
            let (m1, p1) = (
                self.number(key + 1, 0, component),
                self.number(key + 1, 1, component),
            );
            *value = (2.0 * u3 - 3.0 * u2 + 1.0) * p0
                + step * (u3 - 2.0 * u2 + u) * m0
                + (3.0 * u2 - 2.0 * u3) * p1
                + step * (u3 - u2) * m1;
        }
    }
}

/// The shorter way between two rotations; nearly equal ones are blended in a straight line.
fn slerp(a: [f64; 4], b: [f64; 4], u: f64) -> [f64; 4] {
    let dot: f64 = a.iter().zip(&b).map(|(a, b)| a * b).sum();
    let sign = if dot < 0.0 { -1.0 } else { 1.0 };
    let dot = dot.abs().min(1.0);
    let (from, to) = if dot > 0.9995 {
        (1.0 - u, u)
    } else {
        let angle = libm::acos(dot);
        let sine = libm::sin(angle);
        (
            libm::sin((1.0 - u) * angle) / sine,
            libm::sin(u * angle) / sine,
        )
    };
    std::array::from_fn(|i| from * a[i] + sign * to * b[i])
}

#[cfg(test)]
mod tests {
    use super::*;

    fn track(interpolation: Interpolation, values: &[f32]) -> Track {
        Track {
            node: 0,
            property: Property::MorphTargetWeights,
            times: vec![1.0, 3.0],
            values: values.to_vec(),
            width: 1,
            interpolation,
        }
    }

    fn at(track: &Track, t: f64) -> f64 {
        let mut value = [0.0];
        track.at(t, &mut value);
        value[0]
    }

    #[test]
    fn keys_are_met_and_held_outside() {
        let cubic = track(Interpolation::CubicSpline, &[9.0, 2.0, 5.0, 7.0, 6.0, 9.0]);
        let linear = track(Interpolation::Linear, &[2.0, 6.0]);
        let step = track(Interpolation::Step, &[2.0, 6.0]);
        for track in [&cubic, &linear, &step] {
            let found = [0.0, 1.0, 3.0, 9.0].map(|t| at(track, t));
            assert_eq!(found, [2.0, 2.0, 6.0, 6.0]);
        }
        assert_eq!(at(&linear, 1.5), 3.0);
        assert_eq!(at(&step, 2.9), 2.0);
    }

    #[test]
    fn a_cubic_track_reproduces_a_cubic() {
        let (p, v) = (|t: f64| t * t * t - 2.0 * t, |t: f64| 3.0 * t * t - 2.0);
        let values = [0.0, p(1.0), v(1.0), v(3.0), p(3.0), 0.0].map(|x| x as f32);
        let cubic = track(Interpolation::CubicSpline, &values);
        for t in [1.25, 2.0, 2.75] {
            // rounding of Hermite's form: a few units in the last place of values below 100
            assert!((at(&cubic, t) - p(t)).abs() < 1e-13);
        }
    }

    #[test]
    fn rotations_go_the_shorter_way_at_constant_speed() {
        let turn = |angle: f64| [0.0, (angle / 2.0).sin(), 0.0, (angle / 2.0).cos()];
        let flipped = turn(1.2).map(|x| -x);
        for u in [0.0, 0.25, 0.5, 1.0] {
            for target in [turn(1.2), flipped] {
                let found = slerp(turn(0.2), target, u);
                let expected = turn(0.2 + u);
                for (a, b) in found.iter().zip(expected) {
                    assert!((a - b).abs() < 1e-15);
                }
            }
        }
    }
}
