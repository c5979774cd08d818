//! The fans of triangles around vertices, in the order of a walk (Rojas et al. 2014, §2.1, Fig. 2).
//!
//! A walk around a vertex v crosses a corner (a rotation about z by the corner's angle), then turns at a
//! spoke (a rotation about x by minus the dihedral angle), and so on. Where the triangles close around v
//! the walk must end as it began: equation (1). At a border, and where more than two triangles meet at an
//! edge, a fan is open and has no equation. A vertex at which fans touch only in a point has several.

use crate::mesh::{Hinges, VertexCorners};

/// No hinge at the end of a step: the fan ends there.
pub(super) const NO_HINGE: u32 = u32::MAX;

/// No fan at a corner: its triangle names a vertex twice.
pub(super) const NO_STEP: u32 = u32::MAX;

/// One corner of a walk.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Step {
    /// The corner crossed: corner c % 3 of triangle c / 3.
    pub(super) corner: u32,
    /// The triangle is turned over against the fan: it is crossed from its previous corner to its next.
    pub(super) flipped: bool,
    /// The hinge at the spoke reached, or [`NO_HINGE`].
    pub(super) hinge: u32,
    /// The fan sees the hinge's first triangle turned over, so the angle there has the other sign.
    pub(super) negated: bool,
}

/// One fan: a walk's steps.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Fan {
    /// The vertex.
    pub(super) vertex: u32,
    /// Where its steps begin.
    pub(super) start: u32,
    /// Where they end.
    pub(super) end: u32,
    /// The last step's hinge leads back to the first step.
    pub(super) closed: bool,
}

impl Fan {
    pub(super) fn steps(&self) -> std::ops::Range<usize> {
        self.start as usize..self.end as usize
    }
}

/// All fans of a mesh.
#[derive(Debug, Clone)]
pub(super) struct Fans {
    pub(super) fans: Vec<Fan>,
    pub(super) steps: Vec<Step>,
    /// The step of each corner, or [`NO_STEP`].
    pub(super) step_of: Vec<u32>,
    /// The fan of each step.
    pub(super) fan_of: Vec<u32>,
}

impl Fans {
    /// Walks around every vertex.
    pub(super) fn new(triangles: &[[u32; 3]], corners: &VertexCorners, hinges: &Hinges) -> Self {
        let mut walker = Walker {
            triangles,
            hinges,
            crossing: crossings(triangles, hinges),
            found: Fans {
                fans: Vec::new(),
                steps: Vec::with_capacity(3 * triangles.len()),
                step_of: vec![NO_STEP; 3 * triangles.len()],
                fan_of: Vec::with_capacity(3 * triangles.len()),
            },
        };
        let vertices = triangles
            .iter()
            .flatten()
            .max()
            .map_or(0, |&v| v as usize + 1);
        for vertex in 0..vertices {
            for &corner in corners.at(vertex) {
                let sound = distinct(&triangles[corner as usize / 3]);
                if sound && walker.found.step_of[corner as usize] == NO_STEP {
                    walker.walk(vertex as u32, corner);
                }
            }
        }
        walker.found
    }

    /// How many walks close: each is one equation (1).
    pub(super) fn closed(&self) -> usize {
        self.fans.iter().filter(|fan| fan.closed).count()
    }
}

fn distinct(&[a, b, c]: &[u32; 3]) -> bool {
    a != b && b != c && c != a
}

/// For each side of a triangle the one hinge that can be crossed there, or [`NO_HINGE`].
fn crossings(triangles: &[[u32; 3]], hinges: &Hinges) -> Vec<u32> {
    let mut at_edge = vec![0_u32; hinges.edges().len()];
    for hinge in hinges.hinges() {
        at_edge[hinge.edge as usize] += 1;
    }
    let mut crossing = vec![NO_HINGE; 3 * triangles.len()];
    for (index, hinge) in hinges.hinges().iter().enumerate() {
        let whole = |side: &u32| distinct(&triangles[*side as usize / 3]);
        if at_edge[hinge.edge as usize] == 1 && hinge.sides.iter().all(whole) {
            hinge
                .sides
                .iter()
                .for_each(|&side| crossing[side as usize] = index as u32);
        }
    }
    crossing
}

struct Walker<'a> {
    triangles: &'a [[u32; 3]],
    hinges: &'a Hinges,
    crossing: Vec<u32>,
    found: Fans,
}

impl Walker<'_> {
    /// Goes back from `corner` to where its fan begins, then collects the fan.
    fn walk(&mut self, vertex: u32, corner: u32) {
        let mut first = (corner, false);
        let mut closed = false;
        while let Some((before, _)) = self.across(vertex, first, false) {
            first = before;
            if before.0 == corner {
                closed = true;
                break;
            }
        }
        if closed {
            first = (corner, false);
        }
        let start = self.found.steps.len() as u32;
        let fan = self.found.fans.len() as u32;
        let mut at = first;
        loop {
            let next = self.across(vertex, at, true);
            let hinge = next.map_or(NO_HINGE, |(_, hinge)| hinge);
            self.found.step_of[at.0 as usize] = self.found.steps.len() as u32;
            self.found.fan_of.push(fan);
            self.found.steps.push(Step {
                corner: at.0,
                flipped: at.1,
                hinge,
                negated: self.negated(hinge, at),
            });
            match next {
                Some((next, _)) if next.0 != first.0 => at = next,
                _ => break,
            }
        }
        self.found.fans.push(Fan {
            vertex,
            start,
            end: self.found.steps.len() as u32,
            closed,
        });
    }

    /// The corner on the other side of the spoke at the end (or the beginning) of a corner, and the hinge.
    fn across(
        &self,
        vertex: u32,
        (corner, flipped): (u32, bool),
        forward: bool,
    ) -> Option<((u32, bool), u32)> {
        let (triangle, k) = (corner / 3, corner % 3);
        // the side to the next corner starts a walk over an upright triangle, the one before ends it
        let side = 3 * triangle + if forward != flipped { (k + 2) % 3 } else { k };
        let hinge = self.crossing[side as usize];
        if hinge == NO_HINGE {
            return None;
        }
        let [one, two] = self.hinges.hinges()[hinge as usize].sides;
        let other = if side == one { two } else { one };
        let begins = self.triangles[other as usize / 3][other as usize % 3] == vertex;
        let there = match begins {
            true => other,
            false => 3 * (other / 3) + (other + 1 - 3 * (other / 3)) % 3,
        };
        Some(((there, begins != forward), hinge))
    }

    /// Whether the hinge's first triangle is turned over in this fan.
    fn negated(&self, hinge: u32, (corner, flipped): (u32, bool)) -> bool {
        if hinge == NO_HINGE {
            return false;
        }
        let [one, two] = self.hinges.hinges()[hinge as usize].sides;
        match one / 3 == corner / 3 {
            true => flipped,
            false => flipped != self.same_way(one, two),
        }
    }

    /// Whether two triangles run through their common side the same way, so that one is turned over.
    fn same_way(&self, one: u32, two: u32) -> bool {
        let start = |side: u32| self.triangles[side as usize / 3][side as usize % 3];
        start(one) == start(two)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn fans(vertices: usize, triangles: &[[u32; 3]]) -> Fans {
        let corners = VertexCorners::new(vertices, triangles);
        let hinges = Hinges::new(vertices, triangles, &corners);
        Fans::new(triangles, &corners, &hinges)
    }

    #[test]
    fn every_walk_of_a_closed_mesh_closes_whichever_way_its_triangles_run() {
        for triangles in [
            [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]],
            [[0, 2, 1], [1, 0, 3], [1, 2, 3], [0, 2, 3]],
        ] {
            let found = fans(4, &triangles);
            assert_eq!((found.fans.len(), found.closed()), (4, 4));
            assert!(found.fans.iter().all(|fan| fan.steps().len() == 3));
            let mut seen = found.step_of.clone();
            seen.sort_unstable();
            assert_eq!(seen, (0..12).collect::<Vec<u32>>());
        }
    }

    #[test]
    fn borders_and_points_of_contact_open_a_fan() {
        // two triangles that share an edge, two more that touch them in vertex 0
        let found = fans(7, &[[0, 1, 2], [0, 2, 3], [0, 4, 5], [0, 6, 4]]);
        let at_zero: Vec<_> = found.fans.iter().filter(|fan| fan.vertex == 0).collect();
        assert_eq!(at_zero.len(), 2);
        assert!(
            at_zero
                .iter()
                .all(|fan| !fan.closed && fan.steps().len() == 2)
        );
        assert_eq!(found.closed(), 0);
        // a triangle that names a vertex twice belongs to no fan
        assert!(fans(3, &[[0, 0, 1]]).fans.is_empty());
    }
}
