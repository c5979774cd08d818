//! A space works wherever one is named: each through the real binary.

mod support;

use std::path::Path;

use meshloom::space::SPACES;
use serde_json::Value;
use support::capture::sheet;
use support::meshloom;

/// Frames of the captures.
const FRAMES: usize = 12;

/// A folder with the motions of a small and a large sheet that move alike.
fn sheets() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    for (name, side) in [("small", 5), ("large", 7)] {
        sheet(side, FRAMES).write_objs(&folder.path().join(name));
    }
    folder
}

/// By how much the frames of `b` miss those of `a`, in percent of their motion.
fn missed(folder: &Path, a: &str, b: &str) -> f64 {
    let found = meshloom(folder, &format!("compare {a} {b} --json"));
    found.done().object()["kg_percent"].as_f64().unwrap()
}

fn errors(fitted: &Value) -> [f64; 2] {
    ["total", "positions"].map(|name| fitted["error"][name].as_f64().unwrap_or(0.0))
}

#[test]
fn fits_their_samples_and_their_looms_on_file() {
    let folder = sheets();
    let run = |args: &str| meshloom(folder.path(), args).done();
    for space in SPACES {
        let name = space.name;
        let fit = format!("fit small -o {name}.loom --space {name} --tolerance 0.002 --json");
        let fitted = run(&fit).object();
        assert_eq!(fitted["space"], name);
        assert!(
            errors(&fitted).iter().all(|error| *error < 0.02),
            "{fitted}"
        );
        run(&format!("sample {name}.loom -o {name}/f_##.obj"));
        let off = missed(folder.path(), "small", name);
        assert!(off < 2.0, "{name}: {off} % off its capture");
        // a folder straight from the capture, and the loom on file, are the same motion
        run(&format!(
            "fit small -o {name}2.loom --space {name} --tolerance 0.002"
        ));
        run(&format!("sample {name}2.loom -o {name}2/f_##.obj"));
        let read = |from: &str| std::fs::read(folder.path().join(from).join("f_05.obj")).unwrap();
        assert_eq!(read(name), read(&format!("{name}2")));
        let halves = run(&format!("sample {name}.loom -o halves --rate 2 --json")).object();
        assert_eq!(halves["frames"], 2 * FRAMES - 1);
    }
}

#[test]
fn transfers() {
    let folder = sheets();
    let run = |args: &str| meshloom(folder.path(), args).done();
    for space in SPACES {
        let name = space.name;
        run(&format!(
            "fit small -o f.loom --space {name} --tolerance 0.002"
        ));
        let moved = run(&format!(
            "transfer f.loom --examples small large -o {name} --json"
        ));
        assert_eq!(moved.object()["frames"], FRAMES);
        // every frame is an example: the large sheet's own motion comes back but for what the fit lost
        let off = missed(folder.path(), "large", name);
        assert!(off < 2.0, "{name}: {off} % off the large sheet's motion");
    }
}

#[test]
fn recipes_with_edits_of_time_pose_and_shape() {
    let folder = sheets();
    let recipe = r#"
        let space = param("space", "vertices");
        let loom = fit(input(), #{ space: space, tolerance: 0.002 });
        check(loom.space == space, "another space");
        let edited = loom.speed(2, 6, 0.5).exaggerate(1.1).hold(3, 2);
        let there = edited.transfer(examples(open("small"), open("large")));
        check(there.space == space, "another space after transfer");
        check(there.frames == edited.frames, "time edits went lost");
        save(edited.reverse().resample(rate(2)), "edited/f_##.obj");
        loom.transfer(examples(open("small"), open("large"))).resample(rate(1))
    "#;
    std::fs::write(folder.path().join("edits.rhai"), recipe).unwrap();
    for space in SPACES {
        let name = space.name;
        let out = format!("{name}-large/f_##.obj");
        let run = format!("run edits.rhai small --set space={name} -o {out}");
        meshloom(folder.path(), &run).done();
        let off = missed(folder.path(), "large", &format!("{name}-large"));
        assert!(off < 2.0, "{name}: {off} % off the large sheet's motion");
    }
}

#[test]
fn key_poses_morphs_and_statistics() {
    let folder = sheets();
    let run = |args: &str| meshloom(folder.path(), args).done();
    let key = |frame: usize| format!("small/frame_{frame:04}.obj");
    let keys = [1, 4, 8].map(key).join(" ");
    for space in SPACES {
        let name = space.name;
        for (verb, how) in [("complete", ""), ("morph", "--method spline")] {
            let out = format!("{verb}-{name}/f_#.obj");
            run(&format!(
                "{verb} {keys} {how} -o {out} --space {name} --frames 5"
            ));
            for (frame, key) in [(1, key(1)), (3, key(4)), (5, key(8))] {
                let at = format!("{verb}-{name}/f_{frame}.obj");
                let compared = run(&format!("compare {key} {at} --json")).object();
                let off = compared["max"].as_f64().unwrap();
                assert!(off < 1e-4, "{name}: {verb} misses a key by {off}");
            }
        }
        run(&format!(
            "stats {keys} --space {name} --mean mean-{name}.obj"
        ));
        let mean = run(&format!("info mean-{name}.obj --json")).object();
        assert_eq!(mean["vertices"], 25, "{name}");
    }
}
