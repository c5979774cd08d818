//! The time signals below each other: coordinates of the curve, its speed, the parameter rho(t), the
//! error of each frame.

use super::axes::Plane;
use super::chart::{Chart, Panel, Series, Style, chart};
use super::scene::Scene;
use super::theme::{Theme, Tint};

/// What the panels show; any of the lists may be empty. Times are in frames, from 1.
#[derive(Debug, Clone, Default)]
pub struct TimeSignals {
    /// Times at which the smooth signals are sampled, growing.
    pub times: Vec<f64>,
    /// f(t) at these times.
    pub position: Vec<[f64; 2]>,
    /// |f'(t)| at these times, in layout units per frame.
    pub speed: Vec<f64>,
    /// rho(t) at these times, from 0.
    pub rho: Vec<f64>,
    /// Positions p_i of the frames 1, 2, ..
    pub frames: Vec<[f64; 2]>,
    /// Parameters t_i of the frames.
    pub parameters: Vec<f64>,
    /// Relative error of each frame.
    pub error: Vec<f64>,
    /// Times at which the interior knots of f lie.
    pub knots: Vec<f64>,
    /// Times between which the curve leaves the way of the frames; set off as a warning.
    pub advice: Vec<[f64; 2]>,
    /// Which times to show; `None`: all.
    pub window: Option<[f64; 2]>,
}

/// The panels in a picture of `width` x `height` pixels, and where their data lies, from top to bottom:
/// coordinates, speed, and where there is a rho, that and the error.
pub fn time_signals(
    signals: &TimeSignals,
    width: f32,
    height: f32,
    theme: &Theme,
) -> (Scene, Vec<Plane>) {
    chart(&signals.chart(), width, height, theme)
}

impl TimeSignals {
    fn chart(&self) -> Chart {
        let mut panels = vec![self.coordinates(), self.speeds()];
        // A motion through keys has neither.
        if !self.rho.is_empty() {
            panels.extend([self.parameter(), self.errors()]);
        }
        Chart {
            name: "t (frames)".into(),
            range: self.window,
            panels,
            rug: Some(("knots".into(), self.knots.clone())),
            bands: self.advice.clone(),
            ..Chart::default()
        }
    }

    fn coordinates(&self) -> Panel {
        let smooth = |axis: usize| joined(&self.times, self.position.iter().map(|p| p[axis]));
        let frames = |axis: usize| numbered(self.frames.iter().map(|p| p[axis]));
        let dots =
            |axis| Series::line("", Tint::Series(2 * axis), frames(axis)).styled(Style::Dots);
        Panel {
            name: "p₁, p₂".into(),
            series: vec![
                Series::line("p₁", Tint::Series(0), smooth(0)),
                Series::line("p₂", Tint::Series(2), smooth(1)),
                dots(0),
                dots(1),
            ],
            share: 1.6,
            ..Panel::default()
        }
    }

    fn speeds(&self) -> Panel {
        let points = joined(&self.times, self.speed.iter().copied());
        Panel {
            name: "speed".into(),
            from_zero: true,
            series: vec![Series::line("|f′(t)| per frame", Tint::Series(3), points)],
            ..Panel::default()
        }
    }

    fn parameter(&self) -> Panel {
        let points = joined(&self.times, self.rho.iter().copied());
        let frames = numbered(self.parameters.iter().copied());
        Panel {
            name: "ρ(t)".into(),
            from_zero: true,
            series: vec![
                Series::line("", Tint::Muted, points),
                Series::line("frames", Tint::Ink, frames).styled(Style::Dots),
            ],
            ..Panel::default()
        }
    }

    fn errors(&self) -> Panel {
        let points = numbered(self.error.iter().map(|error| 100.0 * error));
        Panel {
            name: "error (%)".into(),
            from_zero: true,
            series: vec![Series::line("", Tint::Ink, points).styled(Style::Stems)],
            ..Panel::default()
        }
    }
}

fn joined(times: &[f64], values: impl Iterator<Item = f64>) -> Vec<[f64; 2]> {
    times
        .iter()
        .zip(values)
        .map(|(&t, value)| [t, value])
        .collect()
}

/// Values of the frames 1, 2, ..
fn numbered(values: impl Iterator<Item = f64>) -> Vec<[f64; 2]> {
    values
        .enumerate()
        .map(|(i, value)| [(i + 1) as f64, value])
        .collect()
}
