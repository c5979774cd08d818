//! The colours of time beside the map.

use crate::plot::axes::{Axis, Ticks};
use crate::plot::scene::{Rect, Scene};
use crate::plot::text::CAP_HEIGHT;
use crate::plot::theme::Theme;
use crate::plot::{Anchor, Item, Scale};

/// The colours of time and their numbers, right of the data.
pub(super) struct TimeBar {
    axis: Axis,
    ticks: Ticks,
}

impl TimeBar {
    pub(super) fn new(range: [f64; 2], height: f32, theme: &Theme) -> Self {
        let axis = Axis {
            range,
            pixels: [height, 0.0],
            scale: Scale::Linear,
        };
        let ticks = axis.fitting(height, 2.6, Some(1.3), theme);
        TimeBar { axis, ticks }
    }

    /// Space that it takes beside the data.
    pub(super) fn width(&self, theme: &Theme) -> f32 {
        self.ticks.width(theme.text) + 3.9 * theme.text
    }

    pub(super) fn draw(&self, scene: &mut Scene, theme: &Theme, area: Rect) {
        let size = theme.text;
        let bar = Rect::new(area.right() + 0.9 * size, area.top, 0.8 * size, area.height);
        scene.items.push(Item::Ramp {
            rect: bar,
            colors: (0..=32).map(|i| theme.time(f64::from(i) / 32.0)).collect(),
        });
        let left = bar.right() + 0.35 * size;
        for tick in &self.ticks.marks {
            let at = area.top + self.axis.pixel(tick.value) + 0.5 * CAP_HEIGHT * size;
            scene.write(&tick.text, [left, at], Anchor::Start, theme);
        }
        let name = left + self.ticks.width(size) + 1.15 * size;
        let middle = 0.5 * (bar.top + bar.bottom());
        scene.write_upward("t (frames)", [name, middle], theme);
    }
}
