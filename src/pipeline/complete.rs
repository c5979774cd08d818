//! Key poses to motion, in the words of the command line and of recipes.

use std::sync::Arc;

use super::key::Key;
use super::key_motion::KeyControls;
use super::value::Frames;
use crate::diag::{Diagnostic, Result, Warned};
use crate::inbetween::{
    Boundary, CompleteOptions, GhostOptions, GhostSize, Handle, Keys, Lift, Motion, MotionFrames,
    Velocity, complete as through,
};
use crate::mesh::{FrameSource, Sequence};
use crate::sample::Times;
use crate::task::Task;

/// What is asked of a completion; what is left out has its default.
#[derive(Debug, Clone, Default)]
pub struct CompleteRequest {
    /// When the keys are reached, in frames.
    pub times: Option<Vec<f64>>,
    /// Which frames are made, in the same time; every whole step from the first key on by default.
    pub at: Times,
    /// Frames per second of the result.
    pub fps: Option<f64>,
    /// The shape space's name.
    pub space: Option<String>,
    /// natural, periodic or hermite.
    pub boundary: Option<String>,
    /// Of a periodic motion that travels: none or rigid.
    pub drift: Option<String>,
    /// Where Hermite ends have their velocities from.
    pub velocities: Velocities,
    /// One a key, or one for all.
    pub tension: Vec<f64>,
    /// One a key, or one for all.
    pub continuity: Vec<f64>,
    /// One a key, or one for all.
    pub bias: Vec<f64>,
    /// By what share of the range of neighbouring keys a coordinate may leave it.
    pub overshoot: Option<f64>,
    /// Faces of the ghost mesh, as a number, "auto" or "off".
    pub ghost: Option<String>,
    /// solve, transfer or direct.
    pub lift: Option<String>,
    /// Whether what the ghost misses at the keys is kept.
    pub residual: Option<bool>,
}

/// Shapes that velocities are the differences of.
#[derive(Debug, Clone, Default)]
pub struct Velocities {
    /// At the first key: one pose that it moves towards, or two that are left and reached.
    pub start: Option<Frames>,
    /// At the last key.
    pub end: Option<Frames>,
    /// A motion whose own ends have the velocities.
    pub both: Option<Frames>,
}

/// The frames that a completion of `keys` gives.
///
/// # Errors
/// As [`motion`]; times that make no frames.
pub fn complete(
    keys: &Sequence,
    request: &CompleteRequest,
    task: &Task,
) -> Result<Warned<MotionFrames>> {
    let times = request.times_of(keys)?;
    let mut warnings = Vec::new();
    let motion = motion(keys, request, task)?.unpack(&mut warnings);
    Ok(Warned {
        output: MotionFrames::new(Arc::new(motion), times, request.fps.or(keys.fps())),
        warnings,
    })
}

/// The motion through `keys`.
///
/// # Errors
/// A word of the request is unknown; as [`crate::inbetween::complete()`].
pub fn motion(keys: &Sequence, request: &CompleteRequest, task: &Task) -> Result<Warned<Motion>> {
    let keys = request.keys(keys)?;
    through(&keys, &request.options(&keys)?, task)
}

impl CompleteRequest {
    fn keys(&self, poses: &Sequence) -> Result<Keys> {
        Keys::new(poses.clone(), self.times.clone())
    }

    /// The times of the frames.
    ///
    /// # Errors
    /// The keys' own times are faulty, or no frames are asked for.
    pub fn times_of(&self, poses: &Sequence) -> Result<Vec<f64>> {
        let [first, last] = self.keys(poses)?.ends();
        self.at.between(first, last)
    }

    /// Times and handles of the keys, each given or by default.
    ///
    /// # Errors
    /// Times that do not suit the keys, another number of handles than keys.
    pub fn controls(&self, poses: &Sequence) -> Result<KeyControls> {
        let times = self.keys(poses)?.times().to_vec();
        let mut handles = self.handles(times.len())?;
        handles.resize(times.len(), Handle::default());
        Ok(KeyControls { times, handles })
    }

    /// The same with other times and handles.
    #[must_use]
    pub fn with(&self, controls: &KeyControls) -> Self {
        let each = |of: fn(&Handle) -> f64| controls.handles.iter().map(of).collect();
        CompleteRequest {
            times: Some(controls.times.clone()),
            tension: each(|handle| handle.tension),
            continuity: each(|handle| handle.continuity),
            bias: each(|handle| handle.bias),
            ..self.clone()
        }
    }

    /// Whether another request asks for the same but for times, handles, frames and their rate: then
    /// coordinates and factors are the same. Given velocities never are.
    pub(super) fn differs_in_controls(&self, other: &Self) -> bool {
        let rest = |request: &Self| {
            let Velocities { start, end, both } = &request.velocities;
            let given = start.is_some() || end.is_some() || both.is_some();
            let rest = CompleteRequest {
                times: None,
                at: Times::default(),
                fps: None,
                velocities: Velocities::default(),
                tension: Vec::new(),
                continuity: Vec::new(),
                bias: Vec::new(),
                overshoot: None,
                ..request.clone()
            };
            (!given).then(|| format!("{rest:?}"))
        };
        rest(self).is_some_and(|own| rest(other) == Some(own))
    }

    /// Whether the motion goes round.
    pub(super) fn is_periodic(&self) -> bool {
        self.boundary.as_deref() == Some("periodic")
    }

    /// Whether its ends have given velocities.
    pub(super) fn is_hermite(&self) -> bool {
        self.boundary.as_deref() == Some("hermite")
    }

    /// The key of the result.
    pub(super) fn key(&self, keys: &Frames) -> Key {
        let mut words = self.clone();
        words.velocities = Velocities::default();
        let mut key = keys.then("complete").text(&format!("{words:?}"));
        let Velocities { start, end, both } = &self.velocities;
        for shapes in [start, end, both] {
            key = match shapes {
                Some(shapes) => key.key(shapes.key),
                None => key.text("none"),
            };
        }
        key.finish()
    }

    fn options(&self, keys: &Keys) -> Result<CompleteOptions> {
        let default = CompleteOptions::default();
        Ok(CompleteOptions {
            space: self.space.clone().unwrap_or(default.space),
            boundary: self.boundary(keys)?,
            handles: self.handles(keys.count())?,
            overshoot: self.overshoot,
            ghost: self.ghost()?,
        })
    }

    fn ghost(&self) -> Result<GhostOptions> {
        let default = GhostOptions::default();
        Ok(GhostOptions {
            size: self.ghost.as_deref().map_or(Ok(default.size), ghost_size)?,
            lift: match self.lift.as_deref() {
                None => default.lift,
                Some("solve") => Lift::Solve,
                Some("transfer") => Lift::Transfer,
                Some("direct") => Lift::Direct,
                Some(other) => return unknown("lift", other, "solve, transfer, direct"),
            },
            residual: self.residual.unwrap_or(default.residual),
        })
    }

    fn boundary(&self, keys: &Keys) -> Result<Boundary> {
        let drift = match self.drift.as_deref() {
            None | Some("none") => false,
            Some("rigid") => true,
            Some(other) => return unknown("drift", other, "none, rigid"),
        };
        let name = self.boundary.as_deref().unwrap_or("natural");
        let Velocities { start, end, both } = &self.velocities;
        let given = start.is_some() || end.is_some() || both.is_some();
        if given && name != "hermite" {
            return Diagnostic::error(format!("{name} ends take no velocities"))
                .hint("--boundary hermite (boundary: \"hermite\") does")
                .err();
        }
        if drift && name != "periodic" {
            return Diagnostic::error(format!("{name} ends have no drift to split off"))
                .hint("--boundary periodic (boundary: \"periodic\") does")
                .err();
        }
        match name {
            "natural" => Ok(Boundary::Natural),
            "periodic" => Ok(Boundary::Periodic { drift }),
            "hermite" => Ok(Boundary::Hermite {
                start: self.velocity(start, false, keys)?,
                end: self.velocity(end, true, keys)?,
            }),
            other => unknown("boundary", other, "natural, periodic, hermite"),
        }
    }

    /// The velocity of an end that poses were given for, or else the motion's.
    fn velocity(
        &self,
        poses: &Option<Frames>,
        last: bool,
        keys: &Keys,
    ) -> Result<Option<Velocity>> {
        let topology = keys.poses().topology();
        if let Some(poses) = poses {
            return Velocity::of_poses(&poses.value, topology).map(Some);
        }
        let [first, end] = keys.ends();
        let of = |motion: &Frames| Velocity::at_end(&motion.value, topology, last, end - first);
        self.velocities.both.as_ref().map(of).transpose()
    }

    /// One handle a key where any number is given.
    fn handles(&self, keys: usize) -> Result<Vec<Handle>> {
        let given = [
            ("tension", &self.tension),
            ("continuity", &self.continuity),
            ("bias", &self.bias),
        ];
        for (name, numbers) in given {
            if numbers.len() > 1 && numbers.len() != keys {
                return Diagnostic::error(format!(
                    "{} numbers of {name} for {keys} keys",
                    numbers.len()
                ))
                .hint("give one for all keys, or one for each")
                .err();
            }
        }
        let none = given.iter().all(|(_, numbers)| numbers.is_empty());
        let of = |numbers: &[f64], key: usize| match numbers {
            [] => 0.0,
            [one] => *one,
            each => each[key],
        };
        let handle = |key| Handle {
            tension: of(&self.tension, key),
            continuity: of(&self.continuity, key),
            bias: of(&self.bias, key),
        };
        Ok((0..if none { 0 } else { keys }).map(handle).collect())
    }
}

fn ghost_size(text: &str) -> Result<GhostSize> {
    match (text, text.parse::<usize>()) {
        ("auto", _) => Ok(GhostSize::Auto),
        ("off", _) => Ok(GhostSize::Off),
        (_, Ok(faces)) if faces > 0 => Ok(GhostSize::Faces(faces)),
        _ => unknown("ghost size", text, "a number of faces, auto, off"),
    }
}

fn unknown<T>(what: &str, name: &str, known: &str) -> Result<T> {
    Diagnostic::error(format!("no {what} `{name}`"))
        .hint(format!("choose {known}"))
        .err()
}
