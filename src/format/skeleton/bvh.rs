//! BVH (Biovision hierarchy): a tree of joints with offsets, then for each frame the numbers of their
//! channels.
//!
//! A joint's place is its parent's, plus its offset turned by all rotations above it. A position channel
//! takes the place of that coordinate of the offset. Rotations apply in the order of their channels,
//! in degrees. An `End Site` is a joint `NAME end` of the joint it ends.
//!
//! Written are rotations that lay the bones of the first frame onto those of each frame. Where bones keep
//! their lengths and siblings their angles, that says everything; where they do not, every joint has
//! position channels too, and no `End Site` is used.

use std::fmt::Write;
use std::sync::Arc;

use nalgebra::{Matrix3, UnitQuaternion, Vector3};

use super::{finite, joined};
use crate::diag::{Diagnostic, Result};
use crate::math::rotation::{exp, nearest};
use crate::mesh::{Joint, Skeleton, SkeletonPoses};

pub(super) fn read(bytes: &[u8]) -> Result<SkeletonPoses> {
    let Ok(text) = std::str::from_utf8(bytes) else {
        return Diagnostic::error("a BVH file is text, this is not")
            .hint("export the file again")
            .err();
    };
    let mut words = Words::new(text);
    let mut tree = Tree::default();
    words.expect("HIERARCHY")?;
    loop {
        match words.next()? {
            "ROOT" => tree.read_joint(&mut words, None)?,
            "MOTION" => break,
            other => return words.wrong(other, "ROOT or MOTION"),
        }
    }
    let skeleton = Arc::new(joined(tree.joints.clone())?);
    words.expect("Frames:")?;
    let frames = words.number()?;
    words.expect("Frame")?;
    words.expect("Time:")?;
    let step = words.number()?;
    if frames < 1.0 || frames.fract() != 0.0 {
        return words.told(format!("{frames} frames are no poses"));
    }
    let mut positions = Vec::new();
    let channels: usize = tree.channels.iter().map(Vec::len).sum();
    if channels == 0 && frames > 1.0 {
        return words.told(format!("{frames} frames without a channel that moves"));
    }
    let mut values = vec![0.0; channels];
    for _ in 0..frames as usize {
        for value in &mut values {
            *value = words.number()?;
        }
        tree.place(&values, &mut positions);
    }
    if let Some(more) = words.rest.next() {
        return words.wrong(more, "the end of the file");
    }
    finite(SkeletonPoses {
        skeleton,
        positions,
        fps: (step > 0.0).then(|| nice_rate(1.0 / step)),
    })
}

/// Frame times are written with few digits: a rate that is whole to 1e-4 is meant to be.
fn nice_rate(rate: f64) -> f64 {
    let whole = libm::round(rate);
    if (rate - whole).abs() < 1e-4 * whole {
        whole
    } else {
        rate
    }
}

/// The words of a file, and how many lines lie behind.
struct Words<'a> {
    text: &'a str,
    rest: std::str::SplitWhitespace<'a>,
    last: &'a str,
}

impl<'a> Words<'a> {
    fn new(text: &'a str) -> Self {
        Words {
            text,
            rest: text.split_whitespace(),
            last: "",
        }
    }

    fn next(&mut self) -> Result<&'a str> {
        match self.rest.next() {
            Some(word) => {
                self.last = word;
                Ok(word)
            }
            None => Diagnostic::error("the file ends too early")
                .hint("it may still be being written, or is damaged")
                .err(),
        }
    }

    fn number(&mut self) -> Result<f64> {
        let word = self.next()?;
        word.parse().or_else(|_| self.wrong(word, "a number"))
    }

    fn vector(&mut self) -> Result<Vector3<f64>> {
        Ok(Vector3::new(self.number()?, self.number()?, self.number()?))
    }

    fn expect(&mut self, wanted: &str) -> Result<()> {
        match self.next()? {
            word if word == wanted => Ok(()),
            word => self.wrong(word, wanted),
        }
    }

    fn wrong<T>(&self, found: &str, wanted: &str) -> Result<T> {
        self.told(format!("`{found}` stands where {wanted} should"))
    }

    fn told<T>(&self, message: String) -> Result<T> {
        // the word is a part of the text: its place there gives the line
        let at = self.last.as_ptr() as usize - self.text.as_ptr() as usize;
        let line = 1 + self.text[..at.min(self.text.len())].matches('\n').count();
        Diagnostic::error(message)
            .at_line(line)
            .hint("export the file again")
            .err()
    }
}

#[derive(Debug, Clone, Copy)]
enum Channel {
    Position(usize),
    Rotation(usize),
}

/// The hierarchy in the order of the file: parents before children.
#[derive(Default)]
struct Tree {
    joints: Vec<Joint>,
    offsets: Vec<Vector3<f64>>,
    channels: Vec<Vec<Channel>>,
    /// End sites of each joint so far.
    ends: Vec<u32>,
}

impl Tree {
    /// A joint from its name on, with everything that hangs from it.
    fn read_joint(&mut self, words: &mut Words, root: Option<u32>) -> Result<()> {
        let name = words.next()?.to_string();
        let mut above = vec![self.open(name, root, words)?];
        while let Some(&joint) = above.last() {
            match words.next()? {
                "OFFSET" => self.offsets[joint as usize] = words.vector()?,
                "CHANNELS" => self.channels[joint as usize] = channels(words)?,
                "JOINT" => {
                    let name = words.next()?.to_string();
                    above.push(self.open(name, Some(joint), words)?);
                }
                "End" => {
                    words.expect("Site")?;
                    self.ends[joint as usize] += 1;
                    let name = match self.ends[joint as usize] {
                        1 => format!("{} end", self.joints[joint as usize].name),
                        more => format!("{} end {more}", self.joints[joint as usize].name),
                    };
                    above.push(self.open(name, Some(joint), words)?);
                }
                "}" => {
                    above.pop();
                }
                other => return words.wrong(other, "a part of a joint"),
            }
        }
        Ok(())
    }

    fn open(&mut self, name: String, parent: Option<u32>, words: &mut Words) -> Result<u32> {
        words.expect("{")?;
        self.joints.push(Joint { name, parent });
        self.offsets.push(Vector3::zeros());
        self.channels.push(Vec::new());
        self.ends.push(0);
        Ok(self.joints.len() as u32 - 1)
    }

    /// Adds the places of all joints for one frame's channels.
    fn place(&self, values: &[f64], positions: &mut Vec<f64>) {
        let start = positions.len();
        let mut turns: Vec<UnitQuaternion<f64>> = Vec::with_capacity(self.joints.len());
        let mut values = values.iter();
        for (index, joint) in self.joints.iter().enumerate() {
            let mut local = self.offsets[index];
            let mut turn = UnitQuaternion::identity();
            for (channel, value) in self.channels[index].iter().zip(&mut values) {
                match *channel {
                    Channel::Position(axis) => local[axis] = *value,
                    Channel::Rotation(axis) => {
                        turn *= exp(&(Vector3::ith(axis, 1.0) * value.to_radians()));
                    }
                }
            }
            let (place, above) = match joint.parent {
                None => (local, UnitQuaternion::identity()),
                Some(parent) => {
                    let at = start + 3 * parent as usize;
                    let above = turns[parent as usize];
                    (
                        Vector3::from_column_slice(&positions[at..at + 3]) + above * local,
                        above,
                    )
                }
            };
            turns.push(above * turn);
            positions.extend(place.iter());
        }
    }
}

fn channels(words: &mut Words) -> Result<Vec<Channel>> {
    let count = words.number()?;
    if !(0.0..=6.0).contains(&count) || count.fract() != 0.0 {
        return words.told(format!("a joint has at most 6 channels, not {count}"));
    }
    let channel = |_| {
        let word = words.next()?;
        let axis = match word.as_bytes().first() {
            Some(b'X') => 0,
            Some(b'Y') => 1,
            Some(b'Z') => 2,
            _ => return words.wrong(word, "a channel"),
        };
        match &word[1..] {
            "position" => Ok(Channel::Position(axis)),
            "rotation" => Ok(Channel::Rotation(axis)),
            _ => words.wrong(word, "a channel"),
        }
    };
    (0..count as usize).map(channel).collect()
}

/// Joints that leave their places to rotations alone are off by at most this share of the longest bone.
const RIGID: f64 = 1e-10;

pub(super) fn write(poses: &SkeletonPoses) -> Vec<u8> {
    let skeleton = &poses.skeleton;
    let frames: Vec<Frame> = (0..poses.frames())
        .map(|frame| Frame::new(skeleton, poses.frame(0), poses.frame(frame)))
        .collect();
    let rest: Vec<Vector3<f64>> = frames[0].locals.clone();
    let longest = rest.iter().map(Vector3::norm).fold(0.0, f64::max);
    let root = skeleton.order()[0] as usize;
    let steady = frames.iter().all(|frame| {
        let mut pairs = frame.locals.iter().zip(&rest).enumerate();
        pairs.all(|(joint, (a, b))| joint == root || (a - b).norm() <= RIGID * longest)
    });
    let mut text = String::from("HIERARCHY\n");
    let children = skeleton.children();
    hierarchy(skeleton, &children, &rest, steady, &mut text);
    let step = 1.0 / poses.fps.unwrap_or(30.0);
    let _ = write!(
        text,
        "MOTION\nFrames: {}\nFrame Time: {step}\n",
        frames.len()
    );
    for frame in &frames {
        let mut line: Vec<String> = Vec::new();
        for &joint in skeleton.order() {
            let joint = joint as usize;
            if steady && is_end(skeleton, &children, joint) {
                continue;
            }
            if joint == root || !steady {
                line.extend(frame.locals[joint].iter().map(f64::to_string));
            }
            line.extend(zxy(&frame.turns[joint]).iter().map(f64::to_string));
        }
        text.push_str(&line.join(" "));
        text.push('\n');
    }
    text.into_bytes()
}

/// Whether a joint is written as an end site, where its place follows from its parent's rotation.
fn is_end(skeleton: &Skeleton, children: &[Vec<u32>], joint: usize) -> bool {
    let Some(parent) = skeleton.joints()[joint].parent else {
        return false;
    };
    let name = &skeleton.joints()[parent as usize].name;
    children[joint].is_empty() && skeleton.joints()[joint].name == format!("{name} end")
}

fn hierarchy(
    skeleton: &Skeleton,
    children: &[Vec<u32>],
    rest: &[Vector3<f64>],
    steady: bool,
    text: &mut String,
) {
    let mut depth = 0;
    // a joint to open, or a brace to close
    let mut open: Vec<Option<u32>> = vec![Some(skeleton.order()[0])];
    while let Some(next) = open.pop() {
        let Some(joint) = next.map(|joint| joint as usize) else {
            depth -= 1;
            let _ = writeln!(text, "{}}}", "\t".repeat(depth));
            continue;
        };
        let indent = "\t".repeat(depth);
        let root = skeleton.joints()[joint].parent.is_none();
        let end = steady && is_end(skeleton, children, joint);
        let name = skeleton.joints()[joint].name.split_whitespace();
        let name = name.collect::<Vec<_>>().join("_");
        let _ = match (root, end) {
            (true, _) => writeln!(text, "{indent}ROOT {name}\n{indent}{{"),
            (_, true) => writeln!(text, "{indent}End Site\n{indent}{{"),
            _ => writeln!(text, "{indent}JOINT {name}\n{indent}{{"),
        };
        let offset = if root { Vector3::zeros() } else { rest[joint] };
        let _ = writeln!(
            text,
            "{indent}\tOFFSET {} {} {}",
            offset.x, offset.y, offset.z
        );
        if !end {
            let place = "Xposition Yposition Zposition ";
            let (count, place) = match root || !steady {
                true => (6, place),
                false => (3, ""),
            };
            let turn = "Zrotation Xrotation Yrotation";
            let _ = writeln!(text, "{indent}\tCHANNELS {count} {place}{turn}");
        }
        open.push(None);
        open.extend(children[joint].iter().rev().map(|&child| Some(child)));
        depth += 1;
    }
}

/// One pose as rotations against the parent, and places in the parent's frame.
struct Frame {
    turns: Vec<UnitQuaternion<f64>>,
    locals: Vec<Vector3<f64>>,
}

impl Frame {
    fn new(skeleton: &Skeleton, rest: &[f64], pose: &[f64]) -> Self {
        let children = skeleton.children();
        let at = |pose: &[f64], joint: u32| {
            Vector3::from_column_slice(&pose[3 * joint as usize..3 * joint as usize + 3])
        };
        let still = UnitQuaternion::identity();
        let mut frame = Frame {
            turns: vec![still; children.len()],
            locals: vec![Vector3::zeros(); children.len()],
        };
        let mut world = vec![still; children.len()];
        for &joint in skeleton.order() {
            let parent = skeleton.joints()[joint as usize].parent;
            let above = parent.map_or(still, |parent| world[parent as usize]);
            let bones = children[joint as usize].iter().map(|&child| {
                let bone = |pose: &[f64]| at(pose, child) - at(pose, joint);
                [above * bone(rest), bone(pose)]
            });
            let turn = laid(&bones.collect::<Vec<_>>()) * above;
            let here = at(pose, joint) - parent.map_or_else(Vector3::zeros, |p| at(pose, p));
            world[joint as usize] = turn;
            frame.turns[joint as usize] = above.inverse() * turn;
            frame.locals[joint as usize] = above.inverse() * here;
        }
        frame
    }
}

/// The rotation that lays the first vector of each pair onto the second; of one pair, or of pairs along
/// one line, the least.
fn laid(bones: &[[Vector3<f64>; 2]]) -> UnitQuaternion<f64> {
    let sum: Matrix3<f64> = bones.iter().map(|[from, to]| to * from.transpose()).sum();
    let best = nearest(&sum);
    if bones.len() > 1 && best.certainty > 1e-6 {
        return best.rotation;
    }
    let longest = bones
        .iter()
        .max_by(|a, b| a[0].norm_squared().total_cmp(&b[0].norm_squared()));
    let Some([from, to]) = longest else {
        return UnitQuaternion::identity();
    };
    let axis = from.cross(to);
    let angle = libm::atan2(axis.norm(), from.dot(to));
    match axis.try_normalize(0.0) {
        Some(axis) => exp(&(axis * angle)),
        None if from.dot(to) < 0.0 => {
            let across = Vector3::ith(from.iamin(), 1.0).cross(from).normalize();
            exp(&(across * std::f64::consts::PI))
        }
        None => UnitQuaternion::identity(),
    }
}

/// Angles in degrees about z, then x, then y.
fn zxy(turn: &UnitQuaternion<f64>) -> [f64; 3] {
    let m = turn.to_rotation_matrix();
    let m = m.matrix();
    let sine = m[(2, 1)].clamp(-1.0, 1.0);
    let x = libm::asin(sine);
    let angles = if sine.abs() < 1.0 - 1e-12 {
        [
            libm::atan2(-m[(0, 1)], m[(1, 1)]),
            x,
            libm::atan2(-m[(2, 0)], m[(2, 2)]),
        ]
    } else {
        // about z and y is the same here: all of it goes to z
        [libm::atan2(m[(1, 0)], m[(0, 0)]), x, 0.0]
    };
    angles.map(f64::to_degrees)
}

#[cfg(test)]
mod tests {
    use super::*;

    const ARM: &str = "HIERARCHY\nROOT hip\n{\n OFFSET 0 0 0\n CHANNELS 6 Xposition Yposition Zposition \
        Zrotation Xrotation Yrotation\n JOINT arm\n {\n  OFFSET 1 0 0\n  CHANNELS 3 Zrotation Xrotation \
        Yrotation\n  End Site\n  {\n   OFFSET 2 0 0\n  }\n }\n}\nMOTION\nFrames: 2\nFrame Time: 0.0333333\n";

    fn arm(motion: &str) -> Result<SkeletonPoses> {
        read(format!("{ARM}{motion}").as_bytes())
    }

    #[test]
    fn rotations_go_down_the_tree() {
        let poses = arm("0 0 0 0 0 0 0 0 0\n5 6 7 90 0 0 0 0 90\n").unwrap();
        assert_eq!((poses.frames(), poses.fps), (2, Some(30.0)));
        assert_eq!(poses.frame(0), [0., 0., 0., 1., 0., 0., 3., 0., 0.]);
        // a quarter turn about z lays the arm along y; one about its own y takes its end along -z
        let wanted = [5., 6., 7., 5., 7., 7., 5., 7., 5.];
        let apart = poses
            .frame(1)
            .iter()
            .zip(wanted)
            .map(|(a, b)| (a - b).abs());
        assert!(apart.fold(0.0, f64::max) < 1e-14, "{:?}", poses.frame(1));
        assert_eq!(poses.skeleton.joints()[2].name, "arm end");
    }

    #[test]
    fn every_rotation_has_its_three_angles() {
        for w in [
            Vector3::new(0.3, -1.2, 2.0),
            Vector3::new(std::f64::consts::FRAC_PI_2, 0.0, 0.0),
            Vector3::new(-std::f64::consts::FRAC_PI_2, 0.0, 0.0),
            Vector3::new(0.0, 3.0, 0.0),
        ] {
            let turn = exp(&w);
            let [z, x, y] = zxy(&turn).map(f64::to_radians);
            let again =
                exp(&(Vector3::z() * z)) * exp(&(Vector3::x() * x)) * exp(&(Vector3::y() * y));
            assert!((turn.inverse() * again).angle() < 1e-7);
        }
    }

    #[test]
    fn damage_is_told_with_its_line() {
        let told = |text: &str| read(text.as_bytes()).unwrap_err();
        assert!(arm("0 0 0").unwrap_err().message.contains("ends too early"));
        let error = arm("0 0 0 0 x 0 0 0 0\n").unwrap_err();
        assert!(
            error.message.contains("`x`") && error.place.line == Some(19),
            "{error:?}"
        );
        assert!(told("HIERARCHY\nNODE").message.contains("`NODE`"));
        let two = ARM.replace("MOTION", "ROOT other\n{\n OFFSET 0 0 0\n}\nMOTION");
        assert!(told(&two).message.contains("`hip` and `other`"));
        assert!(
            told(&ARM.replace("Xrotation", "Wrotation"))
                .message
                .contains("`Wrotation`")
        );
        let still = "HIERARCHY ROOT a { OFFSET 0 0 0 } MOTION Frames: 1e15 Frame Time: 1";
        assert!(told(still).message.contains("without a channel"));
        assert!(read(&[0xff, 0xfe]).is_err());
    }
}
