//! What should be known about a fit.

use super::ch12::Signals;
use super::fidelity::Fidelity;
use super::left_out::LeftOutFit;
use super::ordered::SITES_PER_MODE;
use super::report::{Errors, Span};
use super::subspace::Subspace;
use crate::diag::Diagnostic;
use crate::math::pca::Basis;

/// Captures longer than this make time signals that nobody can read (CH12 §6), in seconds.
const LEGIBLE: f64 = 30.0;

/// So many spans are named; more are counted.
const SPANS: usize = 5;

/// Numbers that were asked for and cannot be had, and a tolerance that is not kept.
pub fn of_fidelity(
    fidelity: &Fidelity,
    basis: &Basis,
    signals: &Signals,
    errors: &Errors,
    met: bool,
) -> Vec<Diagnostic> {
    let mut warnings = Vec::new();
    let distinct = super::ch12::distinct(&signals.layout.positions);
    if distinct == 1 {
        warnings.push(Diagnostic::warning("nothing moves: psi is one pose"));
        return warnings;
    }
    if let Some(modes) = fidelity.modes.filter(|&modes| modes > basis.modes) {
        let rank = basis.rank;
        warnings.push(Diagnostic::warning(format!(
            "m = {modes} was asked for, but the frames span only {rank} dimensions"
        )));
    }
    let sites = signals.pose.sites().len();
    if let Some(asked) = fidelity.sites.filter(|&asked| asked > sites) {
        warnings.push(Diagnostic::warning(format!(
            "l = {asked} was asked for, but only {sites} sites add anything: positions that all but \
             coincide share one"
        )));
    }
    if !met && !fidelity.is_given() {
        let (asked, total) = (fidelity.tolerance, errors.total);
        warnings.push(
            Diagnostic::warning(format!(
                "the tolerance {asked} cannot be kept: full fidelity leaves an error of {total:.3e}"
            ))
            .hint("k, l and m that are given limit what the tolerance can choose"),
        );
    }
    if !signals.layout.converged {
        let steps = signals.layout.steps;
        warnings.push(Diagnostic::warning(format!(
            "the layout still moved after {steps} steps"
        )));
    }
    warnings
}

/// Fewer sites than the rule l >= 2m asks for.
pub fn of_ordered(subspace: &Subspace, signals: &Signals) -> Option<Diagnostic> {
    let (sites, modes) = (signals.pose.sites().len(), subspace.modes);
    let wanted = (SITES_PER_MODE * modes).min(subspace.frames);
    (signals.ordered.is_some() && sites < wanted).then(|| {
        Diagnostic::warning(format!(
            "l = {sites} sites are few for m = {modes} modes: no layout carries that many"
        ))
        .hint(format!("l = {wanted} or more, or fewer modes"))
    })
}

/// Where the motion between frames goes astray, and what would mend the worst of it.
pub fn of_spans(spans: &[Span]) -> Option<Diagnostic> {
    let worst = spans.first()?;
    let mut named: Vec<String> = spans
        .iter()
        .take(SPANS)
        .map(|span| format!("{}-{}", span.first, span.last))
        .collect();
    if spans.len() > SPANS {
        named.push(format!("{} more", spans.len() - SPANS));
    }
    let warning = Diagnostic::warning(format!(
        "the motion leaves the way of its frames by up to {:.2} of a frame step, in frames {}",
        worst.deviation,
        named.join(", ")
    ));
    let (first, last) = (worst.first, worst.last);
    let mends = worst.mends.iter();
    let mends = mends.map(|mend| format!("{} in frames {first}-{last}", mend.advice()));
    Some(mends.fold(warning, Diagnostic::hint))
}

/// Where psi does worse than linear blending between frames, if it does on the whole.
pub fn between_frames(fit: &LeftOutFit) -> Option<Diagnostic> {
    if fit.psi <= fit.linear {
        return None;
    }
    let spans = spans(&fit.worse);
    let mut named: Vec<String> = spans
        .iter()
        .take(SPANS)
        .map(|&(first, last)| format!("{}-{}", first - 1, last + 1))
        .collect();
    if spans.len() > SPANS {
        named.push(format!("{} more", spans.len() - SPANS));
    }
    Some(
        Diagnostic::warning(format!(
            "between frames this fit is worse than linear blending ({:.4} against {:.4} at left-out \
             frames), in frames {}",
            fit.psi,
            fit.linear,
            named.join(", ")
        ))
        .hint("pin frames that the layout puts side by side by mistake, or ask for fewer sites"),
    )
}

/// Runs of left-out frames, which are two apart.
fn spans(frames: &[usize]) -> Vec<(usize, usize)> {
    let mut spans: Vec<(usize, usize)> = Vec::new();
    for &frame in frames {
        match spans.last_mut() {
            Some((_, last)) if frame == *last + 2 => *last = frame,
            _ => spans.push((frame, frame)),
        }
    }
    spans
}

/// A capture longer than anyone can read.
pub fn of_length(frames: usize, fps: Option<f64>) -> Option<Diagnostic> {
    let seconds = (frames.saturating_sub(1)) as f64 / fps?;
    (seconds > LEGIBLE).then(|| {
        Diagnostic::warning(format!(
            "{seconds:.0} seconds make a time signal that is hard to read and slow to fit"
        ))
        .hint("`--range A:B` fits a part")
    })
}

/// Rotations in doubt.
pub fn of_turns(turns: usize) -> Option<Diagnostic> {
    (turns > 0).then(|| {
        Diagnostic::warning(format!(
            "{turns} rotations turn by more than 150 degrees from one frame to the next: which way round \
             is a guess"
        ))
        .hint("more frames, or another space, leave no doubt")
    })
}
