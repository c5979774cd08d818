//! A plain JSON list of joints, each naming its parent; the root names none.
//!
//! ```text
//! { "joints": [ {"name": "hips", "parent": null, "position": [0, 1, 0]},
//!               {"name": "spine", "parent": "hips", "position": [0, 1.4, 0]} ] }
//! ```
//!
//! Several poses stand in `frames`, one list of positions each in the order of the joints, which then
//! have none of their own; `fps` tells how fast they are played.

use std::collections::HashMap;
use std::sync::Arc;

use serde::{Deserialize, Serialize};

use super::{finite, joined};
use crate::diag::{Diagnostic, Result};
use crate::mesh::{Joint, SkeletonPoses};

#[derive(Serialize, Deserialize)]
struct File {
    joints: Vec<Entry>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    frames: Option<Vec<Vec<[f64; 3]>>>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    fps: Option<f64>,
}

#[derive(Serialize, Deserialize)]
struct Entry {
    name: String,
    parent: Option<String>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    position: Option<[f64; 3]>,
}

pub(super) fn read(bytes: &[u8]) -> Result<SkeletonPoses> {
    let file: File = serde_json::from_slice(bytes).or_else(|error| {
        Diagnostic::error(format!("not a list of joints: {error}"))
            .at_line(error.line())
            .at_column(error.column())
            .hint("a skeleton is {\"joints\": [{\"name\", \"parent\", \"position\"}, ..]}")
            .err()
    })?;
    let mut places = HashMap::new();
    for (index, entry) in (0..).zip(&file.joints) {
        if places.insert(entry.name.as_str(), index).is_some() {
            return Diagnostic::error(format!("two joints are called `{}`", entry.name))
                .hint("parents are named, so names must differ")
                .err();
        }
    }
    let joint = |entry: &Entry| {
        let parent = entry.parent.as_ref().map(|parent| {
            places.get(parent.as_str()).copied().ok_or_else(|| {
                let told = format!(
                    "joint `{}` hangs from `{parent}`, which is not there",
                    entry.name
                );
                Box::new(
                    Diagnostic::error(told).hint("`parent` is the name of another joint, or null"),
                )
            })
        });
        Ok(Joint {
            name: entry.name.clone(),
            parent: parent.transpose()?,
        })
    };
    let joints = file.joints.iter().map(joint).collect::<Result<_>>()?;
    finite(SkeletonPoses {
        skeleton: Arc::new(joined(joints)?),
        positions: positions(&file)?,
        fps: file.fps.filter(|fps| *fps > 0.0),
    })
}

/// The coordinates of all poses in a row.
fn positions(file: &File) -> Result<Vec<f64>> {
    let Some(frames) = &file.frames else {
        let places = file.joints.iter().map(|entry| {
            entry.position.ok_or_else(|| {
                let told = format!("joint `{}` has no position", entry.name);
                Box::new(
                    Diagnostic::error(told).hint("joints have a `position`, or `frames` has them"),
                )
            })
        });
        let places: Vec<[f64; 3]> = places.collect::<Result<_>>()?;
        return Ok(places.as_flattened().to_vec());
    };
    match frames
        .iter()
        .position(|frame| frame.len() != file.joints.len())
    {
        _ if frames.is_empty() => Diagnostic::error("`frames` is empty")
            .hint("leave it out and give each joint a `position`")
            .err(),
        Some(frame) => Diagnostic::error(format!(
            "{} positions for {} joints",
            frames[frame].len(),
            file.joints.len()
        ))
        .at_frame(frame + 1)
        .hint("a frame has the position of every joint, in their order")
        .err(),
        None => Ok(frames.concat().as_flattened().to_vec()),
    }
}

pub(super) fn write(poses: &SkeletonPoses) -> Vec<u8> {
    let single = poses.frames() == 1;
    let joints = poses.skeleton.joints();
    let entry = |(index, joint): (usize, &Joint)| Entry {
        name: joint.name.clone(),
        parent: joint
            .parent
            .map(|parent| joints[parent as usize].name.clone()),
        position: single.then(|| poses.positions.as_chunks().0[index]),
    };
    let frames = (0..poses.frames()).map(|frame| poses.frame(frame).as_chunks().0.to_vec());
    let file = File {
        joints: joints.iter().enumerate().map(entry).collect(),
        frames: (!single).then(|| frames.collect()),
        fps: poses.fps,
    };
    let mut bytes = serde_json::to_vec(&file).unwrap_or_default();
    bytes.push(b'\n');
    bytes
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_wrong_is_named() {
        for (text, parts) in [
            ("{", "not a list of joints"),
            (r#"{"joints": []}"#, "no joints"),
            (
                r#"{"joints": [{"name": "a", "parent": null, "position": [0,0,0]},
                   {"name": "b", "parent": null, "position": [0,0,1]}]}"#,
                "`a` and `b`",
            ),
            (
                r#"{"joints": [{"name": "a", "parent": "b", "position": [0,0,0]},
                   {"name": "b", "parent": "a", "position": [0,0,1]}]}"#,
                "itself",
            ),
            (r#"{"joints": [{"name": "a", "parent": "x"}]}"#, "`x`"),
            (
                r#"{"joints": [{"name": "a", "parent": null}]}"#,
                "no position",
            ),
            (
                r#"{"joints": [{"name": "a", "parent": null}], "frames": [[]]}"#,
                "0 positions",
            ),
            (
                r#"{"joints": [{"name": "a", "parent": null}], "frames": []}"#,
                "empty",
            ),
        ] {
            let error = read(text.as_bytes()).unwrap_err();
            assert!(error.message.contains(parts), "{}", error.message);
        }
    }
}
