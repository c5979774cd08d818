//! Skeletons: from files, morphed, and into a file. They are no meshes, so they have a door of their own.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::edges::{EdgeReport, FrameErrors, Strain, lengths, strain_warning};
use super::{
    AlignmentEffect, AlignmentReport, MorphMethod, MorphReport, MorphRequest, moments, no_space,
    wanted_frames,
};
use crate::diag::{Diagnostic, Result, Warned};
use crate::format::skeleton::{SkeletonFormat, by_ending};
use crate::inbetween::isometric::Alignment;
use crate::inbetween::skeleton::SkeletonMorph;
use crate::mesh::{Skeleton, SkeletonPoses};
use crate::pipeline::output::refuse_inputs;
use crate::pipeline::{FrameRange, Output, Saved};
use crate::task::Task;
use crate::world::World;

/// Whether the ending of `path` names a format of skeletons.
pub fn is_skeleton(path: &Path) -> bool {
    format_of(path).is_some()
}

fn format_of(path: &Path) -> Option<&'static SkeletonFormat> {
    by_ending(&path.extension()?.to_string_lossy())
}

/// The poses of all files in a row, those of `range` of them all. Joints of later files are matched by
/// name.
///
/// # Errors
/// A file is not there, damaged, or no skeleton; its tree is another than the first one's.
pub fn open_skeletons(
    world: &dyn World,
    files: &[PathBuf],
    range: Option<FrameRange>,
    task: &Task,
) -> Result<SkeletonPoses> {
    task.phase("load", files.len());
    let mut all: Option<SkeletonPoses> = None;
    for file in files {
        task.check()?;
        let Some(format) = format_of(file) else {
            return Diagnostic::error("a mesh among skeletons")
                .in_file(file)
                .hint("poses are all meshes, or all skeletons (.bvh, .json)")
                .err();
        };
        let read = (format.read)(&world.read(file)?);
        let poses = read.map_err(|error| Box::new(error.in_file(file)))?;
        match &mut all {
            None => all = Some(poses),
            Some(all) => append(all, &poses).map_err(|error| Box::new(error.in_file(file)))?,
        }
        task.step();
    }
    let Some(mut poses) = all else {
        return Diagnostic::error("no input")
            .hint("name .bvh or .json files")
            .err();
    };
    let width = 3 * poses.skeleton.joints().len();
    let part = range.unwrap_or_default().within(poses.frames())?;
    poses.positions = poses.positions[part.start * width..part.end * width].to_vec();
    Ok(poses)
}

fn append(all: &mut SkeletonPoses, poses: &SkeletonPoses) -> Result<()> {
    let order = all.skeleton.matching(&poses.skeleton).or_else(|mismatch| {
        Diagnostic::error(mismatch.to_string())
            .hint("poses of one skeleton have the same joints, by name, on the same tree")
            .err()
    })?;
    for frame in 0..poses.frames() {
        let (places, _) = poses.frame(frame).as_chunks::<3>();
        let sorted = order.iter().flat_map(|&joint| places[joint as usize]);
        all.positions.extend(sorted);
    }
    Ok(())
}

/// A morphed skeleton.
#[derive(Debug, Clone)]
pub struct SkeletonMorphed {
    /// The frames; those at poses are the poses.
    pub frames: SkeletonPoses,
    /// What was measured; edges are bones, their ends joints from 1.
    pub report: MorphReport,
}

/// Frames between poses of a skeleton: lengths of bones linear, directions along great circles.
///
/// # Errors
/// As [`super::morph_frames`]; another method than `isometric`; cancellation.
pub fn morph_skeletons(
    poses: &SkeletonPoses,
    request: &MorphRequest,
    task: &Task,
) -> Result<Warned<SkeletonMorphed>> {
    if request.method != MorphMethod::Isometric {
        return Diagnostic::error(format!(
            "the method {} is for meshes, not for skeletons",
            request.method.name()
        ))
        .hint("skeletons take the method isometric")
        .err();
    }
    no_space(request)?;
    let (count, frames) = (poses.frames(), wanted_frames(poses.frames(), request)?);
    task.phase("morph", frames);
    let (bones, width) = (poses.skeleton.bones(), poses.frame(0).len());
    let mut positions = vec![0.0; frames * width];
    let (mut errors, mut strain, mut warnings) = (Vec::new(), Strain::default(), Vec::new());
    let mut alignment = None;
    let mut rows = positions.chunks_exact_mut(width);
    for moments in moments(frames, count).chunk_by(|a, b| a.pose == b.pose) {
        let first = moments[0].pose;
        let pair = [first, (first + 1).min(count - 1)].map(|pose| poses.frame(pose));
        let ends = pair.map(|pose| lengths(&bones, pose));
        let morph = SkeletonMorph::new(&poses.skeleton, pair[0], pair[1], Alignment::Rigid);
        strain = strain.join(Strain::between(&ends[0], &ends[1]));
        warnings.extend(opposite_warning(&poses.skeleton, morph.opposite(), first));
        if first + 1 < count {
            let report = effect_of_alignment(&poses.skeleton, pair, &morph);
            alignment = Some(report.or_more(alignment));
        }
        for (moment, row) in moments.iter().zip(&mut rows) {
            task.check()?;
            match moment.t == 0.0 {
                true => row.copy_from_slice(pair[0]),
                false => morph.at(moment.t, row),
            }
            let wanted = |bone: usize| ends[0][bone] * (1.0 - moment.t) + ends[1][bone] * moment.t;
            errors.push(FrameErrors::of(&bones, wanted, row));
            task.step();
        }
    }
    warnings.extend(strain_warning(&strain));
    Ok(Warned {
        output: SkeletonMorphed {
            frames: SkeletonPoses {
                skeleton: Arc::clone(&poses.skeleton),
                positions,
                fps: poses.fps,
            },
            report: MorphReport {
                method: request.method.name(),
                poses: count,
                edges: EdgeReport::of(&errors),
                strain,
                alignment,
                conformal: None,
                embedding: None,
            },
        },
        warnings,
    })
}

/// What the alignment changes half way. Lengths of bones are exact and directions on their great circles
/// with and without it; what differs is the angles at joints.
fn effect_of_alignment(
    skeleton: &Skeleton,
    [from, to]: [&[f64]; 2],
    morph: &SkeletonMorph,
) -> AlignmentReport {
    let wanted: Vec<f64> = joint_angles(skeleton, from)
        .zip(joint_angles(skeleton, to))
        .map(|(a, b)| 0.5 * (a + b))
        .collect();
    let effect = |morph: &SkeletonMorph| {
        let mut half = vec![0.0; from.len()];
        morph.at(0.5, &mut half);
        let pairs = joint_angles(skeleton, &half).zip(&wanted);
        let errors = pairs.map(|(found, wanted)| (found - wanted).abs().to_degrees());
        let (sum, worst) = errors.fold((0.0, 0.0_f64), |(sum, worst), error| {
            (sum + error, worst.max(error))
        });
        AlignmentEffect {
            edge_mean_percent: 0.0,
            edge_worst_percent: 0.0,
            normal_mean_degrees: 0.0,
            normal_worst_degrees: 0.0,
            joint_mean_degrees: Some(sum / wanted.len().max(1) as f64),
            joint_worst_degrees: Some(worst),
        }
    };
    let bare = SkeletonMorph::new(skeleton, from, to, Alignment::None);
    AlignmentReport {
        turn_degrees: morph.turn().to_degrees(),
        with: effect(morph),
        without: effect(&bare),
    }
}

/// The angle between each bone and its parent's, where there is one.
fn joint_angles(skeleton: &Skeleton, pose: &[f64]) -> impl Iterator<Item = f64> {
    let joints = skeleton.joints();
    let bone = |joint: u32, parent: u32| {
        let [a, b] = [parent, joint].map(|at| &pose[3 * at as usize..][..3]);
        nalgebra::Vector3::from_fn(|axis, _| b[axis] - a[axis])
    };
    (0..joints.len() as u32).filter_map(move |joint| {
        let parent = joints[joint as usize].parent?;
        let before = joints[parent as usize].parent?;
        let (one, two) = (bone(parent, before), bone(joint, parent));
        Some(libm::atan2(one.cross(&two).norm(), one.dot(&two)))
    })
}

fn opposite_warning(skeleton: &Skeleton, opposite: &[u32], first: usize) -> Option<Diagnostic> {
    let names: Vec<String> = opposite
        .iter()
        .take(3)
        .map(|&joint| format!("`{}`", skeleton.joints()[joint as usize].name))
        .collect();
    let more = match opposite.len().saturating_sub(3) {
        0 => String::new(),
        more => format!(" and {more} more"),
    };
    (!names.is_empty()).then(|| {
        Diagnostic::warning(format!(
            "bones to {}{more} have opposite directions in poses {} and {}: which way they turn is a guess",
            names.join(", "),
            first + 1,
            first + 2
        ))
        .hint("a pose between the two decides")
    })
}

/// What [`save_skeletons`] would write.
///
/// # Errors
/// The ending names no format of skeletons, or an input would be written over.
pub fn plan_skeletons(world: &dyn World, output: &Output) -> Result<Vec<PathBuf>> {
    writable(world, output).map(|_| vec![output.path.clone()])
}

fn writable(world: &dyn World, output: &Output) -> Result<&'static SkeletonFormat> {
    let Some(format) = format_of(&output.path) else {
        return Diagnostic::error("a skeleton cannot be written under this ending")
            .in_file(&output.path)
            .hint(".bvh gives rotations, .json places of joints; one file holds all frames")
            .err();
    };
    refuse_inputs(world, [&output.path], &output.inputs)?;
    Ok(format)
}

/// Writes all frames to one file, staged and then moved to its place.
///
/// # Errors
/// As [`plan_skeletons`]; the file cannot be written.
pub fn save_skeletons(
    world: &dyn World,
    poses: &SkeletonPoses,
    output: &Output,
    task: &Task,
) -> Result<Saved> {
    let format = writable(world, output)?;
    task.phase("write", 1);
    let stage = world.stage(&output.path)?;
    let name = "skeleton".to_string();
    stage.write(&name, &(format.write)(poses))?;
    task.check()?;
    stage.commit(&[(name, output.path.clone())], &[])?;
    Ok(Saved {
        outputs: vec![output.path.clone()],
        removed: Vec::new(),
        frames: poses.frames(),
    })
}
