//! Damaged files of every format: an error that names the file, or frames that are finite; never a
//! panic, never memory that only a header asks for.

use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::{Arc, OnceLock};

use meshloom::diag::Diagnostic;
use meshloom::format::{Encoding, loom};
use meshloom::loom::fit::{FitOptions, fit};
use meshloom::mesh::{Sequence, Topology};
use meshloom::pipeline::{InputSpec, Output, open, save};
use meshloom::task::Task;
use meshloom::world::{MemoryWorld, World};
use proptest::prelude::*;
use serde_json::json;

/// Five vertices, a quad and two triangles.
fn capture(frames: usize) -> Sequence {
    let topology = Topology::new(5, &[4, 3, 3], vec![0, 1, 2, 3, 0, 4, 1, 1, 4, 2]).unwrap();
    let values = (0..frames * 15).map(|i| ((i * i) as f32 * 0.37).sin());
    Sequence::new(Arc::new(topology), values.collect(), Some(24.0))
}

/// A skinned, moving triangle as GLB, its numbers in the file itself.
fn glb() -> Vec<u8> {
    let mut bin: Vec<u8> = Vec::new();
    let mut views = Vec::new();
    let mut accessors = Vec::new();
    let mut add = |kind: &str, component: u32, count: usize, bytes: &[u8]| {
        let view = json!({"buffer": 0, "byteOffset": bin.len(), "byteLength": bytes.len()});
        views.push(view);
        accessors.push(json!({
            "bufferView": views.len() - 1, "componentType": component, "count": count, "type": kind,
            "min": [0.0, 0.0, 0.0], "max": [1.0, 1.0, 1.0]
        }));
        bin.extend_from_slice(bytes);
        bin.resize(bin.len().next_multiple_of(4), 0);
    };
    let floats =
        |numbers: &[f32]| -> Vec<u8> { numbers.iter().flat_map(|n| n.to_le_bytes()).collect() };
    add(
        "VEC3",
        5126,
        3,
        &floats(&[0., 0., 0., 1., 0., 0., 0., 1., 0.]),
    );
    add("VEC4", 5121, 3, &[0, 1, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0]);
    add(
        "VEC4",
        5126,
        3,
        &floats(&[0.5, 0.5, 0., 0., 1., 0., 0., 0., 1., 0., 0., 0.]),
    );
    add("SCALAR", 5126, 2, &floats(&[0.0, 0.5]));
    add("VEC4", 5126, 2, &floats(&[0., 0., 0., 1., 0., 0., 1., 0.]));
    add("SCALAR", 5123, 3, &[0, 0, 1, 0, 2, 0]);
    let text = json!({
        "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0, 1]}],
        "nodes": [{"mesh": 0, "skin": 0}, {"children": [2]}, {"translation": [1, 0, 0]}],
        "meshes": [{"primitives": [{
            "attributes": {"POSITION": 0, "JOINTS_0": 1, "WEIGHTS_0": 2},
            "indices": 5, "targets": [{"POSITION": 0}]
        }]}],
        "skins": [{"joints": [1, 2]}],
        "animations": [{
            "samplers": [{"input": 3, "output": 4}],
            "channels": [{"sampler": 0, "target": {"node": 2, "path": "rotation"}}]
        }],
        "buffers": [{"byteLength": bin.len()}], "bufferViews": views, "accessors": accessors
    });
    let mut text = text.to_string().into_bytes();
    text.resize(text.len().next_multiple_of(4), b' ');
    let chunk = |name: &[u8; 4], bytes: &[u8]| {
        [&(bytes.len() as u32).to_le_bytes()[..], name, bytes].concat()
    };
    let chunks = [chunk(b"JSON", &text), chunk(b"BIN\0", &bin)].concat();
    let length = (12 + chunks.len()) as u32;
    [
        b"glTF",
        &2_u32.to_le_bytes()[..],
        &length.to_le_bytes(),
        &chunks,
    ]
    .concat()
}

/// A whole file of every format, by name; those of a sequence are its second frame.
fn whole_files() -> &'static [(&'static str, Vec<u8>)] {
    static FILES: OnceLock<Vec<(&str, Vec<u8>)>> = OnceLock::new();
    FILES.get_or_init(|| {
        let given = capture(6);
        let mut files = vec![(
            "f2.obj",
            saved(&given, "f#.obj", Encoding::default(), "f2.obj"),
        )];
        for encoding in [Encoding::Ascii, Encoding::LittleEndian, Encoding::BigEndian] {
            files.push(("f2.ply", saved(&given, "f#.ply", encoding, "f2.ply")));
        }
        for name in ["f.pc2", "f.mdd"] {
            files.push((name, saved(&given, name, Encoding::default(), name)));
        }
        let options = FitOptions {
            controls: Some(4),
            sites: Some(4),
            modes: Some(2),
            ..FitOptions::default()
        };
        let fitted = fit(&given, &options, &Task::default()).unwrap().output;
        files.push(("f.glb", glb()));
        files.push(("f.loom", loom::write(&fitted).unwrap()));
        files
    })
}

fn saved(frames: &Sequence, out: &str, encoding: Encoding, name: &str) -> Vec<u8> {
    let world = MemoryWorld::new();
    let output = Output::from(out).encoded(encoding);
    save(&world, frames, &output, &Task::default()).unwrap();
    world.read(Path::new(name)).unwrap()
}

/// Opens the file alone (or with its mesh), and as the second frame of a sequence; looks at all results.
fn open_all(name: &str, bytes: &[u8]) {
    let world = MemoryWorld::new();
    world.insert(name, bytes);
    let alone = match name {
        "f.pc2" | "f.mdd" => {
            world.insert(
                "base.obj",
                saved(&capture(1), "b.obj", Encoding::default(), "b.obj"),
            );
            InputSpec {
                mesh: Some("base.obj".into()),
                ..InputSpec::new(name)
            }
        }
        _ => InputSpec::new(name),
    };
    look(&world, &alone, name);
    if name.starts_with("f2") {
        let whole = whole_files()
            .iter()
            .find(|(other, _)| *other == name)
            .unwrap();
        let first = name.replace('2', "1");
        world.insert(&first, whole.1.clone());
        let both = InputSpec {
            paths: vec![PathBuf::from(&first), name.into()],
            ..InputSpec::default()
        };
        look(&world, &both, name);
    }
}

fn look(world: &MemoryWorld, spec: &InputSpec, name: &str) {
    match open(world, spec, &Task::default()) {
        Ok(opened) => {
            let frames = opened.output.content.frames();
            let mut positions = vec![0.0; 3 * frames.topology().vertices()];
            for frame in 0..frames.frames() {
                frames.read_frame(frame, &mut positions).unwrap();
                assert!(positions.iter().all(|value| value.is_finite()), "{name}");
            }
        }
        Err(error) => check_error(&error, name),
    }
}

fn check_error(error: &Diagnostic, name: &str) {
    assert_eq!(
        error.place.file.as_deref(),
        Some(Path::new(name)),
        "{error}"
    );
    assert!(!error.hints.is_empty(), "no hint: {error}");
    assert!(!error.message.ends_with('.'), "{error}");
}

/// One way to damage a file; places are fractions of its length.
#[derive(Debug, Clone)]
enum Damage {
    Cut(f64),
    Set(f64, u8),
    Insert(f64, Vec<u8>),
    Remove(f64, usize),
    Repeat(f64, usize),
    /// Other digits for a number of a text.
    Number(f64, String),
}

fn damage() -> impl Strategy<Value = Damage> {
    let place = 0.0..1.0_f64;
    const NUMBERS: &[&str] = &[
        "0",
        "-1",
        "4294967296",
        "99999999999999999999",
        "1e39",
        "nan",
        "-inf",
        "2147483647",
        "",
    ];
    prop_oneof![
        place.clone().prop_map(Damage::Cut),
        (place.clone(), any::<u8>()).prop_map(|(at, byte)| Damage::Set(at, byte)),
        (place.clone(), prop::collection::vec(any::<u8>(), 1..9))
            .prop_map(|(at, bytes)| Damage::Insert(at, bytes)),
        (place.clone(), 1..40_usize).prop_map(|(at, count)| Damage::Remove(at, count)),
        (place.clone(), 1..200_usize).prop_map(|(at, count)| Damage::Repeat(at, count)),
        (place, prop::sample::select(NUMBERS))
            .prop_map(|(at, text)| Damage::Number(at, text.into())),
    ]
}

fn damaged(bytes: &[u8], damage: &Damage) -> Vec<u8> {
    let index = |at: &f64| ((at * bytes.len() as f64) as usize).min(bytes.len());
    let replaced = |from: usize, to: usize, by: &[u8]| {
        let to = to.min(bytes.len());
        [&bytes[..from], by, &bytes[to..]].concat()
    };
    match damage {
        Damage::Cut(at) => bytes[..index(at)].to_vec(),
        Damage::Set(at, byte) => replaced(index(at), index(at) + 1, &[*byte]),
        Damage::Insert(at, new) => replaced(index(at), index(at), new),
        Damage::Remove(at, count) => replaced(index(at), index(at) + count, &[]),
        Damage::Repeat(at, count) => {
            let from = index(at);
            let part = &bytes[from..(from + count).min(bytes.len())];
            replaced(from, from, part)
        }
        Damage::Number(at, text) => {
            let digit = |byte: &u8| byte.is_ascii_digit();
            let Some(from) = bytes[index(at)..].iter().position(digit) else {
                return bytes.to_vec();
            };
            let from = index(at) + from;
            let length = bytes[from..].iter().take_while(|byte| digit(byte)).count();
            replaced(from, from + length, text.as_bytes())
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 1500, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn damaged_files_are_refused_or_read(
        file in 0..8_usize,
        damages in prop::collection::vec(damage(), 1..4),
    ) {
        let (name, bytes) = &whole_files()[file];
        let bytes = damages.iter().fold(bytes.clone(), |bytes, damage| damaged(&bytes, damage));
        open_all(name, &bytes);
    }
}

#[test]
fn whole_files_are_read() {
    for (name, bytes) in whole_files() {
        open_all(name, bytes);
        if !name.ends_with("2") && !name.ends_with(".mdd") {
            let world = MemoryWorld::new();
            world.insert(name, bytes.clone());
            open(&world, &InputSpec::new(*name), &Task::default()).unwrap();
        }
    }
}

#[test]
fn files_cut_anywhere_are_refused_if_their_length_is_known() {
    for (name, bytes) in whole_files() {
        for length in 0..bytes.len() {
            open_all(name, &bytes[..length]);
        }
        if name.ends_with(".ply") && !bytes.starts_with(b"ply\nformat ascii") {
            let world = MemoryWorld::new();
            world.insert(name, &bytes[..bytes.len() - 1]);
            let cut = open(&world, &InputSpec::new(*name), &Task::default()).map(|_| ());
            assert!(cut.unwrap_err().to_string().contains("face"), "{name}");
        }
    }
}

/// Headers that promise gigabytes, opened by a process that may not have one.
#[test]
#[cfg(unix)]
fn memory_follows_the_file_and_not_its_header() {
    let folder = tempfile::tempdir().unwrap();
    let two = i32::MAX;
    let ply = |format: &str, elements: &str| {
        format!("ply\nformat {format} 1.0\n{elements}\nend_header\n0 0 0 0\n")
    };
    let vertices =
        "element vertex 2000000000\nproperty float x\nproperty float y\nproperty float z";
    let faces = "element vertex 1\nproperty char x\nproperty char y\nproperty char z\n\
        element face 1\nproperty list uint uint vertex_indices";
    let list = [ply("binary_little_endian", faces).as_bytes(), &[0xff; 64]].concat();
    let le =
        |numbers: &[i32]| -> Vec<u8> { numbers.iter().flat_map(|n| n.to_le_bytes()).collect() };
    let pc2 = [
        b"POINTCACHE2\0".to_vec(),
        le(&[1, two, 0, 0, two]),
        vec![0; 1000],
    ]
    .concat();
    let mdd = [&two.to_be_bytes()[..], &two.to_be_bytes(), &[0; 1000]].concat();
    let header = br#"{"a":{"dtype":"F64","shape":[500000000],"data_offsets":[0,4000000000]}}"#;
    let loom = [&(header.len() as u64).to_le_bytes()[..], header].concat();
    let long = [&4_000_000_000_u64.to_le_bytes()[..], header].concat();
    let zeros = json!({
        "asset": {"version": "2.0"}, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
        "accessors": [{"componentType": 5126, "count": 2_000_000_000_u64, "type": "VEC3",
            "min": [0.0, 0.0, 0.0], "max": [0.0, 0.0, 0.0]}]
    });
    let glb = [b"glTF".to_vec(), le(&[2, two, two]), b"JSON{}".to_vec()].concat();
    let files: [(&str, Vec<u8>); 10] = [
        ("a.ply", ply("ascii", vertices).into()),
        ("b.ply", ply("binary_big_endian", vertices).into()),
        ("list.ply", list),
        ("a.pc2", pc2),
        ("a.mdd", mdd),
        ("a.loom", loom),
        ("long.loom", long),
        ("a.gltf", zeros.to_string().into()),
        ("a.glb", glb),
        ("a.obj", b"v 0 0 0\nf 1 2147483647 4294967295\n".to_vec()),
    ];
    std::fs::write(
        folder.path().join("base.obj"),
        "v 0 0 0\nv 0 1 0\nv 1 0 0\nf 1 2 3\n",
    )
    .unwrap();
    for (name, bytes) in files {
        std::fs::write(folder.path().join(name), bytes).unwrap();
        let mesh = if name.ends_with("pc2") || name.ends_with("mdd") {
            "--mesh base.obj"
        } else {
            ""
        };
        let command =
            format!("ulimit -v 900000; exec \"$MESHLOOM\" --threads 1 info {name} {mesh}");
        let ended = Command::new("sh")
            .args(["-c", &command])
            .env("MESHLOOM", env!("CARGO_BIN_EXE_meshloom"))
            .current_dir(folder.path())
            .output()
            .unwrap();
        let said = String::from_utf8_lossy(&ended.stderr).into_owned();
        assert_eq!(ended.status.code(), Some(1), "{name}: {said}");
        assert!(
            said.contains(name) && said.contains("hint"),
            "{name}: {said}"
        );
    }
}
