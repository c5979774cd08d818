//! An orbiting camera: where it looks, from which side, how much it shows.

use crate::mesh::Bounds;

/// Which axis of the mesh points up on the screen.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Up {
    /// y up, z towards the viewer at yaw 0.
    #[default]
    Y,
    /// z up, -y towards the viewer at yaw 0.
    Z,
}

/// How depth shows.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub enum Projection {
    /// Parallel lines stay parallel.
    #[default]
    Orthographic,
    /// The angle, in radians, that the picture's height spans.
    Perspective(f64),
}

/// A camera on a sphere about its target. Angles in radians, lengths in the mesh's units.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Camera {
    /// The point in the middle of the picture.
    pub target: [f64; 3],
    /// Turn about the up axis; grows as the camera moves to the right.
    pub yaw: f64,
    /// Height above the horizon, in \[-pi/2, pi/2\].
    pub pitch: f64,
    /// Half of the height that is shown at the target; above 0.
    pub extent: f64,
    /// How depth shows.
    pub projection: Projection,
    /// Which axis points up.
    pub up: Up,
}

impl Default for Camera {
    /// Looks at the origin from the right and a little above, showing a height of 2.
    fn default() -> Self {
        Camera {
            target: [0.0; 3],
            yaw: 0.6,
            pitch: 0.25,
            extent: 1.0,
            projection: Projection::Orthographic,
            up: Up::Y,
        }
    }
}

impl Camera {
    /// The default direction, with all of `bounds` in a picture of that width / height.
    pub fn framing(bounds: &Bounds, aspect: f64) -> Self {
        let mut camera = Camera::default();
        camera.frame(bounds, aspect);
        camera
    }

    /// Keeps the direction; moves the target and the extent so that all of `bounds` is seen with a
    /// margin of a twentieth. `aspect` is width / height of the picture. A box that is not finite
    /// leaves the camera as it is; a point is shown at extent 1.
    pub fn frame(&mut self, bounds: &Bounds, aspect: f64) {
        let middle = |i: usize| 0.5 * (f64::from(bounds.min[i]) + f64::from(bounds.max[i]));
        let target = [middle(0), middle(1), middle(2)];
        if !target.iter().all(|value| value.is_finite()) {
            return;
        }
        self.target = target;
        let [right, up, _] = self.axes();
        let (mut half_width, mut half_height) = (0.0_f64, 0.0_f64);
        for corner in corners(bounds) {
            let offset = std::array::from_fn(|i| corner[i] - self.target[i]);
            half_width = half_width.max(dot(right, offset).abs());
            half_height = half_height.max(dot(up, offset).abs());
        }
        let extent = 1.05 * half_height.max(half_width / aspect.max(1e-6));
        self.extent = if extent > 0.0 && extent.is_finite() {
            extent
        } else {
            1.0
        };
        if let Projection::Perspective(angle) = self.projection {
            self.extent += depth_of(bounds) * 0.5 * libm::tan(0.5 * angle);
        }
    }

    /// Turns by `yaw` and `pitch` radians; the pitch stops at the poles.
    pub fn orbit(&mut self, yaw: f64, pitch: f64) {
        let turn = 2.0 * std::f64::consts::PI;
        self.yaw = (self.yaw + yaw) % turn;
        self.pitch = (self.pitch + pitch).clamp(-0.25 * turn, 0.25 * turn);
    }

    /// Shows `factor` times as much, so that 0.5 comes closer. Factors that are not above 0 are
    /// ignored.
    pub fn zoom(&mut self, factor: f64) {
        if factor > 0.0 && factor.is_finite() {
            self.extent = (self.extent * factor).clamp(1e-30, 1e30);
        }
    }

    /// Moves the target by shares of the picture's height, to the right and up on the screen.
    pub fn pan(&mut self, right: f64, up: f64) {
        let axes = self.axes();
        for i in 0..3 {
            self.target[i] += 2.0 * self.extent * (right * axes[0][i] + up * axes[1][i]);
        }
    }

    /// The unit vectors of the screen in the mesh's coordinates: right, up, towards the viewer.
    pub fn axes(&self) -> [[f64; 3]; 3] {
        let (sin_yaw, cos_yaw) = (libm::sin(self.yaw), libm::cos(self.yaw));
        let (sin_pitch, cos_pitch) = (libm::sin(self.pitch), libm::cos(self.pitch));
        let axes = [
            [cos_yaw, 0.0, -sin_yaw],
            [-sin_yaw * sin_pitch, cos_pitch, -cos_yaw * sin_pitch],
            [sin_yaw * cos_pitch, sin_pitch, cos_yaw * cos_pitch],
        ];
        match self.up {
            Up::Y => axes,
            Up::Z => axes.map(|[x, y, z]| [x, -z, y]),
        }
    }

    /// Where a point falls in a picture of that size: (x, y) in pixels from the upper left corner.
    /// None behind a perspective camera.
    pub fn project(&self, point: [f64; 3], width: usize, height: usize) -> Option<[f64; 2]> {
        let [x, y, near] = self
            .eye(width, height)
            .project(point.map(|value| value as f32));
        near.is_finite().then_some([f64::from(x), f64::from(y)])
    }

    /// The projection onto a picture of that size.
    pub(super) fn eye(&self, width: usize, height: usize) -> Eye {
        let distance = match self.projection {
            Projection::Orthographic => None,
            Projection::Perspective(angle) => {
                Some((self.extent / libm::tan(0.5 * angle.clamp(1e-3, 3.0))) as f32)
            }
        };
        Eye {
            axes: self.axes().map(|axis| axis.map(|value| value as f32)),
            target: self.target.map(|value| value as f32),
            scale: (0.5 * height as f64 / self.extent) as f32,
            middle: [0.5 * width as f32, 0.5 * height as f32],
            distance,
        }
    }
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// The eight corners of a box.
pub(super) fn corners(bounds: &Bounds) -> [[f64; 3]; 8] {
    std::array::from_fn(|corner| {
        std::array::from_fn(|i| {
            let side = if corner >> i & 1 == 0 {
                bounds.min
            } else {
                bounds.max
            };
            f64::from(side[i])
        })
    })
}

fn depth_of(bounds: &Bounds) -> f64 {
    let sides: [f64; 3] =
        std::array::from_fn(|i| f64::from(bounds.max[i]) - f64::from(bounds.min[i]));
    dot(sides, sides).sqrt()
}

/// A camera before a picture of known size, in the numbers that the projection of a point needs.
#[derive(Debug, Clone, Copy)]
pub(super) struct Eye {
    /// Right, up, towards the viewer.
    pub(super) axes: [[f32; 3]; 3],
    target: [f32; 3],
    /// Pixels per unit at the target.
    scale: f32,
    middle: [f32; 2],
    /// From the eye to the target; None for parallel light.
    pub(super) distance: Option<f32>,
}

impl Eye {
    /// Screen x and y in pixels, and nearness: larger is nearer and linear over the screen. It is
    /// the height towards the viewer of parallel cameras, 1 / depth of perspective ones; NaN where
    /// the point is not seen.
    pub(super) fn project(&self, point: [f32; 3]) -> [f32; 3] {
        let offset: [f32; 3] = std::array::from_fn(|i| point[i] - self.target[i]);
        let [x, y, z] = self
            .axes
            .map(|axis| axis[0] * offset[0] + axis[1] * offset[1] + axis[2] * offset[2]);
        let (scale, near) = match self.distance {
            None => (self.scale, z),
            Some(distance) => {
                let depth = distance - z;
                let seen = depth > 1e-3 * distance;
                let near = if seen { 1.0 / depth } else { f32::NAN };
                (self.scale * distance * near, near)
            }
        };
        [self.middle[0] + scale * x, self.middle[1] - scale * y, near]
    }

    /// The depth that belongs to a nearness.
    pub(super) fn depth(&self, near: f32) -> f32 {
        if self.distance.is_some() {
            1.0 / near
        } else {
            -near
        }
    }
}
