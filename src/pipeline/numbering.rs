//! Numbers in the names of files: natural order, sequences, gaps.

use std::cmp::Ordering;
use std::collections::BTreeMap;
use std::ops::Range;
use std::path::{Path, PathBuf};

use crate::diag::Diagnostic;

/// Files of a folder by what stands before and after the last number of their names.
pub(super) type Groups<'a> = BTreeMap<(String, String), Vec<&'a Path>>;

/// Names without their last number: `frame_0012.obj` is of the group (`frame_`, `.obj`).
pub(super) fn groups(paths: &[PathBuf]) -> Groups<'_> {
    let mut groups = Groups::new();
    for path in paths {
        let name = name(path);
        let key = match number(&name) {
            Some(digits) => (
                name[..digits.start].to_string(),
                name[digits.end..].to_string(),
            ),
            None => (name, String::new()),
        };
        groups.entry(key).or_default().push(path);
    }
    groups
}

/// What a folder with several groups could stand for, as a hint.
pub(super) fn choices(folder: &Path, groups: &Groups<'_>) -> String {
    let choice = |((before, after), paths): (&(String, String), &Vec<&Path>)| {
        let names = paths.iter().map(|path| name(path));
        let digits = names.filter_map(|name| Some(number(&name)?.len())).min();
        let (pattern, files) = match paths[..] {
            [one] => (name(one), "file"),
            _ => (
                format!("{before}{}{after}", "#".repeat(digits.unwrap_or(1))),
                "files",
            ),
        };
        let path = folder.join(pattern);
        format!("'{}' ({} {files})", path.display(), paths.len())
    };
    let most = 8;
    let mut choices: Vec<String> = groups.iter().take(most).map(choice).collect();
    if groups.len() > most {
        choices.push(format!("and {} more", groups.len() - most));
    }
    format!("choose one: {}", choices.join(", "))
}

/// Natural order (`f2` before `f10`), ties by their bytes.
pub(super) fn sort(paths: &mut [PathBuf]) {
    paths.sort_by(|a, b| {
        let (x, y) = (a.to_string_lossy(), b.to_string_lossy());
        natord::compare(&x, &y).then_with(|| a.cmp(b))
    });
}

fn name(path: &Path) -> String {
    path.file_name()
        .unwrap_or_default()
        .to_string_lossy()
        .into_owned()
}

/// Where the last number before the ending of a file name stands.
fn number(name: &str) -> Option<Range<usize>> {
    let stem = name.rfind('.').unwrap_or(name.len());
    let end = name[..stem].rfind(|letter: char| letter.is_ascii_digit())? + 1;
    let start = name[..end]
        .rfind(|letter: char| !letter.is_ascii_digit())
        .map_or(0, |at| {
            at + name[at..].chars().next().map_or(1, char::len_utf8)
        });
    Some(start..end)
}

/// Warnings where the numbers of a sequence break its own stride.
pub(super) fn gaps(paths: &[PathBuf]) -> Vec<Diagnostic> {
    let numbers: Option<Vec<u64>> = paths
        .iter()
        .map(|path| {
            let name = name(path);
            name[number(&name)?].parse().ok()
        })
        .collect();
    let Some(numbers) = numbers.filter(|_| groups(paths).len() == 1) else {
        return Vec::new();
    };
    let steps: Vec<u64> = numbers
        .windows(2)
        .map(|pair| pair[1].saturating_sub(pair[0]))
        .collect();
    let Some(stride) = usual(&steps) else {
        return Vec::new();
    };
    let broken = |at: &usize| match steps[*at].cmp(&stride) {
        Ordering::Equal => None,
        _ => Some(
            Diagnostic::warning(format!(
                "the numbers go from {} to {}, elsewhere by {stride}",
                numbers[*at],
                numbers[at + 1]
            ))
            .in_file(&paths[at + 1])
            .hint("frames may be missing; they are taken as equally spaced in time"),
        ),
    };
    (0..steps.len()).filter_map(|at| broken(&at)).collect()
}

/// The most frequent step, the smallest of several; none if there are fewer than two steps.
fn usual(steps: &[u64]) -> Option<u64> {
    let mut counts = BTreeMap::new();
    for step in steps {
        *counts.entry(*step).or_insert(0_usize) += 1;
    }
    let most = *counts.values().max()?;
    let stride = counts.into_iter().find(|(_, count)| *count == most)?.0;
    (steps.len() > 1).then_some(stride)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn paths(names: &[&str]) -> Vec<PathBuf> {
        names.iter().map(PathBuf::from).collect()
    }

    #[test]
    fn two_comes_before_ten() {
        let mut names = paths(&["f10.obj", "f2.obj", "f1.obj", "e.obj"]);
        sort(&mut names);
        assert_eq!(names, paths(&["e.obj", "f1.obj", "f2.obj", "f10.obj"]));
    }

    #[test]
    fn the_last_number_of_a_name_is_its_frame() {
        let found = |name: &'static str| number(name).map(|digits| &name[digits]);
        assert_eq!(found("take2_0012.obj"), Some("0012"));
        assert_eq!(found("0.obj"), Some("0"));
        assert_eq!(found("é7ß.pc2"), Some("7"));
        assert_eq!(found("base.mp3"), None);
    }

    #[test]
    fn choices_can_be_given_back() {
        let names = paths(&[
            "d/a_01.obj",
            "d/a_02.obj",
            "d/b.obj",
            "d/c9.obj",
            "d/c10.obj",
        ]);
        let hint = choices(Path::new("d"), &groups(&names));
        let expected =
            "choose one: 'd/a_##.obj' (2 files), 'd/b.obj' (1 file), 'd/c#.obj' (2 files)";
        assert_eq!(hint, expected);
    }

    #[test]
    fn a_sequence_has_its_own_stride() {
        let warned = |names: &[&str]| gaps(&paths(names)).len();
        assert_eq!(warned(&["f1.obj", "f3.obj", "f5.obj"]), 0);
        assert_eq!(warned(&["f1.obj", "f2.obj", "f5.obj", "f6.obj"]), 1);
        assert_eq!(
            warned(&["f1.obj", "f9.obj"]),
            0,
            "two frames have no stride"
        );
        assert_eq!(warned(&["anger.obj", "cry.obj", "fury2.obj"]), 0);
    }
}
