//! Which shapes are like those of a motion: between the strands of its curve a map may hold anything, for
//! nothing was asked of it there.

/// Shapes so many times as far out as the farthest of a motion look strange.
pub(super) const STRANGE: f64 = 1.75;

/// Where the shapes of a motion lie: about their mean, within an ellipsoid through the farthest of them.
pub(super) struct Poses {
    mean: Vec<f64>,
    /// One over the ellipsoid's squared half axes.
    weights: Vec<f64>,
}

/// Each mode's variance is taken to be larger by this part of the largest: modes that hardly move are not
/// seen.
const UNSEEN: f64 = 1e-6;

impl Poses {
    /// Those of frames, each a row of coordinates in the shape subspace.
    pub(super) fn of(x: &[Vec<f64>]) -> Self {
        let (n, m) = (x.len().max(1) as f64, x.first().map_or(0, Vec::len));
        let mean_of = |of: &dyn Fn(&Vec<f64>) -> f64| x.iter().map(of).sum::<f64>() / n;
        let mean: Vec<f64> = (0..m).map(|k| mean_of(&|x| x[k])).collect();
        let variances: Vec<f64> = (0..m)
            .map(|k| mean_of(&|x| (x[k] - mean[k]) * (x[k] - mean[k])))
            .collect();
        let least = UNSEEN * variances.iter().copied().fold(0.0, f64::max);
        let weights = variances
            .iter()
            .map(|v| 1.0 / (v + least).max(f64::MIN_POSITIVE));
        let mut poses = Poses {
            mean,
            weights: weights.collect(),
        };
        let farthest = x.iter().map(|x| poses.strangeness(x)).fold(0.0, f64::max);
        if farthest > 0.0 {
            poses
                .weights
                .iter_mut()
                .for_each(|w| *w /= farthest * farthest);
        }
        poses
    }

    /// How far a shape is out: at most 1 for those of the motion.
    pub(super) fn strangeness(&self, x: &[f64]) -> f64 {
        let away = x.iter().zip(&self.mean).zip(&self.weights);
        away.map(|((x, mean), w)| w * (x - mean) * (x - mean))
            .sum::<f64>()
            .sqrt()
    }

    /// The same, and its derivative written to `along`; 0 in the middle.
    pub(super) fn strangeness_with_gradient(&self, x: &[f64], along: &mut [f64]) -> f64 {
        let strangeness = self.strangeness(x);
        let scale = if strangeness > 0.0 {
            1.0 / strangeness
        } else {
            0.0
        };
        let away = x.iter().zip(&self.mean).zip(&self.weights);
        for (along, ((x, mean), w)) in along.iter_mut().zip(away) {
            *along = scale * w * (x - mean);
        }
        strangeness
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn frames() -> Vec<Vec<f64>> {
        let wave = |i: usize, by: f64| libm::sin(by * i as f64);
        (0..20)
            .map(|i| vec![10.0 + 3.0 * wave(i, 0.4), wave(i, 0.9), 0.1 * wave(i, 2.1)])
            .collect()
    }

    #[test]
    fn frames_and_blends_of_them_are_not_strange() {
        let x = frames();
        let poses = Poses::of(&x);
        let all = x.iter().map(|x| poses.strangeness(x));
        let most = all.fold(0.0, f64::max);
        assert!((most - 1.0).abs() < 1e-12);
        for (a, b) in x.iter().zip(&x[7..]) {
            let blend: Vec<f64> = a.iter().zip(b).map(|(a, b)| 0.3 * a + 0.7 * b).collect();
            assert!(poses.strangeness(&blend) <= 1.0);
        }
        // as far out in the mode that hardly moves as the first mode goes
        assert!(poses.strangeness(&[10.0, 0.0, 3.0]) > 10.0);
    }

    #[test]
    fn the_gradient_is_that_of_differences() {
        let poses = Poses::of(&frames());
        let (at, step) = ([11.0, 0.4, -0.2], 1e-6);
        let mut along = [0.0; 3];
        let here = poses.strangeness_with_gradient(&at, &mut along);
        assert_eq!(here, poses.strangeness(&at));
        for k in 0..3 {
            let moved = |by: f64| {
                let mut to = at;
                to[k] += by;
                poses.strangeness(&to)
            };
            let difference = (moved(step) - moved(-step)) / (2.0 * step);
            assert!((along[k] - difference).abs() < 1e-7 * difference.abs().max(1.0));
        }
    }
}
