//! What is written reads back the same, format by format; inputs of every form name the same frames.

use std::path::Path;
use std::sync::Arc;

use meshloom::format::{Encoding, FORMATS, Kind};
use meshloom::mesh::{FrameSource, Sequence, Topology};
use meshloom::pipeline::{Capture, Content, FrameRange, InputSpec, Output, open, save};
use meshloom::task::Task;
use meshloom::world::{MemoryWorld, World};

/// Six vertices (one in no face), a quad, a triangle and a pentagon, coordinates of every size.
fn capture(frames: usize) -> Sequence {
    let topology = Topology::new(6, &[4, 3, 5], vec![3, 2, 1, 0, 0, 1, 4, 4, 3, 2, 1, 0]).unwrap();
    let values = (0..frames * 18).map(|i| {
        let size = 10_f32.powi(i as i32 % 41 - 20);
        (i as f32 * 0.7).sin() * size
    });
    Sequence::new(Arc::new(topology), values.collect(), None)
}

fn sequence(capture: Capture) -> Sequence {
    let Content::Sequence(sequence) = capture.content else {
        panic!("frames in memory");
    };
    sequence
}

fn read(world: &dyn World, spec: &InputSpec) -> Sequence {
    let opened = open(world, spec, &Task::default()).unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(opened.warnings, [], "no warnings expected");
    sequence(opened.output)
}

fn write(world: &dyn World, source: &dyn FrameSource, path: &str) -> Vec<String> {
    let saved = save(world, source, &Output::from(path), &Task::default());
    let saved = saved.unwrap_or_else(|error| panic!("{error}"));
    let names = saved.outputs.iter();
    names.map(|path| path.display().to_string()).collect()
}

#[test]
fn every_format_gives_back_what_it_was_given() {
    let given = capture(3).with_fps(Some(25.0));
    for format in FORMATS {
        if matches!(format.kind, Kind::Scene(_) | Kind::Loom) {
            continue; // frames are not written to these
        }
        for ending in format.endings {
            let world = MemoryWorld::new();
            let out = match format.kind {
                Kind::Mesh(_) => format!("out/f####.{ending}"),
                _ => format!("out/f.{ending}"),
            };
            write(&world, &given, &out);
            let spec = match format.kind {
                Kind::Cache(_) => {
                    write(&world, &given.slice(1..2), "base.ply");
                    InputSpec {
                        mesh: Some("base.ply".into()),
                        ..InputSpec::new(&out)
                    }
                }
                _ => InputSpec::new(&out),
            };
            let back = read(&world, &spec);
            let name = format.name;
            assert_eq!(back.positions(), given.positions(), "{name}");
            assert!(
                back.topology().same_connectivity(given.topology()),
                "{name}"
            );
            let carries_rate = name != "PC2";
            assert_eq!(back.fps(), carries_rate.then_some(25.0), "{name}");
        }
    }
}

#[test]
fn ply_in_all_encodings_and_mixed() {
    let world = MemoryWorld::new();
    let given = capture(2);
    let encodings = [Encoding::Ascii, Encoding::LittleEndian, Encoding::BigEndian];
    let mut names = Vec::new();
    for (at, encoding) in encodings.into_iter().enumerate() {
        let out = format!("{at}/f#.ply");
        let output = Output::from(&out).encoded(encoding);
        save(&world, &given, &output, &Task::default()).unwrap();
        let back = read(&world, &InputSpec::new(&out));
        assert_eq!(back.positions(), given.positions(), "{encoding:?}");
        names.push(format!("{at}/f2.ply").into());
    }
    let spec = InputSpec {
        paths: names,
        ..InputSpec::default()
    };
    let mixed = read(&world, &spec);
    for frame in 0..3 {
        assert_eq!(mixed.frame(frame), given.frame(1));
    }
}

#[test]
fn ply_as_people_write_it() {
    let world = MemoryWorld::new();
    let text = "ply\r\nformat ascii 1.0\r\ncomment by hand\r\nobj_info none\r\nelement camera 1\r\nproperty float fov\r\n\
        element vertex 4\r\nproperty uchar red\r\nproperty double z\r\nproperty list uchar int tags\r\nproperty float x\r\n\
        property short y\r\nproperty float s\r\nproperty float t\r\nelement face 2\r\nproperty uchar flag\r\n\
        property list uchar uint vertex_index\r\nelement edge 1\r\nproperty int a\r\nend_header\r\n\
        50\r\n255 3 2 7 7 1 2 0 0\r\n0 6 0 4 5 1 0\r\n0 9 1 1 7 8 1 1\r\n0 0 0 0 0 0 1\r\n1 3 0 1 2\r\n0 3 0 2 3\r\n5\r\n";
    world.insert("a.ply", text);
    let read = read(&world, &InputSpec::new("a.ply"));
    assert_eq!(
        read.positions(),
        [1., 2., 3., 4., 5., 6., 7., 8., 9., 0., 0., 0.]
    );
    assert_eq!(read.topology().face(1), [0, 2, 3]);
    write(&world, &read, "b.obj");
    let obj = String::from_utf8(world.read(Path::new("b.obj")).unwrap()).unwrap();
    assert!(
        obj.contains("vt 1 1\n") && obj.ends_with("f 1/1 3/3 4/4\n"),
        "{obj}"
    );
}

#[test]
fn ply_keeps_texture_coordinates_of_vertices_and_of_corners() {
    let seam = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\nvt 0 0\nvt 1 0\nvt 0 1\nvt 0.5 0.5\n\
        f 1/1 2/2 3/3\nf 2/4 4/1 3/3\n";
    for (obj, corners) in [
        (seam.to_string(), true),
        (seam.replace("2/4", "2/2"), false),
    ] {
        let world = MemoryWorld::new();
        world.insert("a.obj", obj);
        let given = read(&world, &InputSpec::new("a.obj"));
        for encoding in [Encoding::Ascii, Encoding::BigEndian] {
            let output = Output::from("b.ply").encoded(encoding);
            save(&world, &given, &output, &Task::default()).unwrap();
            let header = world.read(Path::new("b.ply")).unwrap();
            let header = String::from_utf8_lossy(&header).into_owned();
            assert_eq!(header.contains("float texcoord"), corners, "{header}");
            let back = read(&world, &InputSpec::new("b.ply"));
            let coordinates = |sequence: &Sequence| {
                let attributes = sequence.topology().attributes().clone();
                let corners = attributes.corner_texture.iter();
                corners
                    .map(|&at| attributes.texture_coordinates[at as usize])
                    .collect::<Vec<_>>()
            };
            assert_eq!(coordinates(&back), coordinates(&given));
        }
    }
}

#[test]
fn all_forms_of_input_name_the_same_frames() {
    let world = MemoryWorld::new();
    let given = capture(11);
    write(&world, &given, "a/cap/f%d.obj");
    let list = (1..12).map(|i| format!("a/cap/f{i}.obj").into()).collect();
    let list = InputSpec {
        paths: list,
        ..InputSpec::default()
    };
    let forms = [
        "a/cap",
        "a/cap/",
        "a/cap/f*.obj",
        "a/*/*.obj",
        "a/**/f*.obj",
        "a/cap/f#.obj",
        "a/cap/f%d.obj",
    ];
    for spec in forms.map(InputSpec::new).into_iter().chain([list]) {
        let back = read(&world, &spec);
        assert_eq!(back.positions(), given.positions(), "{:?}", spec.paths);
    }
    let part = InputSpec {
        range: Some(FrameRange {
            first: Some(3),
            last: None,
        }),
        fps: Some(24.0),
        ..InputSpec::new("a/cap")
    };
    let back = read(&world, &part);
    assert_eq!(back.positions(), given.slice(2..11).positions());
    assert_eq!(back.fps(), Some(24.0));
}

#[test]
fn a_shorter_run_removes_the_longer_ones_frames_and_nothing_else() {
    let world = MemoryWorld::new();
    write(&world, &capture(5), "out");
    world.insert("out/frame_notes.txt", *b"mine");
    world.insert("out/frame_000007.obj", *b"another padding");
    write(&world, &capture(2), "out");
    let left = world.paths();
    let left: Vec<_> = left.iter().filter_map(|path| path.to_str()).collect();
    let frames = ["out/frame_0001.obj", "out/frame_0002.obj"];
    assert_eq!(left[0], "out/frame_000007.obj");
    assert_eq!(left[1..3], frames);
    assert_eq!(left[3..], ["out/frame_notes.txt"]);
}

#[test]
fn inputs_are_not_written_over() {
    let world = MemoryWorld::new();
    write(&world, &capture(3), "a");
    let opened = open(&world, &InputSpec::new("a"), &Task::default()).unwrap();
    let files = opened.output.origin.files.clone();
    let output = Output::from("a").protecting(&files);
    let before = world.read(Path::new("a/frame_0001.obj")).unwrap();
    let error = save(&world, &sequence(opened.output), &output, &Task::default()).unwrap_err();
    assert_eq!(error.message, "the output would replace an input");
    assert_eq!(world.read(Path::new("a/frame_0001.obj")).unwrap(), before);
}

#[test]
fn cancelled_saving_changes_nothing() {
    let world = MemoryWorld::new();
    write(&world, &capture(3), "a");
    let task = Task::default();
    task.cancel();
    let ended = save(&world, &capture(5), &Output::from("a"), &task);
    assert_eq!(ended.unwrap_err().message, "interrupted");
    assert_eq!(world.paths().len(), 3);
}

const QUADS: &str = "\
mtllib cloth.mtl
o sheet
v 0 0 0
v 1 0 0
v 1 1 0
v 0 1 0
v 2 0 0
v 2 1 0
vt 0 0
vt 1 0
vt 0.5 1
g left side
usemtl blue
s 1
f 1/1 2/2 3/3 4
g right
s off
f 2/2 5/1 6/3 3/3
";

#[test]
fn texture_coordinates_and_groups_are_written_again() {
    let world = MemoryWorld::new();
    world.insert("a.obj", QUADS);
    write(&world, &read(&world, &InputSpec::new("a.obj")), "b.obj");
    let written = String::from_utf8(world.read(Path::new("b.obj")).unwrap()).unwrap();
    let (names, rest): (Vec<_>, Vec<_>) = QUADS.lines().partition(|line| line.starts_with('o'));
    let mut expected: Vec<&str> = rest;
    let first_name = expected
        .iter()
        .position(|line| line.starts_with("g "))
        .unwrap();
    expected.splice(first_name..first_name, names);
    assert_eq!(written.lines().collect::<Vec<_>>(), expected);
}

#[test]
fn obj_as_people_write_it() {
    let plain = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 5 5 5\nf 1 2 3\nf 1 3 4\n";
    let odd = "# made by hand\r\n\r\nv  0 0\\\n 0   \r\n  v\t1 0 0 1.0\nvn 0 0 1\nv 0 1 0 0.1 0.2 0.3\nf -3// -2//1 -1/ # first\nv 5e0 +5 .5e1\np 1\nf 1 3 \\\n -1";
    let world = MemoryWorld::new();
    world.insert("plain.obj", plain);
    world.insert("odd.obj", odd);
    let (plain, odd) = ("plain.obj", "odd.obj");
    for names in [[plain, odd], [odd, plain], [odd, odd]] {
        let spec = InputSpec {
            paths: names.iter().map(Into::into).collect(),
            ..InputSpec::default()
        };
        let both = read(&world, &spec);
        assert_eq!(both.frame(0), both.frame(1));
        assert_eq!(both.frame(0)[9..], [5.0; 3]);
        assert_eq!(both.topology().face(1), [0, 2, 3]);
    }
}

#[test]
fn missing_numbers_are_warned_of() {
    let world = MemoryWorld::new();
    for number in [1, 3, 5, 9, 11] {
        write(&world, &capture(1), &format!("a/f{number:02}.obj"));
    }
    let opened = open(&world, &InputSpec::new("a"), &Task::default()).unwrap();
    let messages: Vec<_> = opened.warnings.iter().map(|w| w.message.as_str()).collect();
    assert_eq!(messages, ["the numbers go from 5 to 9, elsewhere by 2"]);
}

#[test]
fn normals_are_computed_anew_where_there_were_some() {
    let obj = "v 0 0 0\nv 2 0 0\nv 0 2 0\nvt 0 0\nvn 1 0 0\nf 1/1/1 2/1/1 3//1\n";
    for out in ["b.obj", "b.ply"] {
        let world = MemoryWorld::new();
        world.insert("a.obj", obj);
        let output = Output::from(out).encoded(Encoding::Ascii);
        let given = read(&world, &InputSpec::new("a.obj"));
        save(&world, &given, &output, &Task::default()).unwrap();
        let text = String::from_utf8(world.read(Path::new(out)).unwrap()).unwrap();
        let expected = match out {
            "b.obj" => "v 0 2 0\nvn 0 0 1\nvn 0 0 1\nvn 0 0 1\nvt 0 0\nf 1/1/1 2/1/2 3//3\n",
            _ => "0 0 0 0 0 1\n2 0 0 0 0 1\n0 2 0 0 0 1\n3 0 1 2 6 0 0 0 0 0 0\n",
        };
        assert!(text.ends_with(expected), "{text}");
        let again = read(&world, &InputSpec::new(out));
        assert!(again.topology().attributes().normals);
        assert_eq!(again.positions(), given.positions());
    }
}

fn refused(world: &dyn World, spec: &InputSpec) -> String {
    let opened = open(world, spec, &Task::default());
    opened.map(|_| ()).unwrap_err().to_string()
}

#[test]
fn a_folder_is_one_capture_or_refused_with_the_choices() {
    let world = MemoryWorld::new();
    let given = capture(4);
    write(&world, &given, "a/frames.mdd");
    let error = refused(&world, &InputSpec::new("a"));
    assert!(error.contains("--mesh"), "{error}");
    write(&world, &given.slice(0..1), "a/base.obj");
    world.insert("a/notes.txt", *b"");
    world.insert("a/.hidden.obj", *b"");
    // a loom beside a capture is what was fitted to it
    world.insert("a/fitted.loom", *b"");
    let read_back = read(&world, &InputSpec::new("a"));
    assert_eq!(read_back.positions(), given.positions());

    write(&world, &given, "a/other.mdd");
    let error = refused(&world, &InputSpec::new("a"));
    assert!(error.contains("'a/frames.mdd' (1 file)"), "{error}");
    assert!(error.contains("'a/other.mdd' (1 file)"), "{error}");

    write(&world, &given, "b/walk_##.ply");
    write(&world, &given, "b/run_##.ply");
    let error = refused(&world, &InputSpec::new("b"));
    assert!(error.contains("choose one: 'b/run_##.ply' (4 files), 'b/walk_##.ply' (4 files)"));
    read(&world, &InputSpec::new("b/run_##.ply"));
    assert!(
        refused(&world, &InputSpec::new("b/rum_01.ply")).contains("did you mean b/run_01.ply?")
    );
}

#[test]
fn poses_with_names_are_taken_in_their_order() {
    let world = MemoryWorld::new();
    let given = capture(3);
    for (frame, name) in ["anger", "cry", "fury"].into_iter().enumerate() {
        write(
            &world,
            &given.slice(frame..frame + 1),
            &format!("faces/{name}.obj"),
        );
    }
    assert_eq!(
        read(&world, &InputSpec::new("faces")).positions(),
        given.positions()
    );
}

#[test]
fn a_sequence_outgrows_its_digits() {
    let world = MemoryWorld::new();
    let given = capture(101);
    let names = write(&world, &given, "f#.ply");
    assert_eq!((&*names[8], &*names[100]), ("f9.ply", "f101.ply"));
    assert_eq!(
        read(&world, &InputSpec::new("f#.ply")).positions(),
        given.positions()
    );
    assert_eq!(
        read(&world, &InputSpec::new("f*.ply")).positions(),
        given.positions()
    );
}
