//! Work on other threads: pictures (the newest question of each panel counts), and opening, fitting and
//! writing, one after another.

use std::collections::VecDeque;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::mpsc::Sender;
use std::sync::{Arc, Condvar, Mutex, PoisonError};
use std::thread;

use ratatui::layout::Rect;

use super::errors::Errors;
use super::event::{Answer, Event};
use super::state::{MeshView, Same, Scene, Signals};
use super::theme::Look;
use super::thumbs::Thumb;
use crate::image::Image;
use crate::loom::{Loom, Scratch};
use crate::mesh::{Bounds, FrameSource, Sequence, Topology};
use crate::pipeline::{KeyMotion, Statistics};
use crate::plot::{
    self, Chart, Panel, Plane, Series, Theme, TimeSignals, Tint, chart, pose_space, raster,
    spectrum, time_signals,
};
use crate::view::{Camera, Renderer, Style, Surface, Wire};

/// So many pixels in height show all signals, fewer without letters the most important ones.
const ALL_SIGNALS: usize = 90;
/// Opacity of the frames before and after.
const SKIN: f32 = 0.22;
/// How far away they are, in frames.
const SKINS: [f64; 4] = [-4.0, 4.0, -2.0, 2.0];

/// A picture that is wanted: two wishes that are equal have the same picture.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Wish {
    pub(super) subject: Subject,
    /// Width and height in pixels.
    pub(super) size: (usize, usize),
    /// Size of letters in pixels; 0: none.
    pub(super) text: f32,
    /// Plots are drawn so many times as fine as they are shown.
    pub(super) fine: usize,
    /// Whether it is to be there soon rather than fine.
    pub(super) coarse: bool,
    pub(super) look: Look,
}

/// What a picture shows.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Subject {
    /// The map, a part of it, and the time between the marks.
    Map {
        signals: Same<Signals>,
        window: Option<[[f64; 2]; 2]>,
        span: Option<[f64; 2]>,
        thumbs: Option<Same<Vec<Thumb>>>,
        /// Tangents of a key in hand: from where to where.
        arms: Vec<[[f64; 2]; 2]>,
    },
    /// The signals over time.
    Times(Same<Signals>),
    /// The shares of the modes of poses.
    Shares(Scene<Statistics>),
    /// The mesh.
    Mesh {
        pose: Pose,
        view: MeshView,
        /// Vertices are coloured by how far they are from these frames.
        capture: Option<Scene<Sequence>>,
        /// What is shown beside it.
        before: Option<Pose>,
    },
}

/// Which mesh.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Pose {
    /// A frame of a capture, from 0.
    Frame(Scene<Sequence>, usize),
    /// psi(t).
    Time(Scene<Loom>, f64),
    /// g at a place of the map.
    Place(Scene<Loom>, [f64; 2]),
    /// A motion through keys at a time.
    Motion(Scene<KeyMotion>, f64),
    /// A place of the plane of keys.
    KeyPlace(Scene<KeyMotion>, [f64; 2]),
    /// A place of the plane of the first two modes.
    Modes(Scene<Statistics>, [f64; 2]),
}

/// A picture and where data lies in it.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Picture {
    pub(super) image: Image,
    /// One for a map, one for each of the time signals, none for a mesh.
    pub(super) planes: Vec<Plane>,
    /// Of a map, what it shows: what is pointed at on it is this.
    pub(super) of: Option<Same<Signals>>,
    /// What is to be said about it.
    pub(super) note: String,
    /// Whether a finer one is to follow.
    pub(super) coarse: bool,
}

impl Picture {
    /// The pixel in the middle of a cell of `canvas`, which the picture fills.
    pub(super) fn pixel(&self, canvas: Rect, (column, row): (u16, u16)) -> [f32; 2] {
        let share = |at: u16, start: u16, length: u16| {
            (f32::from(at) - f32::from(start) + 0.5) / f32::from(length.max(1))
        };
        [
            share(column, canvas.x, canvas.width) * self.image.width as f32,
            share(row, canvas.y, canvas.height) * self.image.height as f32,
        ]
    }
}

/// Buffers that pictures are drawn with.
#[derive(Debug, Default)]
pub(super) struct Brush {
    renderer: Renderer,
    scratch: Scratch,
    positions: Vec<f32>,
    /// Of the vertices, where they are coloured.
    colours: Vec<[u8; 3]>,
    errors: Option<Errors>,
}

impl Brush {
    /// The picture of a wish.
    pub(super) fn paint(&mut self, wish: &Wish) -> Picture {
        let theme = wish.look.plot(wish.text);
        let fine = wish.fine;
        let (width, height) = ((fine * wish.size.0) as f32, (fine * wish.size.1) as f32);
        match &wish.subject {
            Subject::Map {
                signals,
                window,
                span,
                thumbs,
                arms,
            } => {
                let mut map = signals.0.map.clone();
                (map.window, map.span) = (*window, *span);
                map.arms.clone_from(arms);
                if let Some(thumbs) = thumbs {
                    map.pictures.clone_from(&thumbs.0);
                }
                if map.curve.is_empty() {
                    map.window = Some(map.window.unwrap_or_else(|| map.ranges()));
                }
                if wish.text == 0.0 {
                    // Marks are letters on top.
                    map.frames.clear();
                    map.reached.clear();
                    map.sites.clear();
                    map.controls.clear();
                    map.pins.clear();
                }
                let (scene, plane) = pose_space(&map, width, height, &theme);
                Picture {
                    of: Some(signals.clone()),
                    coarse: wish.coarse,
                    ..picture(&scene, vec![plane], fine)
                }
            }
            Subject::Times(signals) if wish.text == 0.0 && wish.size.1 < ALL_SIGNALS => {
                let (scene, planes) = chart(&coarse(&signals.0.times), width, height, &theme);
                picture(&scene, planes, fine)
            }
            Subject::Shares(scene) => {
                let (scene, planes) = spectrum(&scene.of.0.shares(), width, height, &theme);
                picture(&scene, planes, fine)
            }
            Subject::Times(signals) => {
                let (scene, planes) = time_signals(&signals.0.times, width, height, &theme);
                picture(&scene, planes, fine)
            }
            Subject::Mesh {
                pose,
                view,
                capture,
                before,
            } => {
                let note = self.colour(pose, capture.as_ref());
                let half = ((wish.size.0 / 2).max(1), wish.size.1);
                let size = if before.is_some() { half } else { wish.size };
                let mut image = self.mesh(pose, view, wish, size, &theme);
                if let Some(before) = before {
                    self.colours.clear();
                    let left = self.mesh(before, view, wish, size, &theme);
                    image = beside(&left, &image, wish.size);
                }
                Picture {
                    image,
                    planes: Vec::new(),
                    of: None,
                    note,
                    coarse: wish.coarse,
                }
            }
        }
    }

    /// Prepares colours for the vertices' errors; says what they mean.
    fn colour(&mut self, pose: &Pose, capture: Option<&Scene<Sequence>>) -> String {
        self.colours.clear();
        let (Some(capture), Pose::Time(scene, t)) = (capture, pose) else {
            return String::new();
        };
        if !self
            .errors
            .as_ref()
            .is_some_and(|errors| errors.is_of(scene, capture))
        {
            self.errors = Some(Errors::new(scene, capture));
        }
        let Some(errors) = &mut self.errors else {
            return String::new();
        };
        errors.colour(*t, &mut self.colours)
    }

    fn mesh(
        &mut self,
        pose: &Pose,
        view: &MeshView,
        wish: &Wish,
        size: (usize, usize),
        theme: &Theme,
    ) -> Image {
        // Few pixels are drawn twice as fine, so that outlines are smooth.
        let fine = if size.0 * size.1 < 60_000 && !wish.coarse {
            2
        } else {
            1
        };
        let mut image = Image::new(fine * size.0, fine * size.1);
        let camera = camera(&pose.bounds(), view, size);
        let wire = view.wires.then(|| Wire {
            colour: rgb(theme.series[0].0),
            width: fine as f32,
        });
        let style = Style {
            wire,
            ..wish.look.mesh()
        };
        image.fill(style.background);
        if let (true, Pose::Time(scene, t)) = (view.onion, pose) {
            let times = SKINS.map(|offset| t + offset);
            let last = scene.of.0.frames() as f64;
            let there = times.into_iter().filter(|t| (1.0..=last).contains(t));
            let faint = Style {
                opacity: SKIN,
                wire: None,
                ..style
            };
            let colours = std::mem::take(&mut self.colours);
            for time in there {
                self.layer(
                    &Pose::Time(scene.clone(), time),
                    &camera,
                    &faint,
                    &mut image,
                );
            }
            self.colours = colours;
        }
        self.layer(pose, &camera, &style, &mut image);
        if fine == 2 { image.halved() } else { image }
    }

    fn layer(&mut self, pose: &Pose, camera: &Camera, style: &Style, image: &mut Image) {
        let topology = Arc::clone(pose.topology());
        self.positions.resize(3 * topology.vertices(), 0.0);
        match pose {
            Pose::Frame(scene, frame) => self.positions.copy_from_slice(scene.of.0.frame(*frame)),
            Pose::Time(scene, t) => {
                let Ok(()) = scene
                    .of
                    .0
                    .evaluate(*t, &mut self.scratch, &mut self.positions)
                else {
                    return;
                };
            }
            Pose::Place(scene, at) => match scene.of.0.pose_at(*at) {
                Ok(positions) => self.positions = positions,
                Err(_) => return,
            },
            Pose::Motion(scene, time) => {
                narrow(&scene.of.0.motion().at(*time), &mut self.positions);
            }
            Pose::KeyPlace(scene, at) => match scene.of.0.shape_of(*at) {
                Some(positions) => narrow(&positions, &mut self.positions),
                None => return,
            },
            Pose::Modes(scene, at) => match scene.of.0.shape_of(*at) {
                Ok(shape) => self.positions = shape.output.positions,
                Err(_) => return,
            },
        }
        let surface = Surface {
            triangles: topology.triangles(),
            positions: &self.positions,
            colours: (self.colours.len() == topology.vertices()).then_some(&self.colours),
        };
        self.renderer.overlay(surface, camera, style, image);
    }
}

/// Positions in single precision.
fn narrow(wide: &[f64], positions: &mut [f32]) {
    for (narrow, wide) in positions.iter_mut().zip(wide) {
        *narrow = *wide as f32;
    }
}

/// A scene drawn finer than it is shown, and its planes in pixels that are shown.
fn picture(scene: &plot::Scene, planes: Vec<Plane>, fine: usize) -> Picture {
    let image = raster(scene, 1.0);
    let image = if fine == 2 { image.halved() } else { image };
    let scale = 1.0 / fine as f32;
    let planes = planes.into_iter().map(|plane| scaled(plane, scale));
    Picture {
        planes: planes.collect(),
        image,
        of: None,
        note: String::new(),
        coarse: false,
    }
}

fn scaled(mut plane: Plane, scale: f32) -> Plane {
    let area = plane.area;
    plane.area = plot::Rect::new(
        scale * area.left,
        scale * area.top,
        scale * area.width,
        scale * area.height,
    );
    plane.x.pixels = plane.x.pixels.map(|pixel| scale * pixel);
    plane.y.pixels = plane.y.pixels.map(|pixel| scale * pixel);
    plane
}

/// The signals that can be read in few pixels: coordinates and speed.
fn coarse(signals: &TimeSignals) -> Chart {
    let line = |tint, values: &mut dyn Iterator<Item = f64>| {
        let points = signals.times.iter().zip(values);
        let points = points.map(|(&t, value)| [t, value]).collect();
        Series::line("", Tint::Series(tint), points)
    };
    let coordinate = |axis: usize| line(2 * axis, &mut signals.position.iter().map(|p| p[axis]));
    Chart {
        range: signals.window,
        bands: signals.advice.clone(),
        panels: vec![
            Panel {
                series: vec![coordinate(0), coordinate(1)],
                share: 1.6,
                ..Panel::default()
            },
            Panel {
                from_zero: true,
                series: vec![line(3, &mut signals.speed.iter().copied())],
                ..Panel::default()
            },
        ],
        ..Chart::default()
    }
}

impl Pose {
    fn bounds(&self) -> Bounds {
        match self {
            Pose::Frame(scene, _) => scene.bounds,
            Pose::Time(scene, _) | Pose::Place(scene, _) => scene.bounds,
            Pose::Motion(scene, _) | Pose::KeyPlace(scene, _) => scene.bounds,
            Pose::Modes(scene, _) => scene.bounds,
        }
    }

    fn topology(&self) -> &Arc<Topology> {
        match self {
            Pose::Frame(scene, _) => scene.of.0.topology(),
            Pose::Time(scene, _) | Pose::Place(scene, _) => scene.of.0.topology(),
            Pose::Motion(scene, _) | Pose::KeyPlace(scene, _) => scene.of.0.topology(),
            Pose::Modes(scene, _) => scene.of.0.topology(),
        }
    }
}

/// Framed from the first direction, then turned: orbiting does not change the size.
fn camera(bounds: &Bounds, view: &MeshView, size: (usize, usize)) -> Camera {
    let mut camera = Camera::framing(bounds, size.0 as f64 / size.1.max(1) as f64);
    (camera.yaw, camera.pitch) = (view.yaw, view.pitch);
    camera.zoom(view.zoom);
    camera
}

/// Two pictures side by side, in one of that size.
fn beside(left: &Image, right: &Image, (width, height): (usize, usize)) -> Image {
    let mut both = Image::new(width, height);
    for (y, row) in both.rgba.chunks_exact_mut(4 * width.max(1)).enumerate() {
        for (image, start) in [(left, 0), (right, left.width)] {
            let from = &image.rgba[4 * image.width * y..4 * image.width * (y + 1)];
            let (start, end) = (4 * start, (4 * (start + image.width)).min(row.len()));
            row[start..end].copy_from_slice(&from[..end - start]);
        }
        // An odd last column.
        if width > 2 * right.width {
            row.copy_within(4 * (width - 2)..4 * (width - 1), 4 * (width - 1));
        }
    }
    both
}

fn rgb(colour: [u8; 4]) -> [u8; 3] {
    [colour[0], colour[1], colour[2]]
}

/// Questions of the panels that nobody has begun to answer: at most one each.
#[derive(Debug, Default)]
pub(super) struct Mailbox {
    waiting: Mutex<VecDeque<(usize, u64, Wish)>>,
    more: Condvar,
}

impl Mailbox {
    /// Puts a question in; an older one of the same panel is replaced.
    pub(super) fn ask(&self, panel: usize, number: u64, wish: Wish) {
        let mut waiting = self.waiting.lock().unwrap_or_else(PoisonError::into_inner);
        match waiting.iter_mut().find(|(other, ..)| *other == panel) {
            Some(old) => *old = (panel, number, wish),
            None => waiting.push_back((panel, number, wish)),
        }
        self.more.notify_one();
    }

    fn next(&self) -> (usize, u64, Wish) {
        let mut waiting = self.waiting.lock().unwrap_or_else(PoisonError::into_inner);
        loop {
            if let Some(question) = waiting.pop_front() {
                return question;
            }
            waiting = self
                .more
                .wait(waiting)
                .unwrap_or_else(PoisonError::into_inner);
        }
    }
}

/// Starts a thread that draws what is asked for in `mailbox` until nobody listens.
pub(super) fn start_painter(mailbox: Arc<Mailbox>, events: Sender<Event>) {
    let work = move || {
        let mut brush = Brush::default();
        loop {
            let (panel, number, wish) = mailbox.next();
            let drawn = catch_unwind(AssertUnwindSafe(|| brush.paint(&wish)));
            let Ok(picture) = drawn else {
                brush = Brush::default();
                continue;
            };
            let picture = Arc::new(picture);
            let answer = Answer::Drawn {
                panel,
                number,
                picture,
            };
            if events.send(Event::Answer(answer)).is_err() {
                return;
            }
        }
    };
    start("painter", work);
}

/// Starts a thread of that name. The name of worker threads begins with "studio", so that their panics
/// leave the screen alone.
pub(super) fn start(name: &str, work: impl FnOnce() + Send + 'static) {
    let builder = thread::Builder::new().name(format!("studio {name}"));
    // A machine without threads cannot run the studio at all; the rayon pool would have failed before.
    let _ = builder.spawn(work);
}
