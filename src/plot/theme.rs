//! Colours and sizes. The categorical colours are those of Okabe & Ito (2008), which people with any
//! common colour vision tell apart; time is coloured by viridis, whose lightness grows evenly,
//! without the end that has no contrast against the background.

use super::scene::Color;

/// How a figure looks. All lengths follow from `text`.
#[derive(Debug, Clone, PartialEq)]
pub struct Theme {
    /// Behind everything.
    pub background: Color,
    /// Text, frames, marks without a colour of their own.
    pub ink: Color,
    /// Secondary text and axis lines.
    pub muted: Color,
    /// Grid lines.
    pub grid: Color,
    /// Colours to tell series apart, the most distinct first.
    pub series: [Color; 6],
    /// Which part of viridis has contrast against the background.
    time: [f64; 2],
    /// Size of the text in pixels; 0 leaves out all letters, for pictures of few pixels.
    pub text: f32,
}

/// A colour by its role, whatever the theme.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Tint {
    /// As text.
    Ink,
    /// As secondary text.
    Muted,
    /// The n-th of the colours that tell series apart, counted from 0 and around.
    Series(usize),
}

/// How many colours the time map is divided into: fewer strokes, and no step that could be seen.
const TIME_STEPS: f64 = 64.0;

impl Theme {
    /// Dark on white, as for print.
    pub fn light() -> Self {
        Theme {
            background: Color::hex(0xffffff),
            ink: Color::hex(0x1a1a1a),
            muted: Color::hex(0x595959),
            grid: Color::hex(0xe6e6e6),
            series: [0x0072b2, 0xd55e00, 0x009e73, 0xcc79a7, 0xe69f00, 0x56b4e9].map(Color::hex),
            time: [0.0, 0.77],
            text: 12.0,
        }
    }

    /// Light on near black, as for terminals.
    pub fn dark() -> Self {
        Theme {
            background: Color::hex(0x14161a),
            ink: Color::hex(0xececec),
            muted: Color::hex(0xa6a6a6),
            grid: Color::hex(0x2c3036),
            series: [0x56b4e9, 0xff8a3d, 0x2fc79a, 0xe39cc5, 0xf0e442, 0x8fa8ff].map(Color::hex),
            time: [0.22, 1.0],
            text: 12.0,
        }
    }

    /// Whether the background is darker than the ink.
    pub fn is_dark(&self) -> bool {
        let sum = |color: Color| color.0[..3].iter().map(|&c| u32::from(c)).sum::<u32>();
        sum(self.background) < sum(self.ink)
    }

    /// The same colours with text of another size in pixels (0: none).
    #[must_use]
    pub fn with_text(mut self, size: f32) -> Self {
        self.text = size.max(0.0);
        self
    }

    /// The colour of that role.
    pub fn tint(&self, tint: Tint) -> Color {
        match tint {
            Tint::Ink => self.ink,
            Tint::Muted => self.muted,
            Tint::Series(i) => self.series[i % self.series.len()],
        }
    }

    /// What is drawn attention to, below a line or behind it.
    pub fn warning(&self) -> Color {
        self.series[3].with_alpha(0.5)
    }

    /// The colour of time at `share` in \[0, 1\] of the whole; outside it the ends' colours.
    pub fn time(&self, share: f64) -> Color {
        let share = (share.clamp(0.0, 1.0) * TIME_STEPS).round() / TIME_STEPS;
        let [low, high] = self.time;
        let colorous::Color { r, g, b } =
            colorous::VIRIDIS.eval_continuous(low + (high - low) * share);
        Color([r, g, b, 255])
    }

    /// A twelfth of the text size: the unit of line widths and marks. 1 pixel without text.
    pub fn unit(&self) -> f32 {
        if self.text > 0.0 {
            self.text / 12.0
        } else {
            1.0
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Relative luminance and contrast as WCAG 2.1 defines them.
    fn luminance(color: Color) -> f64 {
        let [r, g, b] = [0, 1, 2].map(|i| {
            let c = f64::from(color.0[i]) / 255.0;
            if c <= 0.04045 {
                c / 12.92
            } else {
                ((c + 0.055) / 1.055).powf(2.4)
            }
        });
        0.2126 * r + 0.7152 * g + 0.0722 * b
    }

    fn contrast(a: Color, b: Color) -> f64 {
        let (a, b) = (luminance(a), luminance(b));
        (a.max(b) + 0.05) / (a.min(b) + 0.05)
    }

    #[test]
    fn text_is_readable_and_curves_are_visible() {
        for theme in [Theme::light(), Theme::dark()] {
            // 7 and 4.5 are the WCAG levels AAA and AA for text
            assert!(contrast(theme.ink, theme.background) >= 7.0);
            assert!(contrast(theme.muted, theme.background) >= 4.5);
            for i in 0..=64 {
                let seen = contrast(theme.time(f64::from(i) / 64.0), theme.background);
                assert!(seen >= 2.0, "time {i}/64 has contrast {seen}");
            }
        }
    }

    #[test]
    fn time_has_evenly_ordered_lightness() {
        for theme in [Theme::light(), Theme::dark()] {
            let row: Vec<f64> = (0..=64)
                .map(|i| luminance(theme.time(f64::from(i) / 64.0)))
                .collect();
            assert!(row.windows(2).all(|pair| pair[1] > pair[0]));
        }
    }
}
