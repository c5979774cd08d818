//! Column-pivoted orthogonalisation of a few long columns: A P = Q R with |r_11| >= |r_22| >= ..., by
//! Gram-Schmidt done twice. The rank is cut where nothing new is left.

/// A P = Q R of a d x m matrix, m << d, kept to its rank r.
#[derive(Debug, Clone, PartialEq)]
pub struct PivotedQr {
    /// r orthonormal columns of d numbers.
    basis: Vec<Vec<f64>>,
    /// Row i: entries i.. of R's row i, in the pivoted order of the r kept columns.
    rows: Vec<Vec<f64>>,
    /// The kept columns in the order taken.
    order: Vec<usize>,
    novelty: Vec<f64>,
}

impl PivotedQr {
    /// Factors `columns`, all d long. What is left of a column after all those taken before counts as
    /// nothing below `cut` times the column's own norm.
    pub fn new(columns: &[Vec<f64>], cut: f64) -> Self {
        let sizes: Vec<f64> = columns.iter().map(|column| norm(column)).collect();
        let mut rest: Vec<Vec<f64>> = columns.to_vec();
        let mut left: Vec<usize> = (0..columns.len()).collect();
        let mut found = PivotedQr {
            basis: Vec::new(),
            rows: Vec::new(),
            order: Vec::new(),
            novelty: vec![0.0; columns.len()],
        };
        while !left.is_empty() {
            let share = |&column: &usize| match sizes[column] > 0.0 {
                true => norm(&rest[column]) / sizes[column],
                false => 0.0,
            };
            let longest = |a: &usize, b: &usize| norm(&rest[*a]).total_cmp(&norm(&rest[*b]));
            let Some(&next) = left.iter().rev().max_by(|a, b| longest(a, b)) else {
                break;
            };
            left.retain(|&column| column != next);
            found.novelty[next] = share(&next);
            if found.novelty[next] <= cut {
                continue;
            }
            let mut q = std::mem::take(&mut rest[next]);
            for earlier in &found.basis {
                let again = dot(earlier, &q);
                add(&mut q, earlier, -again);
            }
            let size = norm(&q);
            q.iter_mut().for_each(|x| *x /= size);
            for &column in &left {
                let along = dot(&q, &rest[column]);
                add(&mut rest[column], &q, -along);
            }
            found.order.push(next);
            found.basis.push(q);
        }
        found.rows = (0..found.basis.len())
            .map(|i| {
                let later = found.order[i..].iter();
                later.map(|&j| dot(&found.basis[i], &columns[j])).collect()
            })
            .collect();
        found
    }

    /// r, the rank.
    pub fn rank(&self) -> usize {
        self.order.len()
    }

    /// For each column the part of it (0 to 1) that those taken before it do not reach: small for a
    /// column that is nearly a combination of others.
    pub fn novelty(&self) -> &[f64] {
        &self.novelty
    }

    /// The coefficients x, one a column (0 for those cut), that minimise |A x - b|, and that distance.
    ///
    /// # Panics
    /// `b` is not d long.
    pub fn solve(&self, b: &[f64]) -> (Vec<f64>, f64) {
        let mut rest = b.to_vec();
        let mut y = vec![0.0; self.rank()];
        for _ in 0..2 {
            for (y, q) in y.iter_mut().zip(&self.basis) {
                assert_eq!(q.len(), rest.len(), "a right side of another length");
                let along = dot(q, &rest);
                *y += along;
                add(&mut rest, q, -along);
            }
        }
        for i in (0..y.len()).rev() {
            let later: f64 = (i + 1..y.len()).map(|j| self.rows[i][j - i] * y[j]).sum();
            y[i] = (y[i] - later) / self.rows[i][0];
        }
        let mut x = vec![0.0; self.novelty.len()];
        for (&column, value) in self.order.iter().zip(y) {
            x[column] = value;
        }
        (x, norm(&rest))
    }
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

fn norm(a: &[f64]) -> f64 {
    dot(a, a).sqrt()
}

fn add(a: &mut [f64], b: &[f64], factor: f64) {
    a.iter_mut().zip(b).for_each(|(a, b)| *a += factor * b);
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn combined(columns: &[Vec<f64>], x: &[f64]) -> Vec<f64> {
        let mut sum = vec![0.0; columns[0].len()];
        columns
            .iter()
            .zip(x)
            .for_each(|(c, x)| add(&mut sum, c, *x));
        sum
    }

    proptest! {
        #[test]
        fn what_columns_reach_is_solved_and_the_rest_is_perpendicular(
            entries in prop::collection::vec(-1.0..1.0_f64, 40),
            b in prop::collection::vec(-1.0..1.0_f64, 8),
        ) {
            let columns: Vec<Vec<f64>> = entries.chunks(8).map(<[f64]>::to_vec).collect();
            let qr = PivotedQr::new(&columns, 1e-9);
            let (x, distance) = qr.solve(&b);
            let mut rest = b.clone();
            add(&mut rest, &combined(&columns, &x), -1.0);
            prop_assert!((norm(&rest) - distance).abs() < 1e-8);
            for column in &columns {
                // the condition of a random 8 x 5 matrix is far below 1e6
                prop_assert!(dot(column, &rest).abs() < 1e-8);
            }
        }
    }

    #[test]
    fn copies_are_cut_and_named() {
        let columns = vec![
            vec![1.0, 0.0, 1.0],
            vec![3.0, 0.0, 3.0],
            vec![0.0, 2.0, 0.0],
            vec![0.0; 3],
        ];
        let qr = PivotedQr::new(&columns, 1e-9);
        assert_eq!(qr.rank(), 2);
        assert!(qr.novelty()[0] < 1e-15 && qr.novelty()[3] == 0.0);
        let (x, distance) = qr.solve(&[3.0, 4.0, 3.0]);
        assert_eq!((x[0], x[3]), (0.0, 0.0));
        assert!((x[1] - 1.0).abs() < 1e-15 && (x[2] - 2.0).abs() < 1e-15 && distance < 1e-15);
    }
}
