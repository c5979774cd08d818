//! A scene as pixels, by tiny-skia.

use tiny_skia::{
    FillRule, FilterQuality, GradientStop, IntSize, LineCap, LineJoin, LinearGradient, Mask, Paint,
    PathBuilder, Pixmap, PixmapPaint, SpreadMode, StrokeDash, Transform,
};

use super::scene::{Color, Item, Label, Path, Point, Rect, Scene, Segment, Stroke, runs};
use super::{stamp, text};
use crate::image::Image;

/// The largest side of an image in pixels: a mistaken size costs at most a gigabyte, not a crash.
const MAX_SIDE: f32 = 16384.0;

/// The scene with `scale` pixels to its unit: `scene.width * scale` by `scene.height * scale` pixels,
/// rounded, each at least 1 and at most 16384.
pub fn raster(scene: &Scene, scale: f32) -> Image {
    let side = |length: f32| (length * scale).round().clamp(1.0, MAX_SIDE) as u32;
    let (width, height) = (side(scene.width), side(scene.height));
    let Some(pixmap) = Pixmap::new(width, height) else {
        return Image::new(width as usize, height as usize);
    };
    let mut canvas = Canvas {
        pixmap,
        scale,
        clip: Rect::new(0.0, 0.0, width as f32, height as f32),
        mask: None,
    };
    canvas.pixmap.fill(skia(scene.background));
    scene.items.iter().for_each(|item| canvas.draw(item));
    Image {
        width: width as usize,
        height: height as usize,
        rgba: canvas.pixmap.take_demultiplied(),
    }
}

struct Canvas {
    pixmap: Pixmap,
    scale: f32,
    /// In pixels of the image.
    clip: Rect,
    mask: Option<Mask>,
}

impl Canvas {
    fn draw(&mut self, item: &Item) {
        match item {
            Item::Path { path, fill, stroke } => match (upright(path), fill, stroke) {
                (Some(ends), None, Some(stroke)) if stroke.dash.is_none() => {
                    self.upright(ends, *stroke);
                }
                _ => self.path(path, *fill, *stroke),
            },
            Item::Circle {
                centre,
                radius,
                fill,
                stroke,
            } => self.circle(*centre, *radius, *fill, *stroke),
            Item::Curve {
                points,
                colors,
                width,
            } => {
                for (color, run) in runs(points, colors) {
                    let stroke = Stroke::new(color, *width);
                    self.path(&Path::polyline(run), None, Some(stroke));
                }
            }
            Item::Ramp { rect, colors } => self.ramp(*rect, colors),
            Item::Text(label) => self.text(label),
            Item::Picture { rect, image } => self.picture(*rect, image),
            Item::Clip(rect) => self.set_clip(*rect),
        }
    }

    fn path(&mut self, path: &Path, fill: Option<Color>, stroke: Option<Stroke>) {
        if let Some(path) = built(path) {
            self.paint(&path, fill, stroke);
        }
    }

    fn circle(&mut self, at: Point, radius: f32, fill: Option<Color>, stroke: Option<Stroke>) {
        let centre = at.map(|value| value * self.scale);
        let finite = centre.iter().all(|value| value.is_finite()) && radius.is_finite();
        if !finite || radius <= 0.0 {
            return;
        }
        let radius = radius * self.scale;
        if let Some(color) = fill {
            stamp::ring(&mut self.pixmap, self.clip, centre, [0.0, radius], color);
        }
        if let Some(stroke) = stroke {
            let half = 0.5 * stroke.width * self.scale;
            let radii = [(radius - half).max(0.0), radius + half];
            stamp::ring(&mut self.pixmap, self.clip, centre, radii, stroke.color);
        }
    }

    /// A line along an axis: the bar about it.
    fn upright(&mut self, [a, b]: [Point; 2], stroke: Stroke) {
        let (left, top) = (a[0].min(b[0]), a[1].min(b[1]));
        let line = Rect::new(left, top, (a[0] - b[0]).abs(), (a[1] - b[1]).abs());
        let bar = line.grown(0.5 * stroke.width).scaled(self.scale);
        stamp::bar(&mut self.pixmap, self.clip, bar, stroke.color);
    }

    fn paint(&mut self, path: &tiny_skia::Path, fill: Option<Color>, stroke: Option<Stroke>) {
        let (scale, mask) = (
            Transform::from_scale(self.scale, self.scale),
            self.mask.as_ref(),
        );
        if let Some(color) = fill {
            let rule = FillRule::Winding;
            self.pixmap
                .fill_path(path, &paint(color), rule, scale, mask);
        }
        if let Some(stroke) = stroke {
            let (paint, pen) = (paint(stroke.color), pen(stroke));
            self.pixmap.stroke_path(path, &paint, &pen, scale, mask);
        }
    }

    fn ramp(&mut self, rect: Rect, colors: &[Color]) {
        let last = colors.len().saturating_sub(1).max(1) as f32;
        let stops = colors.iter().enumerate();
        let stops = stops.map(|(i, &color)| GradientStop::new(i as f32 / last, skia(color)));
        let ends = [rect.bottom(), rect.top].map(|y| tiny_skia::Point::from_xy(rect.left, y));
        let identity = Transform::identity();
        let shader =
            LinearGradient::new(ends[0], ends[1], stops.collect(), SpreadMode::Pad, identity);
        let (Some(shader), Some(path)) = (shader, built(&Path::rect(rect))) else {
            return;
        };
        let paint = Paint {
            shader,
            ..Paint::default()
        };
        let (scale, mask) = (
            Transform::from_scale(self.scale, self.scale),
            self.mask.as_ref(),
        );
        self.pixmap
            .fill_path(&path, &paint, FillRule::Winding, scale, mask);
    }

    fn text(&mut self, label: &Label) {
        let Some(path) = built(&text::outline(label)) else {
            return;
        };
        let halo = label.halo.map(|color| Stroke::new(color, label.size / 4.0));
        self.paint(&path, None, halo);
        self.paint(&path, Some(label.color), None);
    }

    fn picture(&mut self, rect: Rect, image: &Image) {
        let side = |pixels: usize| u32::try_from(pixels).unwrap_or(0);
        let size = IntSize::from_wh(side(image.width), side(image.height));
        let pixels = size.and_then(|size| Pixmap::from_vec(premultiplied(&image.rgba), size));
        let Some(pixels) = pixels else {
            return;
        };
        let (x, y) = (
            rect.width / image.width as f32,
            rect.height / image.height as f32,
        );
        let place = Transform::from_row(x, 0.0, 0.0, y, rect.left, rect.top);
        let quality = PixmapPaint {
            quality: FilterQuality::Bilinear,
            ..PixmapPaint::default()
        };
        let transform = place.post_scale(self.scale, self.scale);
        let mask = self.mask.as_ref();
        self.pixmap
            .draw_pixmap(0, 0, pixels.as_ref(), &quality, transform, mask);
    }

    /// Limits what follows to whole pixels about `rect`.
    fn set_clip(&mut self, rect: Option<Rect>) {
        let (width, height) = (self.pixmap.width(), self.pixmap.height());
        let whole = Rect::new(0.0, 0.0, width as f32, height as f32);
        self.clip = rect.map_or(whole, |rect| rect.scaled(self.scale));
        self.mask = rect.and_then(|_| {
            let mut mask = Mask::new(width, height)?;
            let path = built(&Path::rect(self.clip))?;
            mask.fill_path(&path, FillRule::Winding, false, Transform::identity());
            Some(mask)
        });
    }
}

/// The ends of a path that is one line along an axis.
fn upright(path: &Path) -> Option<[Point; 2]> {
    match path.0[..] {
        [Segment::Move(a), Segment::Line(b)] if a[0] == b[0] || a[1] == b[1] => {
            let finite = [a, b].iter().flatten().all(|value| value.is_finite());
            finite.then_some([a, b])
        }
        _ => None,
    }
}

fn skia(color: Color) -> tiny_skia::Color {
    let [r, g, b, a] = color.0;
    tiny_skia::Color::from_rgba8(r, g, b, a)
}

fn paint(color: Color) -> Paint<'static> {
    let mut paint = Paint::default();
    paint.set_color(skia(color));
    paint
}

fn pen(stroke: Stroke) -> tiny_skia::Stroke {
    tiny_skia::Stroke {
        width: stroke.width,
        line_cap: LineCap::Round,
        line_join: LineJoin::Round,
        dash: stroke
            .dash
            .and_then(|dash| StrokeDash::new(dash.to_vec(), 0.0)),
        ..tiny_skia::Stroke::default()
    }
}

/// `None` for a path without extent or with a number that is not finite: it draws nothing.
fn built(path: &Path) -> Option<tiny_skia::Path> {
    let mut builder = PathBuilder::new();
    for segment in &path.0 {
        match *segment {
            Segment::Move([x, y]) => builder.move_to(x, y),
            Segment::Line([x, y]) => builder.line_to(x, y),
            Segment::Quad([a, b], [x, y]) => builder.quad_to(a, b, x, y),
            Segment::Cubic([a, b], [c, d], [x, y]) => builder.cubic_to(a, b, c, d, x, y),
            Segment::Close => builder.close(),
        }
    }
    builder.finish()
}

fn premultiplied(rgba: &[u8]) -> Vec<u8> {
    rgba.chunks_exact(4)
        .flat_map(|p| {
            let times = |c: u8| ((u16::from(c) * u16::from(p[3]) + 127) / 255) as u8;
            [times(p[0]), times(p[1]), times(p[2]), p[3]]
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::plot::Anchor;

    const WHITE: Color = Color::hex(0xffffff);
    const RED: Color = Color::hex(0xff0000);

    fn pixel(image: &Image, x: usize, y: usize) -> [u8; 4] {
        let at = 4 * (y * image.width + x);
        [0, 1, 2, 3].map(|i| image.rgba[at + i])
    }

    #[test]
    fn things_land_where_they_are_put_at_any_scale() {
        let mut scene = Scene::new(40.0, 30.0, WHITE);
        scene.disc([10.0, 20.0], 3.0, RED);
        for scale in [1, 2, 5] {
            let image = raster(&scene, scale as f32);
            assert_eq!((image.width, image.height), (40 * scale, 30 * scale));
            assert_eq!(pixel(&image, 10 * scale, 20 * scale), RED.0);
            assert_eq!(pixel(&image, 10 * scale, 14 * scale), WHITE.0);
        }
    }

    #[test]
    fn nothing_is_drawn_outside_a_clip() {
        let mut scene = Scene::new(20.0, 20.0, WHITE);
        scene.clipped(Rect::new(0.0, 0.0, 10.0, 20.0), |scene| {
            scene.disc([10.0, 10.0], 8.0, RED);
        });
        scene.disc([18.0, 18.0], 1.5, RED);
        let image = raster(&scene, 1.0);
        assert_eq!(pixel(&image, 5, 10), RED.0);
        assert_eq!(pixel(&image, 12, 10), WHITE.0);
        assert_eq!(pixel(&image, 18, 18), RED.0);
    }

    #[test]
    fn a_curve_changes_colour_at_its_corner() {
        let mut scene = Scene::new(30.0, 9.0, WHITE);
        let blue = Color::hex(0x0000ff);
        scene.items.push(Item::Curve {
            points: vec![[2.0, 4.5], [15.0, 4.5], [28.0, 4.5]],
            colors: vec![RED, blue, blue],
            width: 3.0,
        });
        let image = raster(&scene, 1.0);
        assert_eq!(pixel(&image, 8, 4), RED.0);
        assert_eq!(pixel(&image, 22, 4), blue.0);
    }

    #[test]
    fn pictures_keep_their_transparency() {
        let half = Image {
            width: 2,
            height: 1,
            rgba: vec![255, 0, 0, 255, 255, 0, 0, 0],
        };
        let mut scene = Scene::new(20.0, 10.0, WHITE);
        scene.items.push(Item::Picture {
            rect: Rect::new(0.0, 0.0, 20.0, 10.0),
            image: Arc::new(half),
        });
        let image = raster(&scene, 1.0);
        assert_eq!(pixel(&image, 2, 5), RED.0);
        assert_eq!(pixel(&image, 18, 5), WHITE.0);
    }

    #[test]
    fn text_darkens_its_box_and_nothing_else() {
        let mut scene = Scene::new(80.0, 40.0, WHITE);
        let label = Label {
            text: "ρ = 12".into(),
            at: [40.0, 25.0],
            size: 14.0,
            anchor: Anchor::Middle,
            color: Color::hex(0),
            upward: false,
            halo: None,
        };
        let room = label.bounds().grown(1.0); // anti-aliasing reaches one pixel further
        scene.items.push(Item::Text(label));
        let image = raster(&scene, 1.0);
        let dark = (0..image.height)
            .flat_map(|y| (0..image.width).map(move |x| (x, y)))
            .filter(|&(x, y)| pixel(&image, x, y) != WHITE.0)
            .inspect(|&(x, y)| assert!(room.contains([x as f32 + 0.5, y as f32 + 0.5])))
            .count();
        assert!(dark > 50, "{dark}");
    }

    #[test]
    fn what_is_not_finite_or_has_no_extent_draws_nothing() {
        let mut scene = Scene::new(10.0, 10.0, WHITE);
        scene.line([f32::NAN, 0.0], [5.0, 5.0], Stroke::new(RED, 1.0));
        scene.disc([5.0, 5.0], 0.0, RED);
        scene.disc([f32::INFINITY, 5.0], 2.0, RED);
        let image = raster(&scene, 1.0);
        assert!(image.rgba.iter().all(|&byte| byte == 255));
        assert_eq!(raster(&Scene::new(0.0, 0.0, WHITE), 1.0).rgba.len(), 4);
    }
}
