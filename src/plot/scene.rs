//! What a figure is made of: primitives in pixels, x to the right, y down, later ones above earlier
//! ones. No primitive knows what it stands for.

use std::sync::Arc;

use crate::image::Image;

/// A place in pixels.
pub type Point = [f32; 2];

/// A colour in sRGB with straight (not premultiplied) alpha.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Color(pub [u8; 4]);

impl Color {
    /// An opaque colour from `0xRRGGBB`.
    pub const fn hex(rgb: u32) -> Self {
        Color([(rgb >> 16) as u8, (rgb >> 8) as u8, rgb as u8, 255])
    }

    /// The same colour with opacity `alpha` in \[0, 1\].
    #[must_use]
    pub fn with_alpha(self, alpha: f32) -> Self {
        let [r, g, b, _] = self.0;
        Color([r, g, b, (alpha.clamp(0.0, 1.0) * 255.0).round() as u8])
    }
}

/// A rectangle in pixels with its sides along the axes.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Rect {
    /// Smallest x.
    pub left: f32,
    /// Smallest y, which is the upper side.
    pub top: f32,
    /// Extent in x, not negative.
    pub width: f32,
    /// Extent in y, not negative.
    pub height: f32,
}

impl Rect {
    /// From the upper left corner and the extents; negative extents become 0.
    pub fn new(left: f32, top: f32, width: f32, height: f32) -> Self {
        Rect {
            left,
            top,
            width: width.max(0.0),
            height: height.max(0.0),
        }
    }

    /// Largest x.
    pub fn right(&self) -> f32 {
        self.left + self.width
    }

    /// Largest y, which is the lower side.
    pub fn bottom(&self) -> f32 {
        self.top + self.height
    }

    /// Whether the insides of both meet.
    pub fn intersects(&self, other: &Rect) -> bool {
        self.left < other.right()
            && other.left < self.right()
            && self.top < other.bottom()
            && other.top < self.bottom()
    }

    /// Whether `point` lies inside or on a side.
    pub fn contains(&self, point: Point) -> bool {
        (self.left..=self.right()).contains(&point[0])
            && (self.top..=self.bottom()).contains(&point[1])
    }

    /// Larger by `margin` on every side (smaller if it is negative).
    #[must_use]
    pub fn grown(&self, margin: f32) -> Self {
        let (width, height) = (self.width + 2.0 * margin, self.height + 2.0 * margin);
        Rect::new(self.left - margin, self.top - margin, width, height)
    }
}

impl Rect {
    /// All lengths times `scale`.
    #[must_use]
    pub(super) fn scaled(&self, scale: f32) -> Self {
        let [left, top, width, height] =
            [self.left, self.top, self.width, self.height].map(|length| length * scale);
        Rect::new(left, top, width, height)
    }
}

/// One step of a [`Path`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Segment {
    /// Begins a contour.
    Move(Point),
    /// A straight line to the point.
    Line(Point),
    /// A quadratic Bezier segment: control point, end.
    Quad(Point, Point),
    /// A cubic Bezier segment: two control points, end.
    Cubic(Point, Point, Point),
    /// A straight line back to where the contour began.
    Close,
}

/// Contours; filled by the nonzero rule.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Path(pub Vec<Segment>);

impl Path {
    /// An open polyline through `points`.
    pub fn polyline(points: &[Point]) -> Self {
        let rest = points.iter().skip(1).map(|&point| Segment::Line(point));
        let first = points.iter().take(1).map(|&point| Segment::Move(point));
        Path(first.chain(rest).collect())
    }

    /// The closed polygon with corners `points`.
    pub fn polygon(points: &[Point]) -> Self {
        let mut path = Path::polyline(points);
        path.0.push(Segment::Close);
        path
    }

    /// The outline of `rect`.
    pub fn rect(rect: Rect) -> Self {
        let (right, bottom) = (rect.right(), rect.bottom());
        Path::polygon(&[
            [rect.left, rect.top],
            [right, rect.top],
            [right, bottom],
            [rect.left, bottom],
        ])
    }
}

/// How a line is drawn: round joins and ends.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stroke {
    /// Its colour.
    pub color: Color,
    /// Its width in pixels.
    pub width: f32,
    /// Lengths of dashes and of the gaps between them, in pixels; `None` is a full line.
    pub dash: Option<[f32; 2]>,
}

impl Stroke {
    /// A full line.
    pub const fn new(color: Color, width: f32) -> Self {
        Stroke {
            color,
            width,
            dash: None,
        }
    }

    /// The same line, dashed.
    #[must_use]
    pub const fn dashed(mut self, dash: f32, gap: f32) -> Self {
        self.dash = Some([dash, gap]);
        self
    }
}

/// Which part of a text lies at its place, along the direction in which it is written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Anchor {
    /// Its beginning.
    Start,
    /// Its middle.
    Middle,
    /// Its end.
    End,
}

/// A line of text. Characters outside the embedded font are drawn as `?`.
#[derive(Debug, Clone, PartialEq)]
pub struct Label {
    /// The text.
    pub text: String,
    /// Where its anchor lies, on the base line.
    pub at: Point,
    /// The height of its em square in pixels.
    pub size: f32,
    /// Which part lies at `at`.
    pub anchor: Anchor,
    /// Its colour.
    pub color: Color,
    /// Whether it is written upwards (a quarter turn to the left) rather than to the right.
    pub upward: bool,
    /// A colour to set it off from what lies below it.
    pub halo: Option<Color>,
}

/// One primitive.
#[derive(Debug, Clone, PartialEq)]
pub enum Item {
    /// Contours, filled and then stroked.
    Path {
        /// The contours.
        path: Path,
        /// The inside.
        fill: Option<Color>,
        /// The line.
        stroke: Option<Stroke>,
    },
    /// A disc and its rim.
    Circle {
        /// Its centre.
        centre: Point,
        /// Its radius in pixels.
        radius: f32,
        /// The inside.
        fill: Option<Color>,
        /// The rim.
        stroke: Option<Stroke>,
    },
    /// A polyline whose colour changes along it: `colors[i]` is for the segment from `points[i]`.
    Curve {
        /// Its corners.
        points: Vec<Point>,
        /// One colour a corner.
        colors: Vec<Color>,
        /// Its width in pixels.
        width: f32,
    },
    /// A rectangle filled with evenly spaced colours that blend into each other, from its foot to its
    /// top.
    Ramp {
        /// Where.
        rect: Rect,
        /// At least two.
        colors: Vec<Color>,
    },
    /// Text.
    Text(Label),
    /// An image stretched over a rectangle.
    Picture {
        /// Where.
        rect: Rect,
        /// Its pixels.
        image: Arc<Image>,
    },
    /// What follows is drawn inside this rectangle only; `None` ends that.
    Clip(Option<Rect>),
}

/// A picture as a list of primitives.
#[derive(Debug, Clone, PartialEq)]
pub struct Scene {
    /// Extent in x, in pixels at scale 1.
    pub width: f32,
    /// Extent in y.
    pub height: f32,
    /// What lies below everything.
    pub background: Color,
    /// The primitives, the lowest first.
    pub items: Vec<Item>,
}

impl Scene {
    /// An empty picture of that size, at least 1 x 1.
    pub fn new(width: f32, height: f32, background: Color) -> Self {
        Scene {
            width: width.max(1.0),
            height: height.max(1.0),
            background,
            items: Vec::new(),
        }
    }

    /// The whole picture.
    pub fn bounds(&self) -> Rect {
        Rect::new(0.0, 0.0, self.width, self.height)
    }

    /// Fills `path`.
    pub fn fill(&mut self, path: Path, color: Color) {
        self.items.push(Item::Path {
            path,
            fill: Some(color),
            stroke: None,
        });
    }

    /// Draws the line along `path`.
    pub fn stroke(&mut self, path: Path, stroke: Stroke) {
        self.items.push(Item::Path {
            path,
            fill: None,
            stroke: Some(stroke),
        });
    }

    /// Draws a straight line.
    pub fn line(&mut self, from: Point, to: Point, stroke: Stroke) {
        self.stroke(Path::polyline(&[from, to]), stroke);
    }

    /// Fills a disc.
    pub fn disc(&mut self, centre: Point, radius: f32, color: Color) {
        self.items.push(Item::Circle {
            centre,
            radius,
            fill: Some(color),
            stroke: None,
        });
    }

    /// Draws a circle, filled with `fill`.
    pub fn ring(&mut self, centre: Point, radius: f32, fill: Option<Color>, stroke: Stroke) {
        self.items.push(Item::Circle {
            centre,
            radius,
            fill,
            stroke: Some(stroke),
        });
    }

    /// Draws what `draw` adds inside `rect` only.
    pub fn clipped(&mut self, rect: Rect, draw: impl FnOnce(&mut Scene)) {
        self.items.push(Item::Clip(Some(rect)));
        draw(self);
        self.items.push(Item::Clip(None));
    }

    /// Draws all of `other` with its upper left corner at `at`. Its background is filled too.
    pub fn place(&mut self, other: Scene, at: Point) {
        let area = Rect::new(at[0], at[1], other.width, other.height);
        self.fill(Path::rect(area), other.background);
        self.items
            .extend(other.items.into_iter().map(|item| item.moved(at)));
    }
}

impl Item {
    /// The same primitive, moved.
    #[must_use]
    fn moved(mut self, by: Point) -> Self {
        match &mut self {
            Item::Path { path, .. } => path.0.iter_mut().for_each(|segment| segment.shift(by)),
            Item::Circle { centre, .. } => shift(centre, by),
            Item::Curve { points, .. } => points.iter_mut().for_each(|point| shift(point, by)),
            Item::Text(label) => shift(&mut label.at, by),
            Item::Picture { rect, .. } | Item::Ramp { rect, .. } | Item::Clip(Some(rect)) => {
                rect.left += by[0];
                rect.top += by[1];
            }
            Item::Clip(None) => {}
        }
        self
    }
}

impl Segment {
    fn shift(&mut self, by: Point) {
        match self {
            Segment::Move(a) | Segment::Line(a) => shift(a, by),
            Segment::Quad(a, b) => [a, b].into_iter().for_each(|point| shift(point, by)),
            Segment::Cubic(a, b, c) => [a, b, c].into_iter().for_each(|point| shift(point, by)),
            Segment::Close => {}
        }
    }
}

fn shift(point: &mut Point, by: Point) {
    point[0] += by[0];
    point[1] += by[1];
}

/// The runs of equal colour along a [`Item::Curve`]: each with the corners it passes, sharing the
/// corner where the colour changes.
pub(super) fn runs<'a>(
    points: &'a [Point],
    colors: &'a [Color],
) -> impl Iterator<Item = (Color, &'a [Point])> {
    let last = points.len().min(colors.len()).saturating_sub(1);
    let mut start = 0;
    std::iter::from_fn(move || {
        (start < last).then(|| {
            let color = colors[start];
            let same = colors[start..last].iter().take_while(|&&one| one == color);
            let end = start + same.count();
            let run = &points[start..=end];
            start = end;
            (color, run)
        })
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn runs_cover_the_curve_and_share_their_ends() {
        let (a, b) = (Color::hex(1), Color::hex(2));
        let points: Vec<Point> = (0..5).map(|i| [i as f32, 0.0]).collect();
        let colors = [a, a, b, b, b];
        let found: Vec<_> = runs(&points, &colors).collect();
        assert_eq!(found, [(a, &points[0..=2]), (b, &points[2..=4])]);
        assert_eq!(runs(&points[..1], &[a]).count(), 0);
        assert_eq!(runs(&[], &[]).count(), 0);
    }

    #[test]
    fn a_placed_scene_is_moved_as_a_whole() {
        let mut inner = Scene::new(10.0, 10.0, Color::hex(0));
        inner.disc([1.0, 2.0], 1.0, Color::hex(1));
        let mut outer = Scene::new(40.0, 40.0, Color::hex(2));
        outer.place(inner, [20.0, 30.0]);
        let Some(Item::Circle { centre, .. }) = outer.items.last() else {
            panic!("the disc is last");
        };
        assert_eq!(*centre, [21.0, 32.0]);
    }
}
