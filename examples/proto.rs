//! p
use meshloom::io::Disk;
use meshloom::loom::fit::*;
use meshloom::loom::pins::*;
use meshloom::math::pca::Rows;
use meshloom::mesh::*;
use meshloom::pipeline::*;
use meshloom::task::Task;
use std::ops::Range;
struct Fr<'a>(&'a [f32], usize);
impl Rows for Fr<'_> {
    fn rows(&self) -> usize {
        self.0.len() / self.1
    }
    fn columns(&self) -> usize {
        self.1
    }
    fn copy(&self, row: usize, r: Range<usize>, out: &mut [f64]) {
        let s = row * self.1;
        for (o, x) in out.iter_mut().zip(&self.0[s + r.start..s + r.end]) {
            *o = f64::from(*x);
        }
    }
}
fn main() {
    let arg = std::env::args().nth(1).unwrap();
    let seq = if let Some(d) = meshloom::demo::Demo::find(&arg) {
        (d.generate)()
    } else {
        let Content::Sequence(s) = open(&Disk, &InputSpec::new(&arg), &Task::default())
            .unwrap()
            .output
            .content;
        s
    };
    let d = 3 * seq.topology().vertices();
    let nn = seq.frames();
    let half: Vec<f32> = (0..nn)
        .step_by(2)
        .flat_map(|f| seq.frame(f).to_vec())
        .collect();
    let n = half.len() / d;
    println!("{nn} frames, {n} kept");
    let share: f64 = std::env::args().nth(2).map_or(1.0, |s| s.parse().unwrap());
    let run = |pins: Vec<Pin>| {
        let o = FitOptions {
            controls: Some(((n + 2) as f64 * share) as usize),
            sites: Some((n as f64 * share) as usize),
            modes: Some(((n - 1) as f64 * share) as usize),
            left_out: false,
            pins,
            ..FitOptions::default()
        };
        fit_rows(&Fr(&half, d), &o, &Task::default()).unwrap()
    };
    let report = |f: &Fitted| {
        let m = f.shape.modes();
        let norm = (f.subspace.spread.powi(2) / n as f64).sqrt();
        let mut out = vec![];
        for i in 0..n - 1 {
            if 2 * i + 1 >= nn {
                continue;
            }
            let mut x = vec![0.0; m];
            f.signals
                .pose
                .evaluate(f.signals.time.at(i as f64 + 1.5).unwrap(), &mut x);
            let mut z = vec![0.0; d];
            f.shape.evaluate(&x, &mut z);
            let t = seq.frame(2 * i + 1);
            let (a, b) = (&half[i * d..(i + 1) * d], &half[(i + 1) * d..(i + 2) * d]);
            let e: f64 = (0..d)
                .map(|j| (z[j] - f64::from(t[j])).powi(2))
                .sum::<f64>()
                .sqrt()
                / norm;
            let l: f64 = (0..d)
                .map(|j| (0.5 * f64::from(a[j] + b[j]) - f64::from(t[j])).powi(2))
                .sum::<f64>()
                .sqrt()
                / norm;
            let s: f64 = (0..d)
                .map(|j| f64::from(a[j] - b[j]).powi(2))
                .sum::<f64>()
                .sqrt()
                / norm;
            out.push((i + 1, e, l, s));
        }
        out
    };
    let f = run(vec![]);
    let r = report(&f);
    for (i, e, l, s) in &r {
        println!(
            "span {i}: psi {e:.3} linear {l:.3} step {s:.3} {}",
            "*".repeat((e / l.max(1e-9)) as usize)
        );
    }
    let tot = |r: &[(usize, f64, f64, f64)]| {
        (
            (r.iter().map(|x| x.1 * x.1).sum::<f64>() / r.len() as f64).sqrt(),
            (r.iter().map(|x| x.2 * x.2).sum::<f64>() / r.len() as f64).sqrt(),
        )
    };
    println!("total psi, linear {:?}; stress {:?}", tot(&r), f.errors);

    let size = {
        let p = &f.signals.layout.positions;
        let mut m = 0.0f64;
        for a in p {
            for b in p {
                m = m.max((a[0] - b[0]).hypot(a[1] - b[1]));
            }
        }
        m
    };
    let lens: Vec<f64> = r.iter().map(|x| x.3).collect();
    let mut cum = vec![0.0];
    for l in &lens {
        cum.push(cum.last().unwrap() + l);
    }
    while cum.len() < n {
        cum.push(*cum.last().unwrap() + lens[0]);
    }
    for (name, turns) in [
        ("arc .5", 0.5),
        ("arc .8", 0.8),
        ("circle 1.0", 1.0),
        ("circle 2", 2.0f64),
    ] {
        let period = (n as f64 / turns).round() as usize;
        let place = |i: usize| {
            let (u, whole) = if turns > 1.0 {
                let j = i % period;
                (cum[j] / cum[period.min(n - 1)], 1.0)
            } else {
                (cum[i] / cum[n - 1], turns)
            };
            let a = u * whole * std::f64::consts::TAU;
            [0.5 * size * a.cos(), 0.5 * size * a.sin()]
        };
        let pins: Vec<Pin> = (0..n)
            .map(|i| Pin {
                frame: i + 1,
                at: PinPlace::Layout(place(i)),
            })
            .collect();
        let g = run(pins);
        let rr = report(&g);
        println!("{name}: {:?} total err {:.2e}", tot(&rr), g.errors.total);
    }

    for q in [1, 2, 3, 4, 6, 8] {
        for (name, turns) in [("arc .5", 0.5), ("circle 2", 2.0f64)] {
            let period = (n as f64 / turns).round() as usize;
            let place = |i: usize| {
                let (u, whole) = if turns > 1.0 {
                    let j = i % period;
                    (cum[j] / cum[period.min(n - 1)], 1.0)
                } else {
                    (cum[i] / cum[n - 1], turns)
                };
                let a = u * whole * std::f64::consts::TAU;
                [0.5 * size * a.cos(), 0.5 * size * a.sin()]
            };
            let pins: Vec<Pin> = (0..n)
                .filter(|i| i % q == 0 || *i == n - 1)
                .map(|i| Pin {
                    frame: i + 1,
                    at: PinPlace::Layout(place(i)),
                })
                .collect();
            let c = pins.len();
            let g = run(pins);
            let rr = report(&g);
            println!(
                "{name} every {q} ({c} pins): {:?} total err {:.2e} worst {:?}",
                tot(&rr),
                g.errors.total,
                rr.iter().map(|x| x.1).fold(0.0, f64::max)
            );
        }
    }
}
