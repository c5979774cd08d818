//! Sizes of modes from the largest down, those that were kept set off from the rest.

use super::axes::{Plane, Scale};
use super::chart::{Chart, Panel, Series, Style, chart};
use super::scene::Scene;
use super::theme::{Theme, Tint};

/// Sizes of modes, and how many of them are in use.
#[derive(Debug, Clone, Default)]
pub struct Spectrum {
    /// Singular values or shares, from the largest down; those that are 0 are not shown.
    pub values: Vec<f64>,
    /// How many of the first ones are kept.
    pub kept: usize,
    /// Name of the vertical axis, with its unit.
    pub name: String,
}

/// The sizes over the number of the mode, in a picture of `width` x `height` pixels with a logarithmic
/// vertical axis; and where they lie in it.
pub fn spectrum(
    spectrum: &Spectrum,
    width: f32,
    height: f32,
    theme: &Theme,
) -> (Scene, Vec<Plane>) {
    let kept = spectrum.kept.min(spectrum.values.len());
    let numbered = |(i, &value): (usize, &f64)| [(i + 1) as f64, value];
    let points: Vec<[f64; 2]> = spectrum.values.iter().enumerate().map(numbered).collect();
    let (kept, rest) = points.split_at(kept);
    let series = |name: &str, tint, points: &[[f64; 2]]| {
        Series::line(name, tint, points.to_vec()).styled(Style::Dots)
    };
    let both = [
        series("kept", Tint::Series(0), kept),
        series("left out", Tint::Muted, rest),
    ];
    let panel = Panel {
        name: spectrum.name.clone(),
        scale: Scale::Log,
        series: both
            .into_iter()
            .filter(|one| !one.points.is_empty())
            .collect(),
        ..Panel::default()
    };
    let figure = Chart {
        name: "mode".into(),
        panels: vec![panel],
        ..Chart::default()
    };
    chart(&figure, width, height, theme)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plot::Item;

    #[test]
    fn every_mode_above_zero_is_a_dot_and_nothing_else_is() {
        let values = vec![10.0, 1.0, 0.1, 0.0, f64::NAN];
        for kept in [0, 2, 99] {
            let data = Spectrum {
                values: values.clone(),
                kept,
                name: "singular value".into(),
            };
            let (scene, planes) = spectrum(&data, 400.0, 300.0, &Theme::light());
            let inside = scene.items.iter().filter(|item| {
                matches!(item, Item::Circle { centre, .. } if planes[0].area.contains(*centre))
            });
            assert_eq!(inside.count(), 3);
        }
    }
}
