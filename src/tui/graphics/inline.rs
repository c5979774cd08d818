//! Pictures that lie in the cells themselves (sixel, iTerm2): text that is written over them erases them,
//! and they erase text. Only what changed is sent, as rectangles of cells; what stands on a picture is
//! left out of it.

use std::collections::HashMap;

use ratatui::buffer::{Buffer, CellDiffOption};
use ratatui::layout::Rect;
use ratatui::style::Color;

use super::{Aside, CellSize, Painter};
use crate::image::Image;

/// A letter that stands where a picture is: never sent, and unlike anything that is.
const PICTURE: &str = "\u{F8FF}";
/// More rectangles than this are sent as the one around all of them.
const MOST: usize = 8;

/// How the pixels of a rectangle of cells become bytes.
pub(super) trait Encoder {
    /// Bytes that show `part` from the cursor's cell on, over `columns` and `rows`. Pixels with alpha 0
    /// leave what is there.
    fn encode(&self, part: &Image, columns: u16, rows: u16) -> Vec<u8>;

    /// Whether alpha is understood; else text under a picture is sent anew.
    fn transparent(&self) -> bool;
}

/// Pictures in cells, by an encoder.
pub(super) struct Inline<E> {
    encoder: E,
    cell: CellSize,
    /// Behind text that has no background of its own: the pictures'.
    ground: Color,
    shown: HashMap<usize, Shown>,
    painted: Vec<(usize, Image, Rect)>,
}

/// What a slot shows: the pixels, where, and which cells are covered by text.
struct Shown {
    image: Image,
    area: Rect,
    covered: Vec<bool>,
}

impl<E: Encoder> Inline<E> {
    pub(super) fn new(encoder: E, cell: CellSize, ground: Color) -> Self {
        Inline {
            encoder,
            cell,
            ground,
            shown: HashMap::new(),
            painted: Vec::new(),
        }
    }

    /// Sends what is not on the screen yet.
    fn show(&self, now: &Shown, last: Option<&Shown>, buffer: &mut Buffer, aside: &mut Aside) {
        let wide = usize::from(now.area.width);
        let stale: Vec<bool> = (0..now.covered.len())
            .map(|cell| {
                let last = last.filter(|last| last.area == now.area);
                let same = |last: &Shown| !last.covered[cell] && self.same(now, last, cell);
                !now.covered[cell] && !last.is_some_and(same)
            })
            .collect();
        let parts = rectangles(&stale, wide);
        for part in parts.into_iter().flat_map(|part| pieces(part, self.cell)) {
            let at = (now.area.x + part.x + 1, now.area.y + part.y + 1);
            aside
                .before
                .extend(format!("\x1b[{};{}H", at.1, at.0).as_bytes());
            let pixels = self.cut(now, part);
            let bytes = self.encoder.encode(&pixels, part.width, part.height);
            aside.before.extend(bytes);
            if !self.encoder.transparent() {
                restore_text(now, part, buffer);
            }
        }
    }

    /// Whether a cell shows the same pixels.
    fn same(&self, now: &Shown, last: &Shown, cell: usize) -> bool {
        let wide = usize::from(now.area.width);
        let (w, h) = (usize::from(self.cell.width), usize::from(self.cell.height));
        let (left, top) = (cell % wide * w, cell / wide * h);
        let row = |image: &Image, y: usize| -> Option<std::ops::Range<usize>> {
            let right = (left + w).min(image.width);
            (y < image.height && left < right)
                .then(|| 4 * (y * image.width + left)..4 * (y * image.width + right))
        };
        (top..top + h).all(|y| {
            let (a, b) = (row(&now.image, y), row(&last.image, y));
            a.map(|a| &now.image.rgba[a]) == b.map(|b| &last.image.rgba[b])
        })
    }

    /// The pixels of a rectangle of cells; transparent where text covers them or the picture ends.
    fn cut(&self, shown: &Shown, part: Rect) -> Image {
        let (w, h) = (usize::from(self.cell.width), usize::from(self.cell.height));
        let (left, top) = (usize::from(part.x) * w, usize::from(part.y) * h);
        let mut cut = Image::new(usize::from(part.width) * w, usize::from(part.height) * h);
        let wide = usize::from(shown.area.width);
        for y in 0..cut.height {
            for x in 0..cut.width {
                let (from_x, from_y) = (left + x, top + y);
                let covered = shown.covered[from_y / h * wide + from_x / w];
                if covered || from_x >= shown.image.width || from_y >= shown.image.height {
                    continue;
                }
                let (to, from) = (
                    4 * (y * cut.width + x),
                    4 * (from_y * shown.image.width + from_x),
                );
                cut.rgba[to..to + 4].copy_from_slice(&shown.image.rgba[from..from + 4]);
            }
        }
        cut
    }
}

impl<E: Encoder> Painter for Inline<E> {
    fn paint(
        &mut self,
        slot: usize,
        image: &Image,
        area: Rect,
        buffer: &mut Buffer,
        _: &mut Aside,
    ) {
        for at in area.positions() {
            if let Some(cell) = buffer.cell_mut(at) {
                cell.reset();
                cell.set_symbol(PICTURE);
            }
        }
        self.painted.push((slot, image.clone(), area));
    }

    fn finish(&mut self, buffer: &mut Buffer, aside: &mut Aside) {
        let mut now = HashMap::new();
        for (slot, image, area) in std::mem::take(&mut self.painted) {
            let covered = covered(area, self.ground, buffer);
            let shown = Shown {
                image,
                area,
                covered,
            };
            self.show(&shown, self.shown.get(&slot), buffer, aside);
            now.insert(slot, shown);
        }
        self.shown = now;
    }

    fn forget(&mut self, _: &mut Aside) {
        self.shown.clear();
    }
}

/// Which cells of `area` hold text by now; the others are not to be sent.
fn covered(area: Rect, ground: Color, buffer: &mut Buffer) -> Vec<bool> {
    area.positions()
        .map(|at| {
            let Some(cell) = buffer.cell_mut(at) else {
                return true;
            };
            let picture = cell.symbol() == PICTURE;
            if picture {
                cell.set_diff_option(CellDiffOption::Skip);
            } else if cell.bg == Color::Reset {
                cell.set_bg(ground);
            }
            !picture
        })
        .collect()
}

/// Text that a picture was sent over is sent again.
fn restore_text(shown: &Shown, part: Rect, buffer: &mut Buffer) {
    let wide = usize::from(shown.area.width);
    for at in part.positions() {
        let covered = shown.covered[usize::from(at.y) * wide + usize::from(at.x)];
        let place = (shown.area.x + at.x, shown.area.y + at.y);
        if let Some(cell) = buffer.cell_mut(place).filter(|_| covered) {
            cell.set_diff_option(CellDiffOption::AlwaysUpdate);
        }
    }
}

/// Rectangles that cover all cells that are set: runs of equal width below each other, or the one around
/// all where there would be many of them or little would be saved.
fn rectangles(set: &[bool], wide: usize) -> Vec<Rect> {
    let mut parts: Vec<Rect> = Vec::new();
    for (y, row) in set.chunks(wide.max(1)).enumerate() {
        let mut x = 0;
        while x < row.len() {
            let run = row[x..].iter().take_while(|set| **set).count();
            if run > 0 {
                let one = Rect::new(x as u16, y as u16, run as u16, 1);
                match parts.iter_mut().find(|part| continues(part, &one)) {
                    Some(part) => part.height += 1,
                    None => parts.push(one),
                }
            }
            x += run.max(1);
        }
    }
    let Some(all) = parts.iter().copied().reduce(Rect::union) else {
        return parts;
    };
    let cells: u32 = parts.iter().map(|part| part.area()).sum();
    if parts.len() > MOST || 4 * cells > 3 * all.area() {
        return vec![all];
    }
    parts
}

/// Pictures with more pixels than this each way are sent in pieces: xterm leaves out what has more than 1000.
const LARGEST: u16 = 960;

/// A rectangle of cells, in pieces that are not too large.
fn pieces(part: Rect, cell: CellSize) -> Vec<Rect> {
    let most = |side: u16| (LARGEST / side.max(1)).max(1);
    let (wide, tall) = (most(cell.width), most(cell.height));
    let rows = (part.y..part.bottom()).step_by(usize::from(tall));
    let starts = rows.flat_map(|y| {
        let columns = (part.x..part.right()).step_by(usize::from(wide));
        columns.map(move |x| Rect::new(x, y, wide, tall))
    });
    starts.map(|piece| piece.intersection(part)).collect()
}

fn continues(part: &Rect, row: &Rect) -> bool {
    (part.x, part.width, part.bottom()) == (row.x, row.width, row.y)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Writes the size of a part and its pixels' red values.
    struct Plain(bool);

    impl Encoder for Plain {
        fn encode(&self, part: &Image, columns: u16, rows: u16) -> Vec<u8> {
            let mut bytes = format!("<{columns}x{rows}>").into_bytes();
            let visible = |pixel: &[u8; 4]| if pixel[3] > 0 { b'0' + pixel[0] } else { b' ' };
            bytes.extend(part.rgba.as_chunks::<4>().0.iter().map(visible));
            bytes
        }

        fn transparent(&self) -> bool {
            self.0
        }
    }

    const CELL: CellSize = CellSize {
        width: 1,
        height: 1,
        fine: 1,
        shades: true,
        scales: false,
    };
    const AREA: Rect = Rect::new(2, 1, 3, 2);

    fn picture(reds: [u8; 6]) -> Image {
        Image {
            width: 3,
            height: 2,
            rgba: reds.iter().flat_map(|&red| [red, 0, 0, 255]).collect(),
        }
    }

    /// A frame: the picture, text at some places, and what is sent beside the cells and as cells.
    fn frame(
        painter: &mut Inline<Plain>,
        last: &mut Buffer,
        reds: [u8; 6],
        text: &[(u16, u16)],
    ) -> (String, Vec<(u16, u16)>) {
        let mut buffer = Buffer::empty(Rect::new(0, 0, 8, 4));
        let mut aside = Aside::default();
        painter.paint(0, &picture(reds), AREA, &mut buffer, &mut aside);
        for &at in text {
            buffer[at].set_symbol("x");
        }
        painter.finish(&mut buffer, &mut aside);
        let cells = last
            .diff(&buffer)
            .iter()
            .map(|(x, y, _)| (*x, *y))
            .collect();
        *last = buffer;
        (String::from_utf8(aside.before).unwrap(), cells)
    }

    #[test]
    fn only_what_changed_is_sent_and_text_keeps_its_cells() {
        let mut painter = Inline::new(Plain(true), CELL, Color::Reset);
        let mut last = Buffer::empty(Rect::new(0, 0, 8, 4));
        let first = frame(&mut painter, &mut last, [1, 2, 3, 4, 5, 6], &[]);
        assert_eq!(first, ("\x1b[2;3H<3x2>123456".into(), vec![]));
        let same = frame(&mut painter, &mut last, [1, 2, 3, 4, 5, 6], &[]);
        assert_eq!(same, (String::new(), vec![]));
        let text = frame(&mut painter, &mut last, [1, 2, 3, 4, 5, 6], &[(3, 1)]);
        assert_eq!(text, (String::new(), vec![(3, 1)]));
        let moved = frame(&mut painter, &mut last, [1, 2, 3, 4, 5, 6], &[(4, 2)]);
        assert_eq!(moved, ("\x1b[2;4H<1x1>2".into(), vec![(4, 2)]));
        let changed = frame(&mut painter, &mut last, [1, 2, 3, 7, 8, 9], &[(4, 2)]);
        assert_eq!(changed, ("\x1b[3;3H<2x1>78".into(), vec![]));
    }

    #[test]
    fn text_under_an_opaque_picture_is_sent_again() {
        let mut painter = Inline::new(Plain(false), CELL, Color::Reset);
        let mut last = Buffer::empty(Rect::new(0, 0, 8, 4));
        frame(&mut painter, &mut last, [1; 6], &[(3, 1)]);
        let (sent, cells) = frame(&mut painter, &mut last, [2; 6], &[(3, 1)]);
        assert_eq!(sent, "\x1b[2;3H<3x2>2 2222");
        assert_eq!(cells, [(3, 1)]);
    }

    #[test]
    fn where_a_picture_leaves_spaces_are_sent() {
        let mut painter = Inline::new(Plain(true), CELL, Color::Reset);
        let mut last = Buffer::empty(Rect::new(0, 0, 8, 4));
        frame(&mut painter, &mut last, [1; 6], &[]);
        let empty = Buffer::empty(Rect::new(0, 0, 8, 4));
        assert_eq!(last.diff(&empty).len(), 6);
    }

    #[test]
    fn large_pictures_are_sent_in_pieces_that_cover_them() {
        let cell = CellSize {
            width: 10,
            height: 20,
            ..CELL
        };
        let part = Rect::new(1, 2, 200, 60);
        let pieces = pieces(part, cell);
        let sizes = pieces
            .iter()
            .map(|piece| (piece.width * 10, piece.height * 20));
        assert!(sizes.max().unwrap() <= (LARGEST, LARGEST));
        let cells: u32 = pieces.iter().map(|piece| piece.area()).sum();
        assert_eq!(cells, part.area());
        assert_eq!(pieces.iter().copied().reduce(Rect::union), Some(part));
        assert_eq!(super::pieces(Rect::new(0, 0, 96, 48), cell).len(), 1);
    }

    #[test]
    fn rectangles_cover_what_is_set() {
        let set = |text: &str| text.chars().map(|c| c == '#').collect::<Vec<_>>();
        assert_eq!(rectangles(&set("......"), 3), []);
        let column = rectangles(&set(".#..#..#."), 3);
        assert_eq!(column, [Rect::new(1, 0, 1, 3)]);
        let corners = rectangles(&set("#...........#"), 13);
        assert_eq!(corners.len(), 2);
        let board = rectangles(&set("#.#.#.#.#.#.#.#.#.#.#.#"), 23);
        assert_eq!(board, [Rect::new(0, 0, 23, 1)]);
    }
}
