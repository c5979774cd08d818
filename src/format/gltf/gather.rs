//! All meshes of a scene as one: patches of vertices that move together, welded, and their faces.

use std::collections::HashMap;
use std::sync::Arc;

use gltf::accessor::Dimensions;
use gltf::mesh::Mode;
use gltf::{Document, Node, Primitive, Semantic, Skin};
use nalgebra::Matrix4;

use super::accessor::{Buffers, finite};
use super::damaged;
use super::hierarchy::Hierarchy;
use crate::diag::{Diagnostic, Result};
use crate::mesh::{Attributes, Group, GroupKind, Topology};

/// The scene as one mesh.
pub(super) struct Gathered {
    pub(super) topology: Arc<Topology>,
    /// Their vertices in a row are those of the topology.
    pub(super) patches: Vec<Patch>,
    pub(super) skins: Vec<Joints>,
}

/// Joints of a skin: node and inverse bind matrix.
pub(super) struct Joints(pub(super) Vec<(usize, Matrix4<f64>)>);

/// Vertices of one primitive of one node.
pub(super) struct Patch {
    pub(super) node: usize,
    pub(super) skin: Option<usize>,
    /// Bind positions.
    pub(super) positions: Vec<[f32; 3]>,
    /// Displacements by morph target.
    pub(super) targets: Vec<Vec<[f32; 3]>>,
    /// For every vertex the joints that move it and their weights, which sum to 1.
    pub(super) influences: Vec<Vec<(u32, f32)>>,
}

/// Gathers the meshes of the scene that is shown.
pub(super) fn gather(
    document: &Document,
    hierarchy: &Hierarchy,
    buffers: &Buffers,
) -> Result<Gathered> {
    let skins = document.skins().map(|skin| joints(&skin, buffers));
    let skins = skins.collect::<Result<Vec<_>>>()?;
    let nodes: Vec<Node> = document.nodes().collect();
    let mut faces = Faces::default();
    let mut weld = Weld::default();
    let mut patches = Vec::new();
    for node in hierarchy.shown.iter().map(|&node| &nodes[node]) {
        let Some(mesh) = node.mesh() else { continue };
        for primitive in mesh.primitives() {
            let Some(corners) = corners(&primitive, buffers)? else {
                continue;
            };
            let mut patch = patch(node, &primitive, &skins, buffers)?;
            let welded = weld.patch(&mut patch);
            faces.add(node, &primitive, &corners, &welded, buffers)?;
            patches.push(patch);
        }
    }
    if faces.corners.is_empty() {
        return Diagnostic::error("nothing in this scene has faces").err();
    }
    let arities = vec![3; faces.corners.len() / 3];
    let topology = Topology::new(weld.count as usize, &arities, faces.corners);
    let topology = topology.map_err(|error| Box::new(damaged(&error.to_string())))?;
    let mut attributes = faces.attributes;
    if attributes.texture_coordinates.is_empty() {
        attributes.corner_texture.clear();
    }
    Ok(Gathered {
        topology: Arc::new(topology.with_attributes(attributes)),
        patches,
        skins,
    })
}

fn joints(skin: &Skin, buffers: &Buffers) -> Result<Joints> {
    let nodes: Vec<usize> = skin.joints().map(|joint| joint.index()).collect();
    let matrices = match skin.inverse_bind_matrices() {
        Some(accessor) => {
            let numbers = buffers.vectors(&accessor, Dimensions::Mat4)?;
            finite(&numbers, "inverse bind matrices")?;
            let matrices = numbers.chunks_exact(16);
            matrices
                .map(|m| Matrix4::from_iterator(m.iter().map(|&x| f64::from(x))))
                .collect()
        }
        None => vec![Matrix4::identity(); nodes.len()],
    };
    if matrices.len() < nodes.len() {
        return damaged("a skin with fewer matrices than joints").err();
    }
    Ok(Joints(nodes.into_iter().zip(matrices).collect()))
}

/// Three corners a triangle, as numbers of the primitive's vertices; `None` if it has no triangles.
fn corners(primitive: &Primitive, buffers: &Buffers) -> Result<Option<Vec<u32>>> {
    let Some(positions) = primitive.get(&Semantic::Positions) else {
        return Ok(None);
    };
    let order = match primitive.indices() {
        Some(accessor) => buffers.indices(&accessor)?,
        None => {
            let count = u32::try_from(positions.count());
            let count = count.map_err(|_| Box::new(damaged("too many vertices")))?;
            // held against the file when the positions are read
            buffers.vectors(&positions, Dimensions::Vec3)?;
            (0..count).collect()
        }
    };
    if order
        .iter()
        .any(|&vertex| vertex as usize >= positions.count())
    {
        return damaged("a face names a vertex that is not there").err();
    }
    let triangles: Vec<[u32; 3]> = match primitive.mode() {
        Mode::Triangles => order.as_chunks().0.to_vec(),
        Mode::TriangleStrip => {
            let turned = |(at, v): (usize, &[u32])| match at % 2 {
                0 => [v[0], v[1], v[2]],
                _ => [v[1], v[0], v[2]],
            };
            order.windows(3).enumerate().map(turned).collect()
        }
        Mode::TriangleFan => {
            let hub = order.first().copied().unwrap_or(0);
            let rim = order.get(1..).unwrap_or_default();
            rim.windows(2).map(|v| [hub, v[0], v[1]]).collect()
        }
        Mode::Points | Mode::Lines | Mode::LineLoop | Mode::LineStrip => return Ok(None),
    };
    Ok((!triangles.is_empty()).then(|| triangles.concat()))
}

fn patch(node: &Node, primitive: &Primitive, skins: &[Joints], buffers: &Buffers) -> Result<Patch> {
    let points = |accessor: &gltf::Accessor| -> Result<Vec<[f32; 3]>> {
        let numbers = buffers.vectors(accessor, Dimensions::Vec3)?;
        finite(&numbers, "positions")?;
        Ok(numbers.as_chunks().0.to_vec())
    };
    let positions: Vec<[f32; 3]> = match primitive.get(&Semantic::Positions) {
        Some(accessor) => points(&accessor)?,
        None => Vec::new(),
    };
    let mut targets: Vec<Vec<[f32; 3]>> = Vec::new();
    for target in primitive.morph_targets() {
        let moved = target.positions().map(|accessor| points(&accessor));
        let moved = moved.transpose()?.unwrap_or_default();
        if !moved.is_empty() && moved.len() != positions.len() {
            return damaged("a morph target with another number of vertices").err();
        }
        targets.push(moved);
    }
    let skin = node.skin().map(|skin| skin.index());
    let influences = match skin {
        Some(skin) => influences(primitive, positions.len(), &skins[skin], buffers)?,
        None => Vec::new(),
    };
    Ok(Patch {
        node: node.index(),
        skin: skin.filter(|_| !influences.is_empty()),
        positions,
        targets,
        influences,
    })
}

/// Joints and weights of all sets, without zeros, weights divided by their sum. Empty if the primitive
/// has none.
fn influences(
    primitive: &Primitive,
    vertices: usize,
    skin: &Joints,
    buffers: &Buffers,
) -> Result<Vec<Vec<(u32, f32)>>> {
    let mut all = Vec::new();
    for set in 0.. {
        let joints = primitive.get(&Semantic::Joints(set));
        let Some((joints, weights)) = joints.zip(primitive.get(&Semantic::Weights(set))) else {
            break;
        };
        let joints = buffers.indices(&joints)?;
        let weights = buffers.vectors(&weights, Dimensions::Vec4)?;
        finite(&weights, "skin weights")?;
        if joints.len() != 4 * vertices || weights.len() != 4 * vertices {
            return damaged("joints and weights for another number of vertices").err();
        }
        all.resize(vertices, Vec::new());
        for (vertex, (joints, weights)) in joints.chunks(4).zip(weights.chunks(4)).enumerate() {
            let pairs = joints
                .iter()
                .zip(weights)
                .map(|(&joint, &weight)| (joint, weight));
            all[vertex].extend(pairs.filter(|(_, weight)| *weight != 0.0));
        }
    }
    for pairs in &mut all {
        let sum: f32 = pairs.iter().map(|(_, weight)| weight).sum();
        if sum <= 0.0 {
            *pairs = vec![(0, 1.0)];
        } else {
            pairs.iter_mut().for_each(|(_, weight)| *weight /= sum);
        }
        pairs.sort_by_key(|(joint, _)| *joint);
        if pairs
            .iter()
            .any(|(joint, _)| *joint as usize >= skin.0.len())
        {
            return damaged("a vertex hangs on a joint that is not there").err();
        }
    }
    Ok(all)
}

/// Finds vertices that stand and move alike.
#[derive(Default)]
struct Weld {
    known: HashMap<Vec<u32>, u32>,
    count: u32,
}

impl Weld {
    /// For every vertex of the patch its number in the whole mesh. The patch keeps those that are new.
    fn patch(&mut self, patch: &mut Patch) -> Vec<u32> {
        let mut welded = Vec::with_capacity(patch.positions.len());
        let mut fresh = Vec::with_capacity(patch.positions.len());
        for vertex in 0..patch.positions.len() {
            let next = self.count;
            let number = *self.known.entry(key(patch, vertex)).or_insert(next);
            fresh.push(number == next);
            self.count += u32::from(number == next);
            welded.push(number);
        }
        keep(&mut patch.positions, &fresh);
        patch
            .targets
            .iter_mut()
            .for_each(|target| keep(target, &fresh));
        keep(&mut patch.influences, &fresh);
        welded
    }
}

/// Keeps the entries whose flag is set; an empty list stays empty.
fn keep<T>(list: &mut Vec<T>, flags: &[bool]) {
    let mut flags = flags.iter();
    list.retain(|_| flags.next().copied().unwrap_or(false));
}

/// Everything that a vertex's path depends on, as bits.
fn key(patch: &Patch, vertex: usize) -> Vec<u32> {
    let bits = |value: f32| (value + 0.0).to_bits(); // -0 is 0
    let mut key: Vec<u32> = patch.positions[vertex].map(bits).to_vec();
    match patch.skin {
        Some(skin) => {
            key.extend([0, skin as u32]);
            let pairs = patch.influences[vertex].iter();
            key.extend(pairs.flat_map(|(joint, weight)| [*joint, bits(*weight)]));
        }
        None => key.extend([1, patch.node as u32]),
    }
    for (target, moved) in patch.targets.iter().enumerate() {
        let moved = moved.get(vertex).copied().unwrap_or_default();
        if moved != [0.0; 3] {
            // weights of morph targets belong to the node
            key.extend([u32::MAX, patch.node as u32, target as u32]);
            key.extend(moved.map(bits));
        }
    }
    key
}

/// Faces of the whole mesh and what is carried along.
#[derive(Default)]
struct Faces {
    corners: Vec<u32>,
    attributes: Attributes,
}

impl Faces {
    fn add(
        &mut self,
        node: &Node,
        primitive: &Primitive,
        corners: &[u32],
        welded: &[u32],
        buffers: &Buffers,
    ) -> Result<()> {
        let mesh_name = node.mesh().and_then(|mesh| mesh.name());
        self.name(GroupKind::Object, node.name().or(mesh_name));
        self.name(GroupKind::Material, primitive.material().name());
        let start = self.attributes.texture_coordinates.len() as u32;
        let mut textured = false;
        if let Some(accessor) = primitive.get(&Semantic::TexCoords(0)) {
            let pairs = buffers.vectors(&accessor, Dimensions::Vec2)?;
            finite(&pairs, "texture coordinates")?;
            textured = pairs.len() == 2 * welded.len();
            if textured {
                let pairs = pairs.chunks(2).map(|pair| [pair[0], 1.0 - pair[1]]);
                self.attributes.texture_coordinates.extend(pairs);
            }
        }
        self.attributes.normals |= primitive.get(&Semantic::Normals).is_some();
        let number = |&vertex: &u32| welded[vertex as usize];
        self.corners.extend(corners.iter().map(number));
        let texture = corners.iter().map(|&vertex| match textured {
            true => start + vertex,
            false => u32::MAX,
        });
        self.attributes.corner_texture.extend(texture);
        Ok(())
    }

    fn name(&mut self, kind: GroupKind, name: Option<&str>) {
        let groups = &mut self.attributes.groups;
        let current = groups.iter().rev().find(|group| group.kind == kind);
        let Some(name) = name.filter(|name| current.is_none_or(|group| group.name != *name)) else {
            return;
        };
        groups.push(Group {
            kind,
            name: name.split_whitespace().collect::<Vec<_>>().join(" "),
            first_face: self.corners.len() / 3,
        });
    }
}
