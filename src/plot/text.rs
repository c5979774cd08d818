//! Text as outlines of one embedded font (DejaVu Sans cut to Latin, Greek, arrows and mathematical
//! signs), so that a picture looks the same on every machine. No shaping, no kerning: the width of a
//! text is the sum of its characters' advances.

use std::collections::HashMap;
use std::sync::OnceLock;

use skrifa::instance::{LocationRef, Size};
use skrifa::outline::{DrawSettings, OutlinePen};
use skrifa::{FontRef, MetadataProvider};

use super::scene::{Anchor, Label, Path, Point, Rect, Segment};

const FONT: &[u8] = include_bytes!("DejaVuSans-subset.ttf");

/// Height of capital letters and digits, in ems: half of it below a line centres text on it.
pub const CAP_HEIGHT: f32 = 0.729;

/// How far letters reach below the base line, in ems.
const DESCENT: f32 = 0.236;

/// One character in ems, y down from the base line.
#[derive(Debug, Clone, Default)]
struct Glyph {
    advance: f32,
    outline: Vec<Segment>,
}

#[derive(Default)]
struct Face {
    glyphs: HashMap<char, Glyph>,
    unknown: Glyph,
}

/// Width of `text` in pixels when its em square is `size` pixels high.
pub fn text_width(text: &str, size: f32) -> f32 {
    let face = Face::embedded();
    size * text.chars().map(|c| face.glyph(c).advance).sum::<f32>()
}

/// The outlines of a label, where they lie in the picture.
pub(super) fn outline(label: &Label) -> Path {
    let face = Face::embedded();
    let mut pen = -anchor_share(label.anchor) * text_width(&label.text, label.size);
    let mut path = Path::default();
    for c in label.text.chars() {
        let glyph = face.glyph(c);
        let place = |p: Point| placed(label, [pen + label.size * p[0], label.size * p[1]]);
        path.0.extend(glyph.outline.iter().map(|s| s.mapped(place)));
        pen += label.size * glyph.advance;
    }
    path
}

impl Label {
    /// A rectangle that holds the text.
    pub fn bounds(&self) -> Rect {
        let width = text_width(&self.text, self.size);
        let start = -anchor_share(self.anchor) * width;
        let a = placed(self, [start, -CAP_HEIGHT * self.size]);
        let b = placed(self, [start + width, DESCENT * self.size]);
        let (left, top) = (a[0].min(b[0]), a[1].min(b[1]));
        Rect::new(left, top, (a[0] - b[0]).abs(), (a[1] - b[1]).abs())
    }
}

/// How much of a text lies before its anchor.
fn anchor_share(anchor: Anchor) -> f32 {
    match anchor {
        Anchor::Start => 0.0,
        Anchor::Middle => 0.5,
        Anchor::End => 1.0,
    }
}

/// `offset` from the label's place, turned with the label.
fn placed(label: &Label, offset: Point) -> Point {
    let [x, y] = label.at;
    if label.upward {
        [x + offset[1], y - offset[0]]
    } else {
        [x + offset[0], y + offset[1]]
    }
}

impl Segment {
    fn mapped(self, map: impl Fn(Point) -> Point) -> Self {
        match self {
            Segment::Move(a) => Segment::Move(map(a)),
            Segment::Line(a) => Segment::Line(map(a)),
            Segment::Quad(a, b) => Segment::Quad(map(a), map(b)),
            Segment::Cubic(a, b, c) => Segment::Cubic(map(a), map(b), map(c)),
            Segment::Close => Segment::Close,
        }
    }
}

impl Face {
    /// The embedded font, read once. (A font that cannot be read would draw nothing; a test holds
    /// that it can.)
    fn embedded() -> &'static Face {
        static FACE: OnceLock<Face> = OnceLock::new();
        FACE.get_or_init(|| {
            FontRef::new(FONT)
                .map(|font| Face::read(&font))
                .unwrap_or_default()
        })
    }

    fn read(font: &FontRef) -> Face {
        let unit = font.metrics(Size::unscaled(), LocationRef::default());
        let em = 1.0 / f32::from(unit.units_per_em.max(1));
        let metrics = font.glyph_metrics(Size::unscaled(), LocationRef::default());
        let outlines = font.outline_glyphs();
        let mut glyphs = HashMap::new();
        for (code, id) in font.charmap().mappings() {
            let mut pen = Pen {
                em,
                outline: Vec::new(),
            };
            if let Some(outline) = outlines.get(id) {
                let settings = DrawSettings::unhinted(Size::unscaled(), LocationRef::default());
                let _ = outline.draw(settings, &mut pen); // a glyph that cannot be drawn stays empty
            }
            let glyph = Glyph {
                advance: em * metrics.advance_width(id).unwrap_or(0.0),
                outline: pen.outline,
            };
            glyphs.extend(char::from_u32(code).map(|c| (c, glyph)));
        }
        let unknown = glyphs.get(&'?').cloned().unwrap_or_default();
        Face { glyphs, unknown }
    }

    fn glyph(&self, c: char) -> &Glyph {
        self.glyphs.get(&c).unwrap_or(&self.unknown)
    }
}

/// Collects an outline in ems with y turned down.
struct Pen {
    /// Length of a font unit in ems.
    em: f32,
    outline: Vec<Segment>,
}

impl Pen {
    fn point(&self, x: f32, y: f32) -> Point {
        [self.em * x, -self.em * y]
    }
}

impl OutlinePen for Pen {
    fn move_to(&mut self, x: f32, y: f32) {
        self.outline.push(Segment::Move(self.point(x, y)));
    }

    fn line_to(&mut self, x: f32, y: f32) {
        self.outline.push(Segment::Line(self.point(x, y)));
    }

    fn quad_to(&mut self, cx: f32, cy: f32, x: f32, y: f32) {
        let (control, end) = (self.point(cx, cy), self.point(x, y));
        self.outline.push(Segment::Quad(control, end));
    }

    fn curve_to(&mut self, ax: f32, ay: f32, bx: f32, by: f32, x: f32, y: f32) {
        let (a, b) = (self.point(ax, ay), self.point(bx, by));
        self.outline.push(Segment::Cubic(a, b, self.point(x, y)));
    }

    fn close(&mut self) {
        self.outline.push(Segment::Close);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plot::Color;

    fn label(text: &str, anchor: Anchor, upward: bool) -> Label {
        Label {
            text: text.into(),
            at: [50.0, 60.0],
            size: 10.0,
            anchor,
            color: Color::hex(0),
            upward,
            halo: None,
        }
    }

    /// The box of all points of the outline.
    fn extent(path: &Path) -> Rect {
        let mut low = [f32::INFINITY; 2];
        let mut high = [f32::NEG_INFINITY; 2];
        for segment in &path.0 {
            let (Segment::Move(p) | Segment::Line(p) | Segment::Quad(_, p)) = *segment else {
                continue;
            };
            low = [low[0].min(p[0]), low[1].min(p[1])];
            high = [high[0].max(p[0]), high[1].max(p[1])];
        }
        Rect::new(low[0], low[1], high[0] - low[0], high[1] - low[1])
    }

    #[test]
    fn every_character_that_plots_use_is_embedded() {
        let face = Face::embedded();
        for c in ('!'..='~').chain("éüψραστ₁₂×−→²⁻¹≤≈…".chars()) {
            assert!(!face.glyph(c).outline.is_empty(), "{c}");
            assert!(c == '?' || face.glyphs.contains_key(&c), "{c}");
        }
    }

    #[test]
    fn the_width_of_a_text_is_the_sum_of_its_advances() {
        let sum: f32 = "ψ(t) 12"
            .chars()
            .map(|c| text_width(&c.to_string(), 12.0))
            .sum();
        assert!((text_width("ψ(t) 12", 12.0) - sum).abs() < 1e-4); // rounding of seven f32 sums
        assert_eq!(text_width("", 12.0), 0.0);
        assert_eq!(text_width("\u{4e2d}", 12.0), text_width("?", 12.0));
    }

    #[test]
    fn outlines_lie_in_the_bounds_that_anchors_ask_for() {
        for anchor in [Anchor::Start, Anchor::Middle, Anchor::End] {
            for upward in [false, true] {
                let label = label("Hpgx8", anchor, upward);
                let (bounds, drawn) = (label.bounds(), extent(&outline(&label)));
                let room = bounds.grown(0.5); // letters may bear half a pixel outside their advance
                assert!(
                    room.contains([drawn.left, drawn.top]),
                    "{drawn:?} {bounds:?}"
                );
                assert!(
                    room.contains([drawn.right(), drawn.bottom()]),
                    "{drawn:?} {bounds:?}"
                );
            }
        }
    }

    #[test]
    fn capitals_are_as_high_as_said() {
        let drawn = extent(&outline(&label("H", Anchor::Start, false)));
        assert!((drawn.height - 10.0 * CAP_HEIGHT).abs() < 0.01);
        let drawn = extent(&outline(&label("p", Anchor::Start, false)));
        assert!(drawn.bottom() - 60.0 <= 10.0 * DESCENT);
    }
}
