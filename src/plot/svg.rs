//! A scene as SVG. Text stays text, so that it can be searched and edited; each line carries its
//! width, so that it keeps its place where the font is missing.

use std::fmt::Write;

use base64::Engine;
use base64::engine::general_purpose::STANDARD;

use super::scene::{Anchor, Color, Item, Label, Path, Point, Rect, Scene, Segment, Stroke, runs};
use super::text::text_width;
use crate::image::Image;

/// The scene as the text of an SVG file, one primitive a line.
pub fn svg(scene: &Scene) -> String {
    let mut page = Page::default();
    let [width, height] = [scene.width, scene.height].map(number);
    page.line(&format!(
        r#"<svg xmlns="http://www.w3.org/2000/svg" width="{width}" height="{height}" viewBox="0 0 {width} {height}" font-family="'DejaVu Sans', Verdana, sans-serif">"#
    ));
    let background = fill(Some(scene.background));
    page.line(&format!(
        r#"<rect width="{width}" height="{height}"{background}/>"#
    ));
    scene.items.iter().for_each(|item| page.draw(item));
    page.clip(None);
    page.line("</svg>");
    page.text
}

#[derive(Default)]
struct Page {
    text: String,
    ids: usize,
    clipped: bool,
}

impl Page {
    fn line(&mut self, text: &str) {
        self.text.push_str(text);
        self.text.push('\n');
    }

    fn draw(&mut self, item: &Item) {
        match item {
            Item::Path { path, fill, stroke } => self.path(path, *fill, *stroke),
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
            } => runs(points, colors).for_each(|(color, run)| {
                self.path(&Path::polyline(run), None, Some(Stroke::new(color, *width)));
            }),
            Item::Ramp { rect, colors } => self.ramp(*rect, colors),
            Item::Text(label) => self.label(label),
            Item::Picture { rect, image } => self.picture(*rect, image),
            Item::Clip(rect) => self.clip(*rect),
        }
    }

    fn path(&mut self, path: &Path, fill_color: Option<Color>, stroke: Option<Stroke>) {
        let data = data(path);
        let look = look(fill_color, stroke);
        self.line(&format!(r#"<path d="{data}"{look}/>"#));
    }

    fn circle(&mut self, at: Point, radius: f32, fill: Option<Color>, stroke: Option<Stroke>) {
        let ([x, y], r) = (at.map(number), number(radius));
        let look = look(fill, stroke);
        self.line(&format!(r#"<circle cx="{x}" cy="{y}" r="{r}"{look}/>"#));
    }

    fn ramp(&mut self, rect: Rect, colors: &[Color]) {
        self.ids += 1;
        let (id, place) = (self.ids, place(rect));
        let last = colors.len().saturating_sub(1).max(1) as f32;
        let stops = colors.iter().enumerate().map(|(i, &color)| {
            let color = painted("stop-color", color);
            format!(r#"<stop offset="{:.4}"{color}/>"#, i as f32 / last)
        });
        let stops: String = stops.collect();
        self.line(&format!(
            r##"<linearGradient id="id{id}" x1="0" y1="1" x2="0" y2="0">{stops}</linearGradient><rect {place} fill="url(#id{id})"/>"##
        ));
    }

    fn label(&mut self, label: &Label) {
        let ([x, y], size) = (label.at.map(number), number(label.size));
        let width = number(text_width(&label.text, label.size));
        let anchor = match label.anchor {
            Anchor::Start => "start",
            Anchor::Middle => "middle",
            Anchor::End => "end",
        };
        let mut more = fill(Some(label.color));
        if label.upward {
            let _ = write!(more, r#" transform="rotate(-90 {x} {y})""#);
        }
        if let Some(halo) = label.halo {
            more.push_str(&stroke_of(Stroke::new(halo, label.size / 4.0)));
            more.push_str(r#" paint-order="stroke""#);
        }
        let text = escaped(&label.text);
        self.line(&format!(
            r#"<text x="{x}" y="{y}" font-size="{size}" text-anchor="{anchor}" textLength="{width}" lengthAdjust="spacingAndGlyphs"{more}>{text}</text>"#
        ));
    }

    /// Pixels travel inside the file. An image that is no image is left out.
    fn picture(&mut self, rect: Rect, image: &Image) {
        let Ok(png) = image.png() else {
            return;
        };
        let place = place(rect);
        let data = STANDARD.encode(png);
        self.line(&format!(
            r#"<image {place} preserveAspectRatio="none" href="data:image/png;base64,{data}"/>"#
        ));
    }

    fn clip(&mut self, rect: Option<Rect>) {
        if std::mem::take(&mut self.clipped) {
            self.line("</g>");
        }
        if let Some(rect) = rect {
            self.ids += 1;
            self.clipped = true;
            let (id, place) = (self.ids, place(rect));
            self.line(&format!(
                r##"<clipPath id="id{id}"><rect {place}/></clipPath><g clip-path="url(#id{id})">"##
            ));
        }
    }
}

/// Hundredths of a pixel, without trailing zeros; what is not finite becomes 0.
fn number(value: f32) -> String {
    if !value.is_finite() {
        return "0".into();
    }
    let text = format!("{value:.2}");
    let text = text.trim_end_matches('0').trim_end_matches('.');
    if text == "-0" {
        "0".into()
    } else {
        text.into()
    }
}

fn place(rect: Rect) -> String {
    let [x, y, width, height] = [rect.left, rect.top, rect.width, rect.height].map(number);
    format!(r#"x="{x}" y="{y}" width="{width}" height="{height}""#)
}

fn data(path: &Path) -> String {
    let mut text = String::new();
    for segment in &path.0 {
        let (letter, points): (char, &[Point]) = match segment {
            Segment::Move(a) => ('M', &[*a]),
            Segment::Line(a) => ('L', &[*a]),
            Segment::Quad(a, b) => ('Q', &[*a, *b]),
            Segment::Cubic(a, b, c) => ('C', &[*a, *b, *c]),
            Segment::Close => ('Z', &[]),
        };
        text.push(letter);
        let numbers: Vec<String> = points.iter().flatten().map(|&v| number(v)).collect();
        text.push_str(&numbers.join(" "));
    }
    text
}

fn look(fill_color: Option<Color>, stroke: Option<Stroke>) -> String {
    let line = stroke.map(stroke_of).unwrap_or_default();
    format!("{}{line}", fill(fill_color))
}

fn fill(color: Option<Color>) -> String {
    color.map_or(r#" fill="none""#.into(), |color| painted("fill", color))
}

fn stroke_of(stroke: Stroke) -> String {
    let mut text = painted("stroke", stroke.color);
    let width = number(stroke.width);
    let _ = write!(
        text,
        r#" stroke-width="{width}" stroke-linecap="round" stroke-linejoin="round""#
    );
    if let Some(dash) = stroke.dash {
        let _ = write!(
            text,
            r#" stroke-dasharray="{}""#,
            dash.map(number).join(" ")
        );
    }
    text
}

fn painted(what: &str, color: Color) -> String {
    let [r, g, b, a] = color.0;
    let mut text = format!(r##" {what}="#{r:02x}{g:02x}{b:02x}""##);
    if a < 255 {
        let (opacity, what) = (
            number(f32::from(a) / 255.0),
            what.trim_end_matches("-color"),
        );
        let _ = write!(text, r#" {what}-opacity="{opacity}""#);
    }
    text
}

/// The five special characters as entities; what XML 1.0 cannot hold is left out.
fn escaped(text: &str) -> String {
    let mut safe = String::new();
    for c in text.chars() {
        match c {
            '&' => safe.push_str("&amp;"),
            '<' => safe.push_str("&lt;"),
            '>' => safe.push_str("&gt;"),
            '"' => safe.push_str("&quot;"),
            '\'' => safe.push_str("&apos;"),
            c if c.is_control() || matches!(c, '\u{fffe}' | '\u{ffff}') => {}
            c => safe.push(c),
        }
    }
    safe
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;

    fn scene() -> Scene {
        let mut scene = Scene::new(100.0, 50.0, Color::hex(0xffffff));
        let line = Stroke::new(Color::hex(0x0072b2).with_alpha(0.5), 1.5);
        scene.clipped(Rect::new(5.0, 5.0, 50.0, 40.0), |scene| {
            scene.line([0.0, 0.0], [1.0 / 3.0, f32::NAN], line.dashed(3.0, 2.0));
            scene.ring([20.0, 20.0], 4.0, None, line);
        });
        scene.items.push(Item::Ramp {
            rect: Rect::new(90.0, 0.0, 5.0, 50.0),
            colors: vec![Color::hex(0), Color::hex(0xff0000).with_alpha(0.5)],
        });
        scene.items.push(Item::Picture {
            rect: Rect::new(60.0, 10.0, 20.0, 20.0),
            image: Arc::new(Image {
                width: 1,
                height: 1,
                rgba: vec![1, 2, 3, 4],
            }),
        });
        scene.items.push(Item::Text(Label {
            text: "a<b & \"ρ\"\u{7}".into(),
            at: [10.0, 40.0],
            size: 12.0,
            anchor: Anchor::End,
            color: Color::hex(0),
            upward: true,
            halo: Some(Color::hex(0xffffff)),
        }));
        scene
    }

    #[test]
    fn the_file_is_xml_of_the_size_asked_for() {
        let text = svg(&scene());
        let tree = roxmltree::Document::parse(&text).unwrap();
        let root = tree.root_element();
        assert_eq!(root.attribute("viewBox"), Some("0 0 100 50"));
        let named = |name: &str| root.descendants().find(|node| node.has_tag_name(name));
        assert_eq!(named("text").unwrap().text(), Some("a<b & \"ρ\""));
        assert!(!text.contains("NaN"));
        assert_eq!(named("circle").unwrap().parent(), named("g"));
        assert_eq!(named("image").unwrap().parent(), Some(root));
    }

    #[test]
    fn numbers_are_short() {
        assert_eq!(
            [1.0 / 3.0, 2.0, -0.001, 1200.0].map(number),
            ["0.33", "2", "0", "1200"]
        );
    }
}
