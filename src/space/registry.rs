//! All shape spaces by name, and what they share.

use std::hash::{DefaultHasher, Hash, Hasher};
use std::sync::{Arc, OnceLock};

use super::living::Living;
use super::patch_lri::CoarsePatchLri;
use super::patching::{self, Fine, FinePatches, Patching};
use super::{Block, Gradients, LengthsAngles, Lri, PatchLri, ShapeSpace, SpaceError, Vertices};
use crate::math::sparse::SparseError;
use crate::mesh::{
    Components, Hinges, Poisson, PoissonAnalysis, ReferenceTriangle, Topology, reference_triangles,
    usual_patches,
};

/// A kind of shape space.
pub struct SpaceKind {
    /// Its name on the command line.
    pub name: &'static str,
    /// What it stores and when to use it, one line.
    pub summary: &'static str,
    shared: Sharing,
    build: Build,
}

/// When two spaces of a kind about the same reference pose are the same space.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Sharing {
    /// There is nothing worth sharing.
    Never,
    /// Always.
    Always,
    /// When they were adapted to the same poses, or have the same patches.
    SamePoses,
}

/// What a space in use was made for.
struct Made {
    kind: &'static str,
    topology: Arc<Topology>,
    reference: Arc<[f64]>,
    /// A fingerprint of the poses that it was adapted to, where it was.
    poses: Option<u64>,
}

static SPACES_IN_USE: Living<Made, dyn ShapeSpace> = Living::new();
static ANALYSES_IN_USE: Living<(), PoissonAnalysis> = Living::new();
static SYSTEMS_IN_USE: Living<(), Poisson> = Living::new();

/// Makes a space for given poses, or as an earlier one of its kind described itself.
type Build = fn(&Spaces, &[&[f64]], Option<&State>) -> Result<Arc<dyn ShapeSpace>, SpaceError>;

/// Every shape space. To add one: a file beside this one and a line here; `tests/space_laws.rs` then
/// runs over it.
pub const SPACES: &[SpaceKind] = &[
    SpaceKind {
        name: "vertices",
        summary: "positions: exact and fast, for frames close together",
        shared: Sharing::Never,
        build: |spaces, _, _| Ok(Arc::new(Vertices::new(spaces.vertices()))),
    },
    SpaceKind {
        name: "gradients",
        summary: "rotation and stretch of each triangle: for transfer and large motions",
        shared: Sharing::Always,
        build: |spaces, _, _| {
            Ok(Arc::new(Gradients::new(
                spaces.poisson()?,
                spaces.reference(),
            )))
        },
    },
    SpaceKind {
        name: "lri",
        summary: "edges in the frames of their ends: for local motions of any size",
        shared: Sharing::Always,
        build: lri,
    },
    SpaceKind {
        name: "patch-lri",
        summary: "rotations relative to patches, patches to each other: for the largest motions",
        shared: Sharing::SamePoses,
        build: patch_lri,
    },
    SpaceKind {
        name: "lengths-angles",
        summary: "edge lengths and dihedral angles: for blends that keep lengths and folds",
        shared: Sharing::Always,
        build: |spaces, _, _| {
            let (poisson, hinges) = (spaces.poisson()?, spaces.hinges()?);
            Ok(Arc::new(LengthsAngles::new(
                poisson,
                spaces.reference(),
                hinges,
            )?))
        },
    },
];

fn lri(
    spaces: &Spaces,
    _: &[&[f64]],
    _: Option<&State>,
) -> Result<Arc<dyn ShapeSpace>, SpaceError> {
    let analysis = spaces.analysis()?;
    Ok(Arc::new(Lri::new(
        &analysis,
        spaces.reference(),
        spaces.rest(),
        spaces.hinges()?,
    )?))
}

fn patch_lri(
    spaces: &Spaces,
    poses: &[&[f64]],
    state: Option<&State>,
) -> Result<Arc<dyn ShapeSpace>, SpaceError> {
    let (poisson, reference, hinges) = (spaces.poisson()?, spaces.reference(), spaces.hinges()?);
    let (triangles, rest) = (spaces.topology.triangles(), poisson.reference());
    let patch = match state {
        None => {
            let sought = usual_patches(triangles.len());
            patching::grow((rest, triangles, &[]), &hinges, (&reference, poses), sought)
        }
        Some(state) => state.patches.clone(),
    };
    let patching = Patching::new(rest, &[], &hinges, patch)?;
    Ok(Arc::new(PatchLri::new(poisson, reference, patching)))
}

/// What a space is made of besides connectivity, for storing it.
#[derive(Debug, Clone, PartialEq)]
pub struct State {
    /// The space's name.
    pub name: String,
    /// The reference pose, 3V positions; empty for `vertices`.
    pub reference: Vec<f64>,
    /// The patch of each triangle, for `patch-lri`; else empty.
    pub patches: Vec<u32>,
    /// The weight of each block, in the order of [`ShapeSpace::blocks`].
    pub weights: Vec<f64>,
}

impl State {
    /// The state of a space without patches.
    pub(super) fn new(space: &dyn ShapeSpace, reference: &[f64]) -> Self {
        State {
            name: space.name().to_string(),
            reference: reference.to_vec(),
            patches: Vec::new(),
            weights: space
                .blocks()
                .iter()
                .map(|block: &Block| block.weight)
                .collect(),
        }
    }
}

/// What the spaces of one connectivity and one reference pose share: each factor is made when first
/// needed and only once. As long as anyone holds a space, another [`Spaces`] of the same connectivity and
/// reference finds it and its factors too.
pub struct Spaces {
    topology: Arc<Topology>,
    reference: Arc<[f64]>,
    analysis: Arc<OnceLock<Result<Arc<PoissonAnalysis>, SpaceError>>>,
    hinges: Arc<OnceLock<Arc<Hinges>>>,
    rest: OnceLock<Arc<[ReferenceTriangle]>>,
    poisson: OnceLock<Result<Arc<Poisson>, SpaceError>>,
}

impl Spaces {
    /// Spaces about a reference pose of 3V positions. Nothing is computed yet.
    ///
    /// # Panics
    /// The reference is not 3V long.
    pub fn new(topology: Arc<Topology>, reference: &[f64]) -> Self {
        assert_eq!(
            reference.len(),
            3 * topology.vertices(),
            "reference of another mesh"
        );
        Spaces {
            topology,
            reference: reference.into(),
            analysis: Arc::default(),
            hinges: Arc::default(),
            rest: OnceLock::new(),
            poisson: OnceLock::new(),
        }
    }

    /// Spaces about another reference pose: the symbolic factors are shared.
    ///
    /// # Panics
    /// The reference is not 3V long.
    #[must_use]
    pub fn about(&self, reference: &[f64]) -> Self {
        let mut other = Spaces::new(Arc::clone(&self.topology), reference);
        other.analysis = Arc::clone(&self.analysis);
        other.hinges = Arc::clone(&self.hinges);
        other
    }

    /// The space called `name`. `poses` are shapes that it will have to hold (a sample of the frames,
    /// the keys), each 3V positions; a space that adapts to them (`patch-lri`) does, others ignore them.
    ///
    /// # Errors
    /// [`SpaceError`]; an unknown name is unsuitable.
    pub fn open(&self, name: &str, poses: &[&[f64]]) -> Result<Arc<dyn ShapeSpace>, SpaceError> {
        let kind = kind(name)?;
        let adapted = match kind.shared {
            Sharing::SamePoses => Some(fingerprint(poses)),
            Sharing::Never | Sharing::Always => None,
        };
        let build = || (kind.build)(self, poses, None);
        self.shared(kind, adapted, |made, _| made.poses == adapted, build)
    }

    /// The space that had this state, its reference being that of `self` ([`Spaces::of_state`]).
    ///
    /// # Errors
    /// As [`Spaces::open`]; also when the state does not fit the connectivity, or was written with
    /// other block weights than the reference gives.
    pub fn restore(&self, state: &State) -> Result<Arc<dyn ShapeSpace>, SpaceError> {
        let kind = kind(&state.name)?;
        let build = || (kind.build)(self, &[], Some(state));
        let same = |_: &Made, space: &(dyn ShapeSpace + 'static)| {
            kind.shared == Sharing::Always || space.state().patches == state.patches
        };
        let space = self.shared(kind, None, same, build)?;
        let blocks = space.blocks();
        let same = blocks.len() == state.weights.len()
            && blocks
                .iter()
                .zip(&state.weights)
                .all(|(block, weight)| (block.weight - weight).abs() <= 1e-9 * block.weight);
        match same {
            true => Ok(space),
            false => Err(SpaceError::Unsuitable {
                reason: format!(
                    "the coordinates in `{}` have other block weights",
                    state.name
                ),
            }),
        }
    }

    /// A space of this connectivity and reference that is in use already, or a new one.
    fn shared(
        &self,
        kind: &SpaceKind,
        poses: Option<u64>,
        same: impl Fn(&Made, &(dyn ShapeSpace + 'static)) -> bool,
        build: impl FnOnce() -> Result<Arc<dyn ShapeSpace>, SpaceError>,
    ) -> Result<Arc<dyn ShapeSpace>, SpaceError> {
        if kind.shared == Sharing::Never {
            return build();
        }
        self.check_reference()?;
        let fits = |made: &Made, space: &(dyn ShapeSpace + 'static)| {
            made.kind == kind.name
                && made.reference == self.reference
                && made.topology.same_connectivity(&self.topology)
                && same(made, space)
        };
        let made = || Made {
            kind: kind.name,
            topology: Arc::clone(&self.topology),
            reference: self.reference(),
            poses,
        };
        SPACES_IN_USE.find_or(fits, || Ok((made(), build()?)))
    }

    /// No system of a space whose reference pose has numbers that are not finite can be solved.
    fn check_reference(&self) -> Result<(), SpaceError> {
        match self.reference.iter().position(|x| !x.is_finite()) {
            None => Ok(()),
            Some(at) => Err(self.singular(at / 3)),
        }
    }

    /// The error at a vertex, with the part of the mesh that it lies in.
    fn singular(&self, vertex: usize) -> SpaceError {
        let parts = Components::new(self.vertices(), self.topology.triangles());
        SpaceError::Singular {
            vertex,
            part: Some([parts.part()[vertex] as usize, parts.count()]),
        }
    }

    /// Spaces about the reference pose of a stored space.
    ///
    /// # Errors
    /// The state has a reference of another mesh.
    pub fn of_state(topology: Arc<Topology>, state: &State) -> Result<Self, SpaceError> {
        let length = 3 * topology.vertices();
        match state.reference.len() {
            0 => Ok(Spaces::new(topology, &vec![0.0; length])),
            found if found == length => Ok(Spaces::new(topology, &state.reference)),
            found => Err(SpaceError::Unsuitable {
                reason: format!("the reference pose has {found} coordinates, the mesh {length}"),
            }),
        }
    }

    /// The reference pose.
    pub fn reference(&self) -> Arc<[f64]> {
        Arc::clone(&self.reference)
    }

    fn vertices(&self) -> usize {
        self.topology.vertices()
    }

    /// The connectivity, analysed.
    fn analysis(&self) -> Result<Arc<PoissonAnalysis>, SpaceError> {
        let triangles = self.topology.triangles();
        let same = |_: &(), found: &PoissonAnalysis| {
            found.vertices() == self.vertices() && found.triangles() == triangles
        };
        let analyse = || Ok(((), PoissonAnalysis::new(self.vertices(), triangles)?));
        let init = || ANALYSES_IN_USE.find_or(same, analyse);
        self.analysis.get_or_init(init).clone()
    }

    /// The triangles of the reference pose.
    fn rest(&self) -> Arc<[ReferenceTriangle]> {
        let make = || reference_triangles(self.topology.triangles(), &self.reference);
        Arc::clone(self.rest.get_or_init(make))
    }

    /// The factored system that finds positions from gradients.
    fn poisson(&self) -> Result<Arc<Poisson>, SpaceError> {
        let init = || {
            let (analysis, rest) = (self.analysis()?, self.rest());
            let same = |_: &(), found: &Poisson| {
                Arc::ptr_eq(found.analysis(), &analysis) && found.reference()[..] == rest[..]
            };
            let (analysis, rest) = (Arc::clone(&analysis), Arc::clone(&rest));
            let factor = || match Poisson::new(analysis, rest) {
                Ok(poisson) => Ok(((), Arc::new(poisson))),
                Err(SparseError::NotPositiveDefinite { unknown }) => Err(self.singular(unknown)),
                Err(error) => Err(error.into()),
            };
            SYSTEMS_IN_USE.find_or(same, factor)
        };
        self.poisson.get_or_init(init).clone()
    }

    /// The edges and the pairs of triangles at them.
    fn hinges(&self) -> Result<Arc<Hinges>, SpaceError> {
        let analysis = self.analysis()?;
        let collect = || {
            let triangles = self.topology.triangles();
            Arc::new(Hinges::new(self.vertices(), triangles, analysis.corners()))
        };
        Ok(Arc::clone(self.hinges.get_or_init(collect)))
    }
}

/// Of poses that a space adapts to. Were two sets ever confused, the space would still be one of its kind.
fn fingerprint(poses: &[&[f64]]) -> u64 {
    let mut hasher = DefaultHasher::new();
    for pose in poses {
        pose.len().hash(&mut hasher);
        pose.iter().for_each(|x| x.to_bits().hash(&mut hasher));
    }
    hasher.finish()
}

impl Spaces {
    /// `patch-lri` in which triangles count by `weights` beside their area, as those do that are torn between `poses`
    /// ([`crate::mesh::torn`]).
    ///
    /// # Errors
    /// As [`Spaces::open`].
    ///
    /// # Panics
    /// There is not one weight a triangle.
    pub fn open_weighted(
        &self,
        poses: &[&[f64]],
        weights: &[f64],
    ) -> Result<Arc<dyn ShapeSpace>, SpaceError> {
        let (triangles, rest, hinges) = (self.topology.triangles(), self.rest(), self.hinges()?);
        let sought = usual_patches(triangles.len());
        let poses = (&self.reference[..], poses);
        let patch = patching::grow((&rest, triangles, weights), &hinges, poses, sought);
        let patching = Patching::new(&rest, weights, &hinges, patch)?;
        let poisson = Poisson::weighted(self.analysis()?, rest, weights.to_vec())?;
        let space = PatchLri::new(Arc::new(poisson), self.reference(), patching);
        Ok(Arc::new(space.tearing(weights)))
    }

    /// `patch-lri` of a coarse mesh that stands for `fine`: patches, and how they turn against each other,
    /// are those of the finer mesh. Triangles of the coarse mesh count by `weights`, unless there are none.
    ///
    /// # Errors
    /// As [`Spaces::open`].
    ///
    /// # Panics
    /// `fine` has another number of carriers than triangles, or names a triangle that there is not.
    pub fn open_coarse(
        &self,
        fine: &Fine<'_>,
        weights: &[f64],
    ) -> Result<CoarsePatchLri, SpaceError> {
        let hinges = self.hinges()?;
        let poisson = match weights {
            [] => self.poisson()?,
            some => Arc::new(Poisson::weighted(
                self.analysis()?,
                self.rest(),
                some.to_vec(),
            )?),
        };
        let triangles = self.topology.triangles().len();
        let (fine, patching) = FinePatches::grown(fine, triangles, &hinges)?;
        let space = PatchLri::new(poisson, self.reference(), patching).tearing(weights);
        Ok(CoarsePatchLri::new(space, fine))
    }
}

fn kind(name: &str) -> Result<&'static SpaceKind, SpaceError> {
    SPACES.iter().find(|kind| kind.name == name).ok_or_else(|| {
        let known: Vec<&str> = SPACES.iter().map(|kind| kind.name).collect();
        SpaceError::Unsuitable {
            reason: format!("there is no space `{name}`; there are {}", known.join(", ")),
        }
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_reference_pose_that_no_system_can_hold_names_its_vertex_and_part() {
        // two triangles apart, their vertices taking turns
        let triangles = [[0, 2, 4], [1, 3, 5]];
        let topology = Arc::new(Topology::from_triangles(6, &triangles).unwrap());
        let pose = |scale: f64, bad: Option<(usize, f64)>| {
            let mut pose: Vec<f64> = (0..18).map(|i| scale * ((i * i) % 7) as f64).collect();
            bad.into_iter().for_each(|(at, x)| pose[at] = x);
            pose
        };
        for kind in SPACES {
            let open = |pose: &[f64]| Spaces::new(Arc::clone(&topology), pose).open(kind.name, &[]);
            assert!(open(&pose(1.0, None)).is_ok(), "{}", kind.name);
            if kind.shared == Sharing::Never {
                continue;
            }
            for bad in [f64::NAN, f64::INFINITY] {
                let error = open(&pose(1.0, Some((3 * 5 + 1, bad)))).err().unwrap();
                let expected = SpaceError::Singular {
                    vertex: 5,
                    part: Some([1, 2]),
                };
                assert_eq!(error, expected, "{}", kind.name);
                let told: Box<crate::diag::Diagnostic> = error.into();
                assert!(
                    told.message.contains("vertex 6, in part 2 of 2"),
                    "{told:?}"
                );
                assert!(!told.hints.is_empty());
            }
        }
    }
}
