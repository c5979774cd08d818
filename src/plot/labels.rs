//! Names beside points: each is put where it covers least, or left out.

use super::scene::{Anchor, Label, Point, Rect, Scene};
use super::text::CAP_HEIGHT;
use super::theme::Theme;
use super::{Color, Item};

/// Room that names have taken, and what they should not cover.
pub(super) struct Labels {
    area: Rect,
    taken: Vec<Rect>,
    obstacles: Vec<Point>,
}

/// Directions in which a name may lie from its point, the preferred first: x, y, what part of the
/// text is there.
const SIDES: [(f32, f32, Anchor); 8] = [
    (1.0, 0.0, Anchor::Start),
    (0.0, -1.0, Anchor::Middle),
    (-1.0, 0.0, Anchor::End),
    (0.0, 1.0, Anchor::Middle),
    (0.7, -0.7, Anchor::Start),
    (-0.7, -0.7, Anchor::End),
    (0.7, 0.7, Anchor::Start),
    (-0.7, 0.7, Anchor::End),
];

impl Labels {
    /// Names must lie in `area` and should not cover `obstacles`.
    pub(super) fn new(area: Rect, obstacles: Vec<Point>) -> Self {
        Labels {
            area,
            taken: Vec::new(),
            obstacles,
        }
    }

    /// Writes `text` beside `at`, `distance` pixels away, where it covers the fewest obstacles; not at
    /// all where it would meet another name or leave the area. Says whether it was written.
    pub(super) fn write(
        &mut self,
        scene: &mut Scene,
        theme: &Theme,
        (at, distance): (Point, f32),
        (text, color): (&str, Color),
    ) -> bool {
        if theme.text <= 0.0 {
            return false;
        }
        let candidates = SIDES
            .iter()
            .map(|&side| beside(at, distance, side, theme, text, color));
        let free = candidates.filter(|label| self.is_free(&label.bounds()));
        let counted = free.map(|label| (self.covered(&label.bounds()), label));
        let Some((covered, mut label)) = counted.min_by_key(|(covered, _)| *covered) else {
            return false;
        };
        label.halo = (covered > 0).then_some(theme.background);
        self.taken.push(label.bounds().grown(0.15 * label.size)); // two numbers never read as one
        scene.items.push(Item::Text(label));
        true
    }

    fn is_free(&self, room: &Rect) -> bool {
        let corners = [[room.left, room.top], [room.right(), room.bottom()]];
        corners.iter().all(|&corner| self.area.contains(corner))
            && !self.taken.iter().any(|other| other.intersects(room))
    }

    fn covered(&self, room: &Rect) -> usize {
        let room = room.grown(1.0);
        let inside = self.obstacles.iter().filter(|&&point| room.contains(point));
        inside.count()
    }
}

fn beside(
    at: Point,
    distance: f32,
    (x, y, anchor): (f32, f32, Anchor),
    theme: &Theme,
    text: &str,
    color: Color,
) -> Label {
    let size = 0.92 * theme.text;
    let height = CAP_HEIGHT * size;
    let base = 0.5 * height * (1.0 + y); // above: the base line at the point; below: the top
    Label {
        text: text.into(),
        at: [at[0] + x * distance, at[1] + y * distance + base],
        size,
        anchor,
        color,
        upward: false,
        halo: None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_never_meet_and_stay_inside() {
        let theme = Theme::light();
        let area = Rect::new(0.0, 0.0, 120.0, 90.0);
        let mut labels = Labels::new(area, Vec::new());
        let mut scene = Scene::new(120.0, 90.0, theme.background);
        let mut written = 0;
        for i in 0..100 {
            let at = [(i * 37 % 120) as f32, (i * 53 % 90) as f32];
            let text = i.to_string();
            written += usize::from(labels.write(&mut scene, &theme, (at, 5.0), (&text, theme.ink)));
        }
        assert_eq!(written, scene.items.len());
        assert!(written > 10, "{written}");
        let bounds = |item: &Item| match item {
            Item::Text(label) => Some(label.bounds()),
            _ => None,
        };
        let boxes: Vec<Rect> = scene.items.iter().filter_map(bounds).collect();
        for (i, one) in boxes.iter().enumerate() {
            assert!(area.grown(1e-3).contains([one.left, one.top]));
            assert!(area.grown(1e-3).contains([one.right(), one.bottom()]));
            assert!(boxes[..i].iter().all(|other| !other.intersects(one)));
        }
    }

    #[test]
    fn a_name_turns_away_from_what_it_would_cover() {
        let theme = Theme::light();
        let right: Vec<Point> = (0..20).map(|i| [50.0 + i as f32, 50.0]).collect();
        let mut labels = Labels::new(Rect::new(0.0, 0.0, 100.0, 100.0), right);
        let mut scene = Scene::new(100.0, 100.0, theme.background);
        labels.write(&mut scene, &theme, ([50.0, 50.0], 6.0), ("12", theme.ink));
        assert_eq!(labels.covered(&labels.taken[0]), 0);
    }
}
