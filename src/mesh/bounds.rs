//! The box around all frames.

use std::io;

use super::FrameSource;

/// An axis-aligned box, in the mesh's units.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct Bounds {
    /// The smallest x, y, z.
    pub min: [f32; 3],
    /// The largest x, y, z.
    pub max: [f32; 3],
}

impl Bounds {
    /// The box around vertices given as x y z in a row; `None` without any.
    pub fn of(positions: &[f32]) -> Option<Self> {
        positions
            .chunks_exact(3)
            .map(|vertex| {
                let point = [vertex[0], vertex[1], vertex[2]];
                Bounds {
                    min: point,
                    max: point,
                }
            })
            .reduce(Bounds::join)
    }

    /// The box around every frame of `source`; `None` without frames or vertices.
    ///
    /// # Errors
    /// A frame could not be fetched.
    pub fn of_frames(source: &dyn FrameSource) -> io::Result<Option<Self>> {
        let mut positions = vec![0.0; 3 * source.topology().vertices()];
        let mut all: Option<Bounds> = None;
        for frame in 0..source.frames() {
            source.read_frame(frame, &mut positions)?;
            let one = Bounds::of(&positions);
            all = all.into_iter().chain(one).reduce(Bounds::join);
        }
        Ok(all)
    }

    /// The smallest box around both.
    #[must_use]
    pub fn join(self, other: Self) -> Self {
        let pick = |choose: fn(f32, f32) -> f32, a: [f32; 3], b: [f32; 3]| {
            std::array::from_fn(|axis| choose(a[axis], b[axis]))
        };
        Bounds {
            min: pick(f32::min, self.min, other.min),
            max: pick(f32::max, self.max, other.max),
        }
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::mesh::{Sequence, Topology};

    #[test]
    fn all_frames_count() {
        let topology = Arc::new(Topology::from_triangles(2, &[]).unwrap());
        let positions = vec![
            0.0, 1.0, 2.0, 3.0, -4.0, 5.0, //
            -1.0, 0.0, 9.0, 0.0, 0.0, 0.0,
        ];
        let sequence = Sequence::new(Arc::clone(&topology), positions, None);
        let bounds = Bounds::of_frames(&sequence).unwrap().unwrap();
        assert_eq!(
            (bounds.min, bounds.max),
            ([-1.0, -4.0, 0.0], [3.0, 1.0, 9.0])
        );
        let nothing = Sequence::new(topology, Vec::new(), None);
        assert_eq!(Bounds::of_frames(&nothing).unwrap(), None);
    }
}
