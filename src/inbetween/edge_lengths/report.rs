//! How well an embedding meets its lengths.

/// An edge that misses its length.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Missed {
    /// The edge, an index into [`super::Embedding::edges`].
    pub edge: usize,
    /// Its error in percent of its length, signed: positive where it came out too long.
    pub percent: f64,
}

/// The errors of edge lengths against those that were asked for.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct EdgeFit {
    /// `100 sqrt(mean (l - l*)^2) / mean l*`: the left graph of Fig. 12 of Rojas et al. 2014.
    pub rms_percent: f64,
    /// Relative errors in percent at the percentiles of [`PERCENTILES`].
    pub percentiles: [f64; 4],
    /// The worst edge (the right graph of Fig. 12); none where every edge is met exactly.
    pub worst: Option<Missed>,
    /// The part of the edges within 1 % of their lengths; 1 for a mesh without edges.
    pub within: f64,
    /// The edges that are not, the worst first.
    pub missed: Vec<Missed>,
}

/// The percentiles in [`EdgeFit::percentiles`].
pub const PERCENTILES: [f64; 4] = [50.0, 90.0, 98.0, 99.0];

/// An edge is met within this relative error, in percent.
const NEAR: f64 = 1.0;

impl EdgeFit {
    /// Compares lengths found with those asked for. Where none is asked for (0), the mean stands below.
    ///
    /// # Panics
    /// The two differ in length.
    pub fn new(asked: &[f64], found: &[f64]) -> Self {
        assert_eq!(asked.len(), found.len(), "lengths of another mesh");
        let count = asked.len().max(1) as f64;
        let mean = asked.iter().sum::<f64>() / count;
        let squares: f64 = asked
            .iter()
            .zip(found)
            .map(|(a, b)| (b - a) * (b - a))
            .sum();
        let percent = |a: f64, b: f64| {
            let below = if a > 0.0 { a } else { mean };
            if below > 0.0 {
                100.0 * (b - a) / below
            } else {
                0.0
            }
        };
        let errors: Vec<f64> = asked
            .iter()
            .zip(found)
            .map(|(&a, &b)| percent(a, b))
            .collect();
        let mut sizes: Vec<f64> = errors.iter().map(|e| e.abs()).collect();
        sizes.sort_by(f64::total_cmp);
        let mut order: Vec<usize> = (0..errors.len()).filter(|&e| errors[e] != 0.0).collect();
        order.sort_by(|&a, &b| errors[b].abs().total_cmp(&errors[a].abs()).then(a.cmp(&b)));
        let missed = |&edge: &usize| Missed {
            edge,
            percent: errors[edge],
        };
        let worst = order.first().map(missed);
        let beyond = order.iter().take_while(|&&edge| errors[edge].abs() > NEAR);
        let missed: Vec<Missed> = beyond.map(missed).collect();
        EdgeFit {
            rms_percent: if mean > 0.0 {
                100.0 * (squares / count).sqrt() / mean
            } else {
                0.0
            },
            percentiles: PERCENTILES.map(|at| percentile(&sizes, at)),
            worst,
            within: 1.0 - missed.len() as f64 / count,
            missed,
        }
    }

    /// The size of the worst relative error, in percent.
    pub fn max_percent(&self) -> f64 {
        self.worst.map_or(0.0, |missed| missed.percent.abs())
    }
}

/// The smallest number that at least this part of ascending numbers does not exceed; 0 of none.
fn percentile(ascending: &[f64], percent: f64) -> f64 {
    let rank = (percent / 100.0 * ascending.len() as f64).ceil() as usize;
    ascending
        .get(rank.saturating_sub(1))
        .copied()
        .unwrap_or(0.0)
}

/// What an embedding did and how well it went.
#[derive(Debug, Clone, PartialEq)]
pub struct EmbedReport {
    /// E(A) of equation (3) at the dihedral angles that were given.
    pub residual_before: f64,
    /// E(A) after they were changed to close the walks.
    pub residual: f64,
    /// How many vertices have a closed walk, which is one equation (1).
    pub walks: usize,
    /// Steps of the dihedral solve and of the finishing solve; each is one factorisation.
    pub steps: [usize; 2],
    /// Edge lengths of the positions against those asked for.
    pub edges: EdgeFit,
    /// Vertices around which the corner angles cannot close, with the radians that are missing, the worst
    /// first (R14 §4: the boundaries of the space of edge lengths).
    pub impossible: Vec<(usize, f64)>,
    /// Parts of the mesh that came out as their mirror image and were reflected.
    pub mirrored: usize,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn errors_are_ranked_and_named() {
        let asked = [1.0, 2.0, 1.0, 0.0];
        let fit = EdgeFit::new(&asked, &[1.0, 2.1, 0.995, 0.0]);
        assert_eq!(fit.missed.len(), 1);
        assert_eq!(fit.missed[0].edge, 1);
        assert!((fit.max_percent() - 5.0).abs() < 1e-9);
        assert_eq!(fit.within, 0.75);
        assert!((fit.percentiles[3] - 5.0).abs() < 1e-9 && fit.percentiles[0] == 0.0);
        let rms = 100.0 * ((0.01_f64 + 0.000025) / 4.0).sqrt();
        assert!((fit.rms_percent - rms).abs() < 1e-9);
        assert_eq!(EdgeFit::new(&asked, &asked).worst, None);
        assert_eq!(EdgeFit::new(&[], &[]).within, 1.0);
    }
}
