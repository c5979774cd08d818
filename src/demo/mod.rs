//! Built-in captures, generated: the same bytes on every run and every machine.
//!
//! Nothing is read from files. Angles go through `libm` and sums through plain loops, never through
//! the platform's own sine or a thread pool, so that two machines agree to the last bit.

mod bar;
mod bend;
mod cactus;
mod curve;
mod face;
mod flag;
mod horse;
mod implicit;
mod jelly;
mod lattice;
mod skin;
mod surface_nets;

use crate::mesh::Sequence;
use crate::task::{Cancelled, Task};

pub use bar::pose as bar_pose;
pub use face::NAMES as FACE_POSES;
pub use horse::{Build, horse_gallop, horse_poses};

/// What the frames of a capture are to each other.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// A motion: frames in the order of time.
    Motion,
    /// Separate shapes: their order means nothing.
    Poses,
}

/// A built-in capture and how to look at it. Up is y, lengths are metres.
#[derive(Debug, Clone, Copy)]
pub struct Demo {
    /// What it is called on the command line.
    pub name: &'static str,
    /// One line for a list of captures.
    pub about: &'static str,
    /// A motion, which has frames per second, or poses, which have none.
    pub kind: Kind,
    /// Whether it travels over the ground, so that its root motion is worth taking apart.
    pub travels: bool,
    /// A good first view: yaw and pitch of an orbiting camera, in radians.
    pub view: [f64; 2],
    /// Makes it, unless the task is cancelled.
    pub make: fn(&Task) -> Result<Sequence, Cancelled>,
}

/// All built-in captures, the one to start with first.
pub const DEMOS: &[Demo] = &[
    Demo {
        name: "gallop",
        about: "a horse gallops in place, two unequal strides",
        kind: Kind::Motion,
        travels: false,
        view: [0.35, 0.1],
        make: horse::gallop,
    },
    Demo {
        name: "walk",
        about: "the horse walks over the ground",
        kind: Kind::Motion,
        travels: true,
        view: [0.35, 0.1],
        make: horse::walk,
    },
    Demo {
        name: "flag",
        about: "a flag waves in the wind, simulated cloth",
        kind: Kind::Motion,
        travels: false,
        view: [0.5, 0.2],
        make: flag::generate,
    },
    Demo {
        name: "jelly",
        about: "a rabbit of jelly is lifted by its back and dropped",
        kind: Kind::Motion,
        travels: false,
        view: [0.5, 0.2],
        make: jelly::generate,
    },
    Demo {
        name: "face",
        about: "a head with nine expressions: neutral, anger, cry, grin, laugh, rage, sad, smile, surprise",
        kind: Kind::Poses,
        travels: false,
        view: [0.3, 0.05],
        make: face::generate,
    },
    Demo {
        name: "bar",
        about: "a square bar bends to 170 degrees, twists by half a turn, then does both",
        kind: Kind::Motion,
        travels: false,
        view: [0.4, 0.3],
        make: bar::generate,
    },
    Demo {
        name: "cactus",
        about: "three poses of a cactus, bent to the left, to the front and to the right",
        kind: Kind::Poses,
        travels: false,
        view: [0.3, 0.2],
        make: cactus::generate,
    },
];

impl Demo {
    /// The capture of that name.
    pub fn find(name: &str) -> Option<&'static Demo> {
        DEMOS.iter().find(|demo| demo.name == name)
    }

    /// Makes it.
    pub fn generate(&self) -> Sequence {
        undisturbed(self.make)
    }
}

/// What is made where nobody cancels.
fn undisturbed(make: impl FnOnce(&Task) -> Result<Sequence, Cancelled>) -> Sequence {
    match make(&Task::default()) {
        Ok(sequence) => sequence,
        Err(Cancelled) => unreachable!("nobody else has this task"),
    }
}

#[cfg(test)]
mod tests;
