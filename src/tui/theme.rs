//! Colours of cells and pictures.

use ratatui::style::{Color, Modifier, Style};

use crate::plot;
use crate::view;

/// How many colours the terminal has.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Depth {
    /// None: shapes only.
    Mono,
    /// The 256 of xterm.
    Indexed,
    /// All.
    True,
}

/// Colours, fit for the terminal's background.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Look {
    pub(super) dark: bool,
    pub(super) depth: Depth,
}

/// Colours by their role; Okabe and Ito's, told apart with any kind of colour vision.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Role {
    /// What matters less.
    Muted,
    /// The cursor, and whatever has the keys.
    Accent,
    /// Errors.
    Bad,
    /// The loop's marks.
    Mark,
}

impl Look {
    /// The style of a role; without colours by weight alone.
    pub(super) fn style(self, role: Role) -> Style {
        if self.depth == Depth::Mono {
            return match role {
                Role::Muted => Style::new(),
                Role::Accent | Role::Mark => Style::new().add_modifier(Modifier::BOLD),
                Role::Bad => Style::new().add_modifier(Modifier::REVERSED),
            };
        }
        let (dark, light) = match role {
            Role::Muted => ([0x96, 0x9c, 0xa6], [0x60, 0x66, 0x70]),
            Role::Accent => ([0xff, 0x8a, 0x3d], [0xc2, 0x4e, 0x00]),
            Role::Bad => ([0xff, 0x7a, 0x7a], [0xb0, 0x10, 0x30]),
            Role::Mark => ([0x2f, 0xc7, 0x9a], [0x00, 0x75, 0x55]),
        };
        Style::new().fg(self.colour(if self.dark { dark } else { light }))
    }

    /// What stands in front of pictures.
    pub(super) fn front(self) -> Style {
        let [red, green, blue, _] = self.plot(0.0).background.0;
        match self.depth {
            Depth::Mono => Style::new(),
            _ => Style::new().bg(self.colour([red, green, blue])),
        }
    }

    /// The status line, and read-outs on borders.
    pub(super) fn bar(self) -> Style {
        let ground = if self.dark {
            [0x26, 0x2a, 0x31]
        } else {
            [0xe4, 0xe6, 0xea]
        };
        match self.depth {
            Depth::Mono => Style::new(),
            _ => Style::new().bg(self.colour(ground)),
        }
    }

    /// A colour as this terminal shows it.
    pub(super) fn colour(self, rgb: [u8; 3]) -> Color {
        match self.depth {
            Depth::Mono => Color::Reset,
            Depth::Indexed => Color::Indexed(nearest_of_256(rgb)),
            Depth::True => Color::Rgb(rgb[0], rgb[1], rgb[2]),
        }
    }

    /// How plots look, with text of that size in pixels.
    pub(super) fn plot(self, text: f32) -> plot::Theme {
        let theme = if self.dark {
            plot::Theme::dark()
        } else {
            plot::Theme::light()
        };
        theme.with_text(text)
    }

    /// How meshes look.
    pub(super) fn mesh(self) -> view::Style {
        let theme = self.plot(0.0).background.0;
        let style = if self.dark {
            view::Style::DARK
        } else {
            view::Style::LIGHT
        };
        view::Style {
            background: theme,
            ..style
        }
    }
}

/// The nearest of xterm's colour cube and greys.
fn nearest_of_256(rgb: [u8; 3]) -> u8 {
    const LEVELS: [u8; 6] = [0, 95, 135, 175, 215, 255];
    let level = |value: u8| {
        (0..6)
            .min_by_key(|&i| LEVELS[i].abs_diff(value))
            .unwrap_or(0)
    };
    let cube = rgb.map(level);
    let mean = rgb.iter().map(|&value| u32::from(value)).sum::<u32>() / 3;
    let grey = (mean.saturating_sub(3) / 10).min(23) as u8;
    let distance = |other: [u8; 3]| -> u32 {
        rgb.iter()
            .zip(other)
            .map(|(&a, b)| u32::from(a.abs_diff(b)).pow(2))
            .sum()
    };
    if distance([8 + 10 * grey; 3]) < distance(cube.map(|level| LEVELS[level])) {
        return 232 + grey;
    }
    (16 + 36 * cube[0] + 6 * cube[1] + cube[2]) as u8
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn colours_of_the_cube_and_greys_are_themselves() {
        assert_eq!(nearest_of_256([255, 0, 0]), 196);
        assert_eq!(nearest_of_256([0, 0, 0]), 16);
        assert_eq!(nearest_of_256([8, 8, 8]), 232);
        assert_eq!(nearest_of_256([238, 238, 238]), 255);
    }

    #[test]
    fn without_colours_styles_have_none() {
        let look = Look {
            dark: true,
            depth: Depth::Mono,
        };
        for role in [Role::Muted, Role::Accent, Role::Bad, Role::Mark] {
            assert_eq!((look.style(role).fg, look.style(role).bg), (None, None));
        }
    }
}
