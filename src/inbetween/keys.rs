//! Key poses and their times.

use crate::diag::{Diagnostic, Result};
use crate::mesh::{FrameSource, Sequence, Topology};

/// Frames from one key to the next where no times are given: a second of film.
pub const SPACING: f64 = 24.0;

/// Two or more shapes of one mesh at rising times. Times count in frames.
#[derive(Debug, Clone)]
pub struct Keys {
    poses: Sequence,
    times: Vec<f64>,
}

impl Keys {
    /// The frames of `poses` as keys at these times; without times at 1, 25, 49, .. ([`SPACING`]).
    ///
    /// # Errors
    /// Fewer than two keys, another number of times than keys, times that are not finite or do not rise.
    pub fn new(poses: Sequence, times: Option<Vec<f64>>) -> Result<Self> {
        let count = poses.frames();
        if count < 2 {
            let keys = if count == 1 { "one key" } else { "no keys" };
            return Diagnostic::error(format!("{keys}: a motion needs two or more"))
                .hint("name more shapes of the same mesh")
                .err();
        }
        let spaced = || (0..count).map(|i| 1.0 + SPACING * i as f64).collect();
        let times = times.unwrap_or_else(spaced);
        check(&times, count)?;
        Ok(Keys { poses, times })
    }

    /// The shapes.
    pub fn poses(&self) -> &Sequence {
        &self.poses
    }

    /// When each is reached, rising.
    pub fn times(&self) -> &[f64] {
        &self.times
    }

    /// J, how many there are.
    pub fn count(&self) -> usize {
        self.times.len()
    }

    /// The time of the first and of the last.
    pub fn ends(&self) -> [f64; 2] {
        [self.times[0], self.times[self.times.len() - 1]]
    }

    /// The 3V positions of a key, from 0.
    pub fn pose(&self, key: usize) -> Vec<f64> {
        widened(self.poses.frame(key))
    }
}

/// Coordinates in double precision.
pub(super) fn widened(positions: &[f32]) -> Vec<f64> {
    positions.iter().map(|&x| f64::from(x)).collect()
}

/// Each key has its time, later than the one before.
fn check(times: &[f64], keys: usize) -> Result<()> {
    if times.len() != keys {
        return Diagnostic::error(format!("{} times for {keys} keys", times.len()))
            .hint("give each key its time, in order")
            .err();
    }
    if let Some(time) = times.iter().find(|time| !time.is_finite()) {
        return Diagnostic::error(format!("{time} is not a time"))
            .hint("times of keys are finite numbers, in frames")
            .err();
    }
    let Some(at) = times.windows(2).position(|pair| pair[0] >= pair[1]) else {
        return Ok(());
    };
    let (here, next, time) = (at + 1, at + 2, times[at + 1]);
    let told = match times[at] == time {
        true => Diagnostic::error(format!("keys {here} and {next} have the same time {time}")),
        false => Diagnostic::error(format!(
            "key {next} at time {time} comes before key {here} at time {}",
            times[at]
        )),
    };
    told.hint("times rise from key to key; sort the keys by time")
        .err()
}

/// Refuses shape `shape` (counted from 1) unless it has the faces of the first.
///
/// # Errors
/// Another number of vertices or faces; the first face that differs is named.
pub fn same_faces(first: &Topology, other: &Topology, shape: usize) -> Result<()> {
    let counts = |mesh: &Topology| format!("{} vertices, {} faces", mesh.vertices(), mesh.faces());
    let told = if first.vertices() != other.vertices() || first.faces() != other.faces() {
        Diagnostic::error(format!(
            "shape {shape} has {}, the first {}",
            counts(other),
            counts(first)
        ))
    } else {
        let differs = |&face: &usize| first.face(face) != other.face(face);
        match (0..first.faces()).find(differs) {
            None => return Ok(()),
            Some(face) => Diagnostic::error(format!(
                "shape {shape} has another face here than the first"
            ))
            .at_face(face + 1),
        }
    };
    told.hint("all shapes need the same faces in the same order")
        .err()
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;

    fn poses(count: usize) -> Sequence {
        let topology = Arc::new(Topology::from_triangles(3, &[[0, 1, 2]]).unwrap());
        Sequence::new(topology, vec![0.0; 9 * count], None)
    }

    fn refused(count: usize, times: &[f64], part: &str) {
        let told = Keys::new(poses(count), Some(times.to_vec())).unwrap_err();
        assert!(told.message.contains(part), "{told}");
        assert!(!told.hints.is_empty());
    }

    #[test]
    fn keys_without_times_are_a_second_of_film_apart() {
        assert_eq!(
            Keys::new(poses(3), None).unwrap().times(),
            [1.0, 25.0, 49.0]
        );
    }

    #[test]
    fn what_is_wrong_with_times_is_named() {
        refused(1, &[1.0], "one key");
        refused(0, &[], "no keys");
        refused(3, &[1.0, 2.0], "2 times for 3 keys");
        refused(3, &[1.0, 2.0, 2.0], "keys 2 and 3 have the same time 2");
        refused(3, &[1.0, 5.0, 2.0], "key 3 at time 2 comes before key 2");
        refused(2, &[1.0, f64::NAN], "NaN is not a time");
    }

    #[test]
    fn the_first_face_that_differs_is_named() {
        let mesh =
            |last: [u32; 3]| Topology::from_triangles(5, &[[0, 1, 2], [1, 2, 3], last]).unwrap();
        let told = same_faces(&mesh([2, 3, 4]), &mesh([2, 4, 3]), 2).unwrap_err();
        assert_eq!(told.place.face, Some(3));
        assert!(same_faces(&mesh([2, 3, 4]), &mesh([2, 3, 4]), 2).is_ok());
        let fewer = Topology::from_triangles(5, &[[0, 1, 2]]).unwrap();
        assert!(same_faces(&mesh([2, 3, 4]), &fewer, 2).is_err());
    }
}
