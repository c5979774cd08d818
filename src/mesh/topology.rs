//! Connectivity: polygons as they were read, the triangles they are cut into, and what the file said
//! about them that we only carry (texture coordinates, groups).

use std::fmt;

/// Why faces do not make a topology. Indices count from 0.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum TopologyError {
    /// A face has fewer than three corners.
    TooFewCorners {
        /// The face.
        face: usize,
    },
    /// A corner names a vertex that does not exist.
    VertexOutOfRange {
        /// The face.
        face: usize,
        /// The vertex it names.
        vertex: u32,
        /// How many vertices there are.
        vertices: usize,
    },
    /// More than 2^32 - 1 vertices or corners.
    TooLarge,
}

impl fmt::Display for TopologyError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            TopologyError::TooFewCorners { face } => {
                write!(f, "face {} has fewer than three corners", face + 1)
            }
            TopologyError::VertexOutOfRange {
                face,
                vertex,
                vertices,
            } => {
                write!(
                    f,
                    "face {} names vertex {}, but there are {vertices}",
                    face + 1,
                    u64::from(*vertex) + 1
                )
            }
            TopologyError::TooLarge => f.write_str("more than 4294967295 vertices or corners"),
        }
    }
}

impl std::error::Error for TopologyError {}

/// Which statement of a file named a [`Group`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum GroupKind {
    /// An object (`o` of OBJ).
    Object,
    /// A group (`g`).
    Group,
    /// A material (`usemtl`).
    Material,
    /// A smoothing group (`s`).
    Smoothing,
}

/// A name that holds from `first_face` on, until the next of its kind.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct Group {
    /// What is named.
    pub kind: GroupKind,
    /// The name, as the file had it.
    pub name: String,
    /// The first face it holds for, from 0.
    pub first_face: usize,
}

/// What the first frame's file said that is carried and written again, never computed with.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Attributes {
    /// Texture coordinates u v.
    pub texture_coordinates: Vec<[f32; 2]>,
    /// For every corner of every face the texture coordinate it uses; empty when no face has any,
    /// `u32::MAX` at a corner without.
    pub corner_texture: Vec<u32>,
    /// Whether it had normals: they are computed anew for every frame that is written.
    pub normals: bool,
    /// Names in the order of the file.
    pub groups: Vec<Group>,
    /// Material libraries (`mtllib`).
    pub material_libraries: Vec<String>,
}

/// Polygons over vertices 0..V and their triangles. Isolated vertices, duplicate, degenerate and
/// non-manifold faces are allowed here; what each operation does with them is said there.
#[derive(Debug, Clone, PartialEq)]
pub struct Topology {
    vertices: usize,
    offsets: Vec<u32>,
    corners: Vec<u32>,
    triangles: Vec<[u32; 3]>,
    attributes: Attributes,
}

impl Topology {
    /// Polygons given as corner counts (`arities`, one a face) and their corners in a row. Each polygon
    /// is cut into a fan of triangles about its first corner.
    ///
    /// # Errors
    /// A face with fewer than three corners or a corner that is not in 0..`vertices`.
    pub fn new(vertices: usize, arities: &[u32], corners: Vec<u32>) -> Result<Self, TopologyError> {
        if u32::try_from(vertices).is_err() || u32::try_from(corners.len()).is_err() {
            return Err(TopologyError::TooLarge);
        }
        let mut offsets = Vec::with_capacity(arities.len() + 1);
        offsets.push(0);
        let mut triangles = Vec::with_capacity(corners.len().saturating_sub(2 * arities.len()));
        for (face, &arity) in arities.iter().enumerate() {
            let start = offsets[face];
            if arity < 3 || (start + arity) as usize > corners.len() {
                return Err(TopologyError::TooFewCorners { face });
            }
            let polygon = &corners[start as usize..(start + arity) as usize];
            if let Some(&vertex) = polygon.iter().find(|&&vertex| vertex as usize >= vertices) {
                return Err(TopologyError::VertexOutOfRange {
                    face,
                    vertex,
                    vertices,
                });
            }
            triangles.extend(
                polygon[1..]
                    .windows(2)
                    .map(|pair| [polygon[0], pair[0], pair[1]]),
            );
            offsets.push(start + arity);
        }
        Ok(Topology {
            vertices,
            offsets,
            corners,
            triangles,
            attributes: Attributes::default(),
        })
    }

    /// Triangles only.
    ///
    /// # Errors
    /// As [`Topology::new`].
    pub fn from_triangles(vertices: usize, triangles: &[[u32; 3]]) -> Result<Self, TopologyError> {
        Topology::new(
            vertices,
            &vec![3; triangles.len()],
            triangles.as_flattened().to_vec(),
        )
    }

    /// So many vertices without faces.
    pub fn points(vertices: usize) -> Self {
        Topology {
            vertices,
            offsets: vec![0],
            corners: Vec::new(),
            triangles: Vec::new(),
            attributes: Attributes::default(),
        }
    }

    /// The same connectivity with these attributes.
    #[must_use]
    pub fn with_attributes(mut self, attributes: Attributes) -> Self {
        self.attributes = attributes;
        self
    }

    /// V, the number of vertices.
    pub fn vertices(&self) -> usize {
        self.vertices
    }

    /// The number of polygons.
    pub fn faces(&self) -> usize {
        self.offsets.len() - 1
    }

    /// The corners of polygon `face`, counter-clockwise seen from outside.
    pub fn face(&self, face: usize) -> &[u32] {
        &self.corners[self.offsets[face] as usize..self.offsets[face + 1] as usize]
    }

    /// The polygons in the order of the file.
    pub fn polygons(&self) -> impl ExactSizeIterator<Item = &[u32]> {
        self.offsets
            .windows(2)
            .map(|pair| &self.corners[pair[0] as usize..pair[1] as usize])
    }

    /// Where the corners of each polygon start in [`Topology::corners`]; one more than the polygons.
    pub fn offsets(&self) -> &[u32] {
        &self.offsets
    }

    /// The corners of all polygons in a row.
    pub fn corners(&self) -> &[u32] {
        &self.corners
    }

    /// The polygons cut into triangles, polygon by polygon.
    pub fn triangles(&self) -> &[[u32; 3]] {
        &self.triangles
    }

    /// What the file said besides.
    pub fn attributes(&self) -> &Attributes {
        &self.attributes
    }

    /// Whether both have the same vertices and polygons; attributes do not count.
    pub fn same_connectivity(&self, other: &Topology) -> bool {
        self.vertices == other.vertices
            && self.offsets == other.offsets
            && self.corners == other.corners
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn polygons_become_fans() {
        let topology = Topology::new(5, &[4, 3], vec![0, 1, 2, 3, 2, 3, 4]).unwrap();
        assert_eq!(topology.triangles(), [[0, 1, 2], [0, 2, 3], [2, 3, 4]]);
        assert_eq!(topology.face(0), [0, 1, 2, 3]);
        assert_eq!(
            topology.polygons().map(<[u32]>::len).collect::<Vec<_>>(),
            [4, 3]
        );
    }

    #[test]
    fn bad_faces_are_named() {
        assert_eq!(
            Topology::new(3, &[2], vec![0, 1]),
            Err(TopologyError::TooFewCorners { face: 0 })
        );
        let error = Topology::from_triangles(3, &[[0, 1, 2], [0, 1, 3]]).unwrap_err();
        assert_eq!(
            error,
            TopologyError::VertexOutOfRange {
                face: 1,
                vertex: 3,
                vertices: 3
            }
        );
        assert_eq!(error.to_string(), "face 2 names vertex 4, but there are 3");
    }
}
