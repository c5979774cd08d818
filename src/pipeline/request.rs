//! What is asked of a fit, in the words of the command line and of recipes.

use crate::diag::{Diagnostic, Result};
use crate::loom::fit::{FitOptions, Method};
use crate::loom::pins::{Pin, PinPlace};
use crate::signal::root::RootKind;

/// What is asked of a fit; what is left out has its default.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct FitRequest {
    /// The method's name.
    pub method: Option<String>,
    /// The shape space's name.
    pub space: Option<String>,
    /// k.
    pub controls: Option<usize>,
    /// l.
    pub sites: Option<usize>,
    /// m.
    pub modes: Option<usize>,
    /// Relative total error.
    pub tolerance: Option<f64>,
    /// Frames (from 1) held at points of the layout.
    pub pins: Vec<(usize, [f64; 2])>,
    /// (tau, theta) of an earlier ordered fit of nearly these frames, kept while it suits.
    pub near: Option<(f64, f64)>,
    /// Exponent of the parametrisation.
    pub alpha: Option<f64>,
    /// Root motion to split off: none, ground or rigid.
    pub root: Option<String>,
    /// Frames per second.
    pub fps: Option<f64>,
}

impl FitRequest {
    /// The options of the fit.
    ///
    /// # Errors
    /// A method or a kind of root motion that does not exist; the choices are named.
    pub fn options(&self) -> Result<FitOptions> {
        let default = FitOptions::default();
        let pin = |&(frame, point): &(usize, [f64; 2])| Pin {
            frame,
            at: PinPlace::Layout(point),
        };
        Ok(FitOptions {
            method: self.method.as_deref().map_or(Ok(default.method), method)?,
            space: self.space.clone().unwrap_or(default.space),
            controls: self.controls,
            sites: self.sites,
            modes: self.modes,
            tolerance: self.tolerance.unwrap_or(default.tolerance),
            pins: self.pins.iter().map(pin).collect(),
            alpha: self.alpha.unwrap_or(default.alpha),
            near: self.near,
            root: self.root.as_deref().map_or(Ok(None), root)?,
            fps: self.fps,
            left_out: default.left_out,
        })
    }
}

fn method(name: &str) -> Result<Method> {
    let found = Method::ALL.iter().find(|method| method.name() == name);
    found.copied().ok_or_else(|| {
        unknown(
            "method",
            name,
            &Method::ALL
                .iter()
                .map(|method| method.name())
                .collect::<Vec<_>>(),
        )
    })
}

fn root(name: &str) -> Result<Option<RootKind>> {
    match name {
        "none" => Ok(None),
        "ground" => Ok(Some(RootKind::Ground)),
        "rigid" => Ok(Some(RootKind::Rigid)),
        _ => Err(unknown("root motion", name, &["none", "ground", "rigid"])),
    }
}

fn unknown(what: &str, name: &str, known: &[&str]) -> Box<Diagnostic> {
    Box::new(
        Diagnostic::error(format!("no {what} `{name}`"))
            .hint(format!("choose {}", known.join(", "))),
    )
}
