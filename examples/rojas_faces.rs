//! Figures 9 and 10 of Rojas et al. 2014: faces of many people, neutral, happy and angry, as points of the
//! space of edge lengths. The paper has 600 scans (FRGC 2.0), which cannot be had; here are 24 heads made
//! of the built-in face by changes of proportion, each with its own strength of expression. As in the
//! scans not everybody shows every expression.

mod support;

use std::process::ExitCode;
use std::sync::Arc;

use meshloom::demo::{Demo, FACE_POSES};
use meshloom::diag::{Diagnostic, Result};
use meshloom::image::Image;
use meshloom::mesh::{FrameSource, Sequence, Topology};
use meshloom::plot::{Anchor, Group, Scatter, Scene, Theme, Tint, scatter};
use meshloom::statistics::{EDGE_LENGTHS, Ground, Population, Returned, aligned, aligned_rms};
use meshloom::task::Task;

use support::{Figure, View, table};

/// How many people there are.
const PEOPLE: usize = 24;

/// The kinds of faces, as in the paper's figures.
const KINDS: [&str; 3] = ["neutral", "happy", "angry"];

/// Side of a small picture, in units of the scene.
const SIDE: f32 = 170.0;

fn main() -> ExitCode {
    support::run_with("rojas_faces", &[], draw)
}

fn draw(figure: &mut Figure) -> Result<()> {
    let people = People::new()?;
    let poses = aligned(&people.faces);
    let ground = Ground::open(EDGE_LENGTHS, &people.topology, &poses)?;
    let population = Population::new(&ground, &poses, &Task::default())?;
    let map = nine(figure, &people, &population);
    let (modes, fits) = along(&ground, &population)?;
    let (ten, more) = ten(figure, &people, &poses, &ground)?;
    let fits = [fits, more].concat();
    println!("shapes from sums of edge lengths");
    table(&["shape", "by", "RMS ratio", "worst edge"], &fits);
    figure.picture(&compose(&people, map, &modes, &ten))
}

/// Numbers in [0, 1) that look like chance and are the same everywhere.
struct Chance(u64);

impl Chance {
    fn next(&mut self) -> f64 {
        self.0 = self
            .0
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// In [-1, 1), most often near 0.
    fn about(&mut self) -> f64 {
        self.next() + self.next() - 1.0
    }
}

/// The proportions of a head, 0 each for the built-in one.
#[derive(Clone, Copy)]
struct Head {
    wide: f64,
    high: f64,
    deep: f64,
    jaw: f64,
    nose: f64,
    brow: f64,
    lean: f64,
}

impl Head {
    const MEAN: Head = Head {
        wide: 0.0,
        high: 0.0,
        deep: 0.0,
        jaw: 0.0,
        nose: 0.0,
        brow: 0.0,
        lean: 0.0,
    };

    fn by(chance: &mut Chance) -> Head {
        Head {
            wide: 0.12 * chance.about(),
            high: 0.1 * chance.about(),
            deep: 0.1 * chance.about(),
            jaw: 0.2 * chance.about(),
            nose: 0.25 * chance.about(),
            brow: 0.1 * chance.about(),
            lean: 0.1 * chance.about(),
        }
    }

    /// The built-in head changed to these proportions; the middle and half the size of its neutral face
    /// are given. All changes are smooth.
    fn shaped(&self, face: &[f64], middle: [f64; 3], half: f64) -> Vec<f64> {
        let point = |p: &[f64]| {
            let [x, y, z]: [f64; 3] = std::array::from_fn(|k| (p[k] - middle[k]) / half);
            // below the middle the jaw is wider or narrower, at the nose's place the nose longer
            let low = 0.5 * (1.0 - (3.0 * (y + 0.25)).tanh());
            let bump = |at: [f64; 3], width: f64| {
                let square = (x - at[0]).powi(2) + (y - at[1]).powi(2) + (z - at[2]).powi(2);
                (-square / (width * width)).exp()
            };
            let nose = self.nose * bump([0.0, -0.05, 0.9], 0.25);
            let brow = self.brow * bump([0.0, 0.35, 0.75], 0.45);
            [
                x * (1.0 + self.wide + self.jaw * low),
                y * (1.0 + self.high),
                z * (1.0 + self.deep) + nose + brow + self.lean * y,
            ]
            .map(|x| x * half)
        };
        face.chunks_exact(3).flat_map(point).collect()
    }
}

/// Faces of one mesh.
struct People {
    topology: Arc<Topology>,
    faces: Vec<Vec<f64>>,
    /// Person and kind of each.
    who: Vec<(usize, usize)>,
    /// The head of mean proportions with mean expressions, by kind.
    mean: [Vec<f64>; 3],
}

impl People {
    fn new() -> Result<Self> {
        let Some(demo) = Demo::find("face") else {
            return Diagnostic::error("no demo `face`").err();
        };
        let capture = demo.generate();
        let frame = |name: &str| -> Result<Vec<f64>> {
            let Some(at) = FACE_POSES.iter().position(|&known| known == name) else {
                return Diagnostic::error(format!("no expression `{name}`")).err();
            };
            Ok(capture.frame(at).iter().map(|&x| f64::from(x)).collect())
        };
        let base = [frame("neutral")?, frame("smile")?, frame("anger")?];
        let range = |axis: usize| {
            let all = base[0].iter().skip(axis).step_by(3);
            all.fold([f64::MAX, f64::MIN], |[a, b], &x| [a.min(x), b.max(x)])
        };
        let middle: [f64; 3] = std::array::from_fn(|axis| 0.5 * range(axis).iter().sum::<f64>());
        let half = 0.5 * (range(1)[1] - range(1)[0]);
        let face = |head: &Head, kind: usize, strength: f64| {
            let between = base[0].iter().zip(&base[kind]);
            let face: Vec<f64> = between.map(|(a, b)| a + strength * (b - a)).collect();
            head.shaped(&face, middle, half)
        };
        let (mut faces, mut who) = (Vec::new(), Vec::new());
        let mut chance = Chance(2014);
        for person in 0..PEOPLE {
            let head = Head::by(&mut chance);
            let strength = [0.0, 0.8 + 0.4 * chance.about(), 0.8 + 0.2 * chance.about()];
            // two of three show each expression
            let shown = [true, person % 3 != 0, person % 3 != 1];
            for kind in (0..3).filter(|&kind| shown[kind]) {
                faces.push(face(&head, kind, strength[kind]));
                who.push((person, kind));
            }
        }
        Ok(People {
            topology: capture.topology().clone(),
            faces,
            who,
            mean: [0, 1, 2].map(|kind| face(&Head::MEAN, kind, 0.8)),
        })
    }

    /// Where the face of a person and a kind stands.
    fn find(&self, person: usize, kind: usize) -> Option<usize> {
        self.who.iter().position(|&one| one == (person, kind))
    }
}

/// Figure 9: the faces on two principal components. R14 finds that "angry and neutral faces are similar in E,
/// but happy faces have more diversity and move away from the central cluster". The second holds here by how
/// these faces are made; the first is a matter of who is angry how much, and is only printed.
fn nine(figure: &mut Figure, people: &People, population: &Population) -> Scene {
    let shares = population.explained();
    let first: f64 = shares.iter().take(3).sum();
    println!(
        "{} faces of {PEOPLE} people; three leading modes hold {} of the variance (R14: 12 % of 600 scans, which differ in more than seven proportions)",
        people.faces.len(),
        support::percent(first)
    );
    let of = |kind: usize| (0..people.who.len()).filter(move |&i| people.who[i].1 == kind);
    let modes = population.modes();
    let centre = |kind: usize| -> Vec<f64> {
        let count = of(kind).count() as f64;
        (0..modes)
            .map(|mode| {
                of(kind)
                    .map(|i| population.coordinates(i)[mode])
                    .sum::<f64>()
                    / count
            })
            .collect()
    };
    let distance = |a: &[f64], b: &[f64]| {
        let squares = a.iter().zip(b).map(|(a, b)| (a - b) * (a - b));
        squares.sum::<f64>().sqrt()
    };
    // what an expression changes of the person's own face, so that proportions do not count
    let changes = |kind: usize| -> Vec<f64> {
        let pairs = (0..PEOPLE).filter_map(|p| Some((people.find(p, 0)?, people.find(p, kind)?)));
        pairs
            .map(|(a, b)| distance(population.coordinates(a), population.coordinates(b)))
            .collect()
    };
    let centres = [0, 1, 2].map(centre);
    let mut rows = Vec::new();
    let mut measured = Vec::new();
    for kind in [1, 2] {
        let apart = distance(&centres[0], &centres[kind]);
        let changes = changes(kind);
        let mean = changes.iter().sum::<f64>() / changes.len() as f64;
        let square = changes.iter().map(|d| (d - mean) * (d - mean)).sum::<f64>();
        let spread = (square / changes.len() as f64).sqrt();
        rows.push(vec![
            KINDS[kind].to_string(),
            changes.len().to_string(),
            format!("{apart:.3}"),
            format!("{mean:.3}"),
            format!("{spread:.3}"),
        ]);
        measured.push((apart, spread));
    }
    println!("distances from neutral in edge lengths (R14, Fig. 9)");
    table(
        &[
            "",
            "people",
            "of the means",
            "from one's own",
            "spread of it",
        ],
        &rows,
    );
    println!(
        "happy faces lie {:.2} times as far from neutral ones as angry faces do (R14: farther)",
        measured[0].0 / measured[1].0
    );
    let change = |a: usize, b: usize| -> Vec<f64> {
        subtracted(population.coordinates(b), population.coordinates(a))
    };
    let pairs: Vec<(usize, Vec<f64>)> = [1, 2]
        .into_iter()
        .flat_map(|kind| (0..PEOPLE).map(move |person| (person, kind)))
        .filter_map(|(p, kind)| Some((kind, change(people.find(p, 0)?, people.find(p, kind)?))))
        .collect();
    let mean = |kind: usize| -> Vec<f64> {
        let own: Vec<_> = pairs.iter().filter(|(k, _)| *k == kind).collect();
        let sum = |mode: usize| own.iter().map(|(_, d)| d[mode]).sum::<f64>();
        (0..modes)
            .map(|mode| sum(mode) / own.len() as f64)
            .collect()
    };
    let means = [mean(1), mean(2)];
    let told = |(kind, change): &&(usize, Vec<f64>)| {
        (distance(change, &means[0]) < distance(change, &means[1])) == (*kind == 1)
    };
    figure.goal(
        "Fig. 9: the difference from one's own neutral face tells every happy face from every angry one",
        pairs.iter().filter(told).count() == pairs.len(),
    );
    figure.goal(
        "Fig. 9: happy faces are the more diverse",
        measured[0].1 > measured[1].1,
    );
    let tints = [Tint::Muted, Tint::Series(2), Tint::Series(1)];
    let axis = |mode: usize| format!("mode {} ({})", mode + 1, support::percent(shares[mode]));
    let groups = (0..3).map(|kind| Group {
        name: KINDS[kind].to_string(),
        tint: tints[kind],
        points: of(kind)
            .map(|i| {
                let at = population.coordinates(i);
                ([at[0], at[1]], String::new())
            })
            .collect(),
    });
    let points = Scatter {
        x: axis(0),
        y: axis(1),
        groups: groups.collect(),
    };
    scatter(&points, 6.0 * SIDE, 420.0, &Theme::light()).0
}

/// A found shape's row in the table.
fn line(name: &str, found: &Returned) -> Vec<String> {
    let by = found.by.map(|by| {
        vec![
            by.way.name().to_string(),
            format!("{:.4} %", by.rms_percent),
            format!("{:.2} %", by.worst_percent),
        ]
    });
    [vec![name.to_string()], by.unwrap_or_default()].concat()
}

type Named = Vec<(String, Vec<f64>)>;

/// New faces two standard deviations along the first three modes.
fn along(ground: &Ground, population: &Population) -> Result<(Named, Vec<Vec<String>>)> {
    let (mut shapes, mut rows) = (Vec::new(), Vec::new());
    for mode in 0..3 {
        for sigmas in [-2.0, 2.0] {
            let name = format!("mode {}, {sigmas:+}", mode + 1);
            let at = population.along(mode, sigmas);
            let found = ground.decode(&population.at(&at), &population.weights(&at))?;
            rows.push(line(&name, &found));
            shapes.push((name, found.positions));
        }
    }
    Ok((shapes, rows))
}

/// Figure 10: the mean of all neutral faces, and with the mean difference of those who show an expression.
fn ten(
    figure: &mut Figure,
    people: &People,
    poses: &[Vec<f64>],
    ground: &Ground,
) -> Result<(Named, Vec<Vec<String>>)> {
    let mut neutral = vec![0.0; poses.len()];
    for person in 0..PEOPLE {
        if let Some(at) = people.find(person, 0) {
            neutral[at] += 1.0 / PEOPLE as f64;
        }
    }
    let codes: Vec<Vec<f64>> = poses.iter().map(|pose| ground.encode(pose)).collect();
    let (mut shapes, mut rows) = (Vec::new(), Vec::new());
    let mut found_neutral = Vec::new();
    for kind in [0, 2, 1] {
        let mut weights = neutral.clone();
        let pairs: Vec<(usize, usize)> = (0..PEOPLE)
            .filter_map(|p| Some((people.find(p, 0)?, people.find(p, kind)?)))
            .collect();
        for (own, shown) in &pairs {
            weights[*shown] += 1.0 / pairs.len() as f64;
            weights[*own] -= 1.0 / pairs.len() as f64;
        }
        let mut code = vec![0.0; ground.dimension()];
        for (weight, row) in weights.iter().zip(&codes) {
            code.iter_mut().zip(row).for_each(|(x, l)| *x += weight * l);
        }
        let found = ground.decode(&code, &weights)?;
        let by = found.by.map_or(f64::MAX, |by| by.rms_percent);
        figure.goal(
            &format!("Fig. 10, {}: lengths met to 0.5 % (RMS ratio)", KINDS[kind]),
            by < 0.5,
        );
        rows.push(line(&format!("mean, {}", KINDS[kind]), &found));
        if kind == 0 {
            found_neutral = found.positions.clone();
        } else {
            // nobody has this face; the built-in head has the mean proportions
            let size = aligned_rms(&people.mean[kind], &people.mean[0]);
            let change = difference(&found.positions, &found_neutral);
            let wanted = difference(&people.mean[kind], &people.mean[0]);
            let off = (mean_square(&subtracted(&change, &wanted))).sqrt() / size;
            println!(
                "Fig. 10, {}: the change of the mean face differs from that of the head with mean proportions by {} of its size",
                KINDS[kind],
                support::percent(off)
            );
            figure.goal(
                &format!(
                    "Fig. 10, {}: more than half of the expression shows",
                    KINDS[kind]
                ),
                off < 0.5,
            );
        }
        shapes.push((KINDS[kind].to_string(), found.positions));
    }
    shapes.swap(0, 1);
    Ok((shapes, rows))
}

/// The second aligned with the first, taken from it.
fn difference(a: &[f64], b: &[f64]) -> Vec<f64> {
    let both = aligned(&[a.to_vec(), b.to_vec()]);
    subtracted(&both[0], &both[1])
}

fn subtracted(a: &[f64], b: &[f64]) -> Vec<f64> {
    a.iter().zip(b).map(|(a, b)| a - b).collect()
}

/// Of 3V numbers, a vertex.
fn mean_square(x: &[f64]) -> f64 {
    x.iter().map(|x| x * x).sum::<f64>() / (x.len() / 3) as f64
}

fn compose(people: &People, map: Scene, modes: &Named, ten: &Named) -> Scene {
    let theme = Theme::light();
    let line = SIDE + 36.0;
    let mut scene = Scene::new(6.0 * SIDE, 24.0 + map.height + 2.0 * line, theme.background);
    scene.write(
        "Fig. 9: faces in edge lengths",
        [8.0, 16.0],
        Anchor::Start,
        &theme,
    );
    let top = 24.0 + map.height;
    scene.place(map, [0.0, 24.0]);
    let all = modes.iter().chain(ten).flat_map(|(_, pose)| pose);
    let positions = all.map(|&x| x as f32).collect();
    let sequence = Sequence::new(Arc::clone(&people.topology), positions, None);
    let view = View::looking(&sequence, [0.35, 0.1]);
    let pictures = |named: &Named| -> Vec<(String, Arc<Image>)> {
        let each = named.iter().map(|(name, pose)| {
            let pose: Vec<f32> = pose.iter().map(|&x| x as f32).collect();
            (
                name.clone(),
                view.picture(&pose, 2 * SIDE as usize, [214, 184, 160]),
            )
        });
        each.collect()
    };
    for (at, (title, shapes)) in [
        ("two standard deviations along the modes", modes),
        (
            "Fig. 10: the mean face, and the mean expressions on it",
            ten,
        ),
    ]
    .into_iter()
    .enumerate()
    {
        let top = top + at as f32 * line;
        scene.write(title, [8.0, top + 14.0], Anchor::Start, &theme);
        support::row(
            &mut scene,
            [0.0, top + 14.0],
            SIDE,
            &pictures(shapes),
            &theme,
        );
    }
    scene
}
