//! Nodes of a scene and where they stand: each has a place relative to its parent.

use gltf::Document;
use gltf::scene::Transform;
use nalgebra::{Matrix4, Quaternion, Vector3};

use super::damaged;
use crate::diag::Result;

/// A place relative to the parent.
#[derive(Debug, Clone, Copy)]
pub(super) enum Local {
    /// Given as a matrix; cannot be animated.
    Matrix(Matrix4<f64>),
    /// Translation, rotation (x y z w), scale.
    Parts([f64; 3], [f64; 4], [f64; 3]),
}

/// All nodes, parents before children.
pub(super) struct Hierarchy {
    /// Nodes in an order in which parents come first, each with its parent.
    order: Vec<(usize, Option<usize>)>,
    /// Places at rest, by node.
    pub(super) rest: Vec<Local>,
    /// Weights of morph targets at rest, by node.
    pub(super) weights: Vec<Vec<f64>>,
    /// Nodes of the scene that is shown, parents before children.
    pub(super) shown: Vec<usize>,
}

impl Hierarchy {
    pub(super) fn new(document: &Document) -> Result<Self> {
        let count = document.nodes().count();
        let mut parent = vec![None; count];
        let mut children = vec![Vec::new(); count];
        for node in document.nodes() {
            for child in node.children() {
                if parent[child.index()].replace(node.index()).is_some() {
                    return damaged("a node has two parents").err();
                }
                children[node.index()].push(child.index());
            }
        }
        let roots = (0..count).filter(|&node| parent[node].is_none());
        let order = descend(roots, &children);
        if order.len() < count {
            return damaged("the nodes form a circle").err();
        }
        let scene = document
            .default_scene()
            .or_else(|| document.scenes().next());
        let shown = match scene {
            Some(scene) => descend(scene.nodes().map(|node| node.index()), &children),
            None => order.clone(),
        };
        Ok(Hierarchy {
            order: order.into_iter().map(|node| (node, parent[node])).collect(),
            rest: document
                .nodes()
                .map(|node| local(&node.transform()))
                .collect(),
            weights: document.nodes().map(|node| weights(&node)).collect(),
            shown,
        })
    }

    /// Where the nodes stand in the world, from where they stand relative to their parents.
    pub(super) fn globals(&self, locals: &[Local]) -> Vec<Matrix4<f64>> {
        let mut globals = vec![Matrix4::identity(); locals.len()];
        for &(node, parent) in &self.order {
            let local = matrix(&locals[node]);
            globals[node] = match parent {
                Some(parent) => globals[parent] * local,
                None => local,
            };
        }
        globals
    }
}

/// `roots` and everything below, each once, parents first.
fn descend(roots: impl Iterator<Item = usize>, children: &[Vec<usize>]) -> Vec<usize> {
    let mut order: Vec<usize> = Vec::new();
    let mut seen = vec![false; children.len()];
    let mut waiting: Vec<usize> = roots.collect();
    waiting.reverse();
    while let Some(node) = waiting.pop() {
        if !std::mem::replace(&mut seen[node], true) {
            order.push(node);
            waiting.extend(children[node].iter().rev());
        }
    }
    order
}

fn local(transform: &Transform) -> Local {
    match transform {
        Transform::Matrix { matrix } => {
            let columns = matrix.as_flattened().iter().map(|&value| f64::from(value));
            Local::Matrix(Matrix4::from_iterator(columns))
        }
        Transform::Decomposed {
            translation,
            rotation,
            scale,
        } => Local::Parts(
            translation.map(f64::from),
            rotation.map(f64::from),
            scale.map(f64::from),
        ),
    }
}

fn matrix(local: &Local) -> Matrix4<f64> {
    match local {
        Local::Matrix(matrix) => *matrix,
        Local::Parts(translation, [x, y, z, w], scale) => {
            let rotation = Quaternion::new(*w, *x, *y, *z);
            let rotation = nalgebra::UnitQuaternion::new_normalize(rotation);
            let rotation = rotation.to_rotation_matrix().to_homogeneous();
            let scaled = rotation * Matrix4::new_nonuniform_scaling(&Vector3::from(*scale));
            Matrix4::new_translation(&Vector3::from(*translation)) * scaled
        }
    }
}

fn weights(node: &gltf::Node) -> Vec<f64> {
    let own = node.weights();
    let of_mesh = || node.mesh().and_then(|mesh| mesh.weights());
    let weights = own.or_else(of_mesh).unwrap_or_default();
    weights.iter().map(|&weight| f64::from(weight)).collect()
}
