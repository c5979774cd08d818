//! `stats` through the real binary: what it writes and reports, what it refuses.

mod support;

use std::fs;

use serde_json::Value;
use support::capture::sheet;
use support::{keys, meshloom};
use tempfile::tempdir;

#[test]
fn poses_have_a_mean_modes_and_a_picture() {
    let folder = tempdir().unwrap();
    sheet(6, 5).write_objs(&folder.path().join("poses"));
    for space in ["gradients", "edge-lengths", "vertices"] {
        let args = format!(
            "stats poses --space {space} --mean mean.obj --modes modes --plot p.svg --json"
        );
        let object = meshloom(folder.path(), &args).done().object();
        let mut known = vec![
            "coordinates",
            "dimension",
            "explained",
            "outputs",
            "poses",
            "scale_free",
            "seconds",
            "sigmas",
            "space",
            "warnings",
        ];
        if space == "edge-lengths" {
            known.insert(5, "returned");
            returned_well(&object);
        }
        assert_eq!(keys(&object), known);
        let numbers = |key: &str| object[key].as_array().unwrap().len();
        assert_eq!([numbers("coordinates"), numbers("explained")], [5, 4]);
        // the mean, three modes of nine shapes, the picture
        assert_eq!(numbers("outputs"), 1 + 27 + 1);
        let shares: f64 = object["explained"]
            .as_array()
            .unwrap()
            .iter()
            .map(|share| share.as_f64().unwrap())
            .sum();
        assert!((shares - 1.0).abs() < 1e-9);
        let picture = fs::read_to_string(folder.path().join("p.svg")).unwrap();
        assert!(picture.contains("mode 1 ("));
        // the middle of a mode is the mean
        let same = "compare mean.obj modes/mode_2/frame_05.obj --json";
        assert_eq!(meshloom(folder.path(), same).done().object()["max"], 0.0);
    }
}

/// The mean and 27 samples are told with the way they came back from lengths, by R14's embedding near the
/// mean.
fn returned_well(object: &Value) {
    let returned = object["returned"].as_array().unwrap();
    assert_eq!(returned.len(), 28);
    assert_eq!(returned[0]["shape"], "mean");
    for one in returned {
        let by = one["by"].as_str().unwrap();
        assert!(["embedding", "layout"].contains(&by), "{one}");
        assert!(one["edge_worst_percent"].as_f64().unwrap() >= 0.0);
    }
    assert_eq!(returned[0]["by"], "embedding", "{}", returned[0]);
    assert!(returned[0]["edge_rms_percent"].as_f64().unwrap() < 0.5);
}

#[test]
fn what_has_no_statistics_is_told_with_a_hint() {
    let folder = tempdir().unwrap();
    sheet(4, 3).write_objs(&folder.path().join("poses"));
    let refused = |args: &str, parts: &[&str]| meshloom(folder.path(), args).fails_with(parts);
    refused("stats poses --range 2:2", &["two poses", "is 1"]);
    refused("stats poses --plot p.jpg", &["jpg"]);
    refused("stats nothing", &["nothing"]);
    let unknown = meshloom(folder.path(), "stats poses --space angles");
    unknown.fails_with_any(&["angles", "vertices", "edge-lengths"]);
    let first = fs::read_dir(folder.path().join("poses")).unwrap().next();
    let first = first.unwrap().unwrap().file_name();
    let args = format!("stats poses --mean poses/{}", first.display());
    refused(&args, &["replace an input"]);
}

#[test]
fn copies_of_one_shape_have_no_modes() {
    let folder = tempdir().unwrap();
    let mut capture = sheet(4, 1);
    let first = capture.frames[0].clone();
    // turned by a quarter about z, and moved
    let turned = first.iter().map(|[x, y, z]| [5.0 - y, *x, *z]);
    let turned = turned.collect();
    capture.frames.push(turned);
    capture.write_objs(&folder.path().join("poses"));
    let args = "stats poses --space edge-lengths --modes m --json";
    let object = meshloom(folder.path(), args).done().object();
    let largest = object["sigmas"][0].as_f64().unwrap_or(0.0);
    assert!(largest < 1e-6, "{object}");
}

#[test]
fn lengths_that_no_triangle_has_are_told_with_the_triangle() {
    let folder = tempdir().unwrap();
    let mut capture = sheet(2, 2);
    // a needle that opens: two sigma before the mean its lengths close no triangle
    capture.frames = vec![
        vec![
            [0.0, 0.0, 0.0],
            [1.0, 0.0, 0.0],
            [0.0, 1.0, 0.0],
            [0.6, 0.01, 0.0],
        ],
        vec![
            [0.0, 0.0, 0.0],
            [1.0, 0.0, 0.0],
            [0.0, 1.0, 0.0],
            [0.5, 0.9, 0.0],
        ],
    ];
    capture.faces = vec![[0, 1, 3], [0, 3, 2]];
    capture.write_objs(&folder.path().join("poses"));
    let args = "stats poses --space edge-lengths --modes m --json";
    let object = meshloom(folder.path(), args).done().object();
    let warnings = object["warnings"].to_string();
    assert!(
        warnings.contains("no triangle has") && warnings.contains("face"),
        "{warnings}"
    );
}
