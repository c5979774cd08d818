//! Small meshes behind the map: what g is at the middles of an adaptive grid of squares, turned as the
//! mesh panel is. Drawn on a thread of their own, so that neither the map nor the mesh waits for them.

use std::collections::HashMap;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::mpsc::Sender;
use std::sync::{Arc, Condvar, Mutex, PoisonError};
use std::time::{Duration, Instant};

use super::event::{Answer, Event};
use super::state::{MeshView, Same, Scene};
use super::theme::Look;
use super::work::start;
use crate::image::Image;
use crate::loom::Loom;
use crate::mesh::Bounds;
use crate::signal::pose_grid::{Grid, Square, pose_grid};
use crate::view::{Camera, Renderer, Style, Surface};

/// How strongly they show: the curve is what counts.
const OPACITY: f32 = 0.5;
/// A square is quartered where a second difference of g over it moves vertices by more than this share of
/// the mesh's size, root mean square.
const SHARE: f64 = 0.04;
/// Questions closer together than this are one, ..
const CALM: Duration = Duration::from_millis(30);
/// .. but nobody waits longer.
const LONGEST: Duration = Duration::from_millis(120);
/// What is ready is shown this often.
const BATCH: Duration = Duration::from_millis(250);
/// A shape so many times as large as those along the curve has burst.
const LARGEST: f64 = 1.2;
/// Places along the curve whose shapes say how large a mesh is.
const SIZES: usize = 9;

/// A small mesh: where its middle lies, how wide it is in layout units, and its picture.
pub(super) type Thumb = ([f64; 2], f64, Arc<Image>);

/// The small meshes that are wanted; two wishes that are equal have the same pictures.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct ThumbWish {
    pub(super) scene: Scene<Loom>,
    /// The part of the map that is shown.
    pub(super) window: [[f64; 2]; 2],
    /// Side of the largest squares, in layout units and in pixels.
    pub(super) side: (f64, f64),
    /// How often squares may be quartered.
    pub(super) depth: u32,
    pub(super) view: MeshView,
    pub(super) look: Look,
}

impl ThumbWish {
    /// The wish for a map that shows `window` over `width` pixels, with squares of `least` to twice as many
    /// pixels.
    pub(super) fn new(
        scene: Scene<Loom>,
        window: [[f64; 2]; 2],
        (width, least): (f64, f64),
        view: MeshView,
        look: Look,
    ) -> Self {
        let unit = width / (window[0][1] - window[0][0]);
        // A power of two, so that a closer look keeps the places of what was there.
        let side = (least / unit).log2().ceil().exp2();
        let (wires, onion) = (false, false);
        ThumbWish {
            scene,
            window,
            side: (side, side * unit),
            depth: 1,
            view: MeshView {
                wires,
                onion,
                zoom: 1.0,
                ..view
            },
            look,
        }
    }
}

/// The newest question, if nobody has taken it.
#[derive(Debug, Default)]
pub(super) struct Newest {
    waiting: Mutex<Option<(u64, ThumbWish)>>,
    more: Condvar,
}

impl Newest {
    /// Puts a question in, in place of an older one.
    pub(super) fn ask(&self, number: u64, wish: ThumbWish) {
        *self.waiting.lock().unwrap_or_else(PoisonError::into_inner) = Some((number, wish));
        self.more.notify_one();
    }

    fn is_empty(&self) -> bool {
        let waiting = self.waiting.lock().unwrap_or_else(PoisonError::into_inner);
        waiting.is_none()
    }

    /// The next question, once no newer one follows at its heels.
    fn next(&self) -> (u64, ThumbWish) {
        let mut waiting = self.waiting.lock().unwrap_or_else(PoisonError::into_inner);
        while waiting.is_none() {
            let wait = self.more.wait(waiting);
            waiting = wait.unwrap_or_else(PoisonError::into_inner);
        }
        let first = Instant::now();
        loop {
            let before = waiting.as_ref().map(|question| question.0);
            let calm = CALM.min(LONGEST.saturating_sub(first.elapsed()));
            let wait = self.more.wait_timeout(waiting, calm);
            waiting = wait.unwrap_or_else(PoisonError::into_inner).0;
            let newer = waiting.as_ref().map(|question| question.0) != before;
            if !newer || first.elapsed() >= LONGEST {
                // Only this thread takes: what was there is there.
                if let Some(question) = waiting.take() {
                    return question;
                }
            }
        }
    }
}

/// Starts a thread that draws what is asked for until nobody listens.
pub(super) fn start_thumbs(newest: Arc<Newest>, events: Sender<Event>) {
    start("thumbs", move || {
        let mut bench = Bench::default();
        loop {
            let (number, wish) = newest.next();
            let draw = AssertUnwindSafe(|| bench.answer(number, &wish, &newest, &events));
            match catch_unwind(draw) {
                Ok(true) => {}
                Ok(false) => return,
                Err(_) => bench = Bench::default(),
            }
        }
    });
}

/// Buffers, and pictures of earlier answers that may be used again.
#[derive(Debug, Default)]
pub(super) struct Bench {
    renderer: Renderer,
    kept: HashMap<[u64; 3], Arc<Image>>,
    of: Option<ThumbWish>,
    bounds: Option<Bounds>,
}

impl Bench {
    /// Draws and sends, in parts where it takes long; gives up when a newer question is there. False when
    /// nobody listens.
    fn answer(
        &mut self,
        number: u64,
        wish: &ThumbWish,
        newest: &Newest,
        events: &Sender<Event>,
    ) -> bool {
        let squares = self.squares(wish);
        let (mut thumbs, mut since) = (Vec::with_capacity(squares.len()), Instant::now());
        for (index, square) in squares.iter().enumerate() {
            thumbs.extend(self.thumb(wish, square));
            let last = index + 1 == squares.len();
            if !last && !newest.is_empty() {
                return true;
            }
            if last || since.elapsed() > BATCH {
                since = Instant::now();
                let thumbs = Same::new(thumbs.clone());
                if events
                    .send(Event::Answer(Answer::Thumbs { number, thumbs }))
                    .is_err()
                {
                    return false;
                }
            }
        }
        true
    }

    /// All of them at once.
    #[cfg(test)]
    pub(super) fn all(&mut self, wish: &ThumbWish) -> Vec<Thumb> {
        let squares = self.squares(wish);
        squares
            .iter()
            .filter_map(|square| self.thumb(wish, square))
            .collect()
    }

    /// The grid of a wish; pictures that no longer fit are forgotten.
    fn squares(&mut self, wish: &ThumbWish) -> Vec<Square> {
        let like = |old: &ThumbWish| ThumbWish {
            window: old.window,
            ..wish.clone()
        };
        if !self.of.as_ref().is_some_and(|old| *old == like(old)) {
            self.kept.clear();
        }
        if !self.of.as_ref().is_some_and(|old| old.scene == wish.scene) {
            self.bounds = extent(&wish.scene.of.0);
        }
        self.of = Some(wish.clone());
        let loom = &wish.scene.of.0;
        let size = self.bounds.map_or(0.0, diagonal);
        let grid = Grid {
            window: wish.window,
            side: wish.side.0,
            depth: wish.depth,
            bend: SHARE * size * (loom.topology().vertices() as f64).sqrt(),
        };
        pose_grid(loom.pose(), &grid)
    }

    fn thumb(&mut self, wish: &ThumbWish, square: &Square) -> Option<Thumb> {
        let [x, y] = square.middle;
        let key = [x, y, square.side].map(f64::to_bits);
        if let Some(image) = self.kept.get(&key) {
            return Some((square.middle, square.side, Arc::clone(image)));
        }
        let loom = &wish.scene.of.0;
        let positions = loom.pose_at(square.middle).ok()?;
        // Far from the motion g is a guess: shapes that burst are left out.
        if diagonal(Bounds::of(&positions)?) > LARGEST * diagonal(self.bounds?) {
            return None;
        }
        let pixels = (wish.side.1 * square.side / wish.side.0).round().max(1.0) as usize;
        let mut camera = Camera::framing(&self.bounds?, 1.0);
        (camera.yaw, camera.pitch) = (wish.view.yaw, wish.view.pitch);
        let style = Style {
            background: [0; 4],
            opacity: OPACITY,
            wire: None,
            ..wish.look.mesh()
        };
        let mut image = Image::new(2 * pixels, 2 * pixels);
        let surface = Surface {
            triangles: loom.topology().triangles(),
            positions: &positions,
            colours: None,
        };
        self.renderer.overlay(surface, &camera, &style, &mut image);
        let image = Arc::new(image.halved());
        self.kept.insert(key, Arc::clone(&image));
        Some((square.middle, square.side, image))
    }
}

/// The box around some of the shapes along the curve, without root motion.
fn extent(loom: &Loom) -> Option<Bounds> {
    let last = (loom.frames() - 1) as f64;
    let times = (0..SIZES).map(|i| 1.0 + last * i as f64 / (SIZES - 1) as f64);
    let shapes = times.filter_map(|t| loom.pose_at(loom.position_at(t).ok()?).ok());
    shapes
        .filter_map(|shape| Bounds::of(&shape))
        .reduce(Bounds::join)
}

fn diagonal(bounds: Bounds) -> f64 {
    let sides = (0..3).map(|i| f64::from(bounds.max[i]) - f64::from(bounds.min[i]));
    sides.map(|side| side * side).sum::<f64>().sqrt()
}
