//! glTF in: skins, morph targets, moving nodes, all kinds of keys, seams; and a real file where there is
//! one.

use std::path::Path;

use meshloom::io::Disk;
use meshloom::pipeline::{Capture, InputSpec, Output, open, save};
use meshloom::task::Task;
use meshloom::world::MemoryWorld;
use serde_json::{Value, json};

/// A description with its numbers in one buffer beside it.
struct Scene {
    root: Value,
    bytes: Vec<u8>,
}

impl Scene {
    fn new() -> Self {
        let root = json!({
            "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}], "nodes": [],
            "meshes": [], "accessors": [], "bufferViews": [], "animations": [], "skins": []
        });
        Scene {
            root,
            bytes: Vec::new(),
        }
    }

    fn push(&mut self, list: &str, value: Value) -> usize {
        let list = self.root[list].as_array_mut().unwrap();
        list.push(value);
        list.len() - 1
    }

    /// An accessor of little-endian numbers.
    fn accessor(&mut self, kind: &str, component: u32, bytes: &[u8], count: usize) -> usize {
        let offset = self.bytes.len();
        self.bytes.extend_from_slice(bytes);
        self.bytes.resize(self.bytes.len().next_multiple_of(4), 0);
        let view = json!({"buffer": 0, "byteOffset": offset, "byteLength": bytes.len()});
        let view = self.push("bufferViews", view);
        let accessor = json!({
            "bufferView": view, "componentType": component, "count": count, "type": kind,
            "min": [0.0, 0.0, 0.0], "max": [1.0, 1.0, 1.0]
        });
        self.push("accessors", accessor)
    }

    fn floats(&mut self, kind: &str, numbers: &[f32]) -> usize {
        let bytes: Vec<u8> = numbers.iter().flat_map(|n| n.to_le_bytes()).collect();
        let width = match kind {
            "SCALAR" => 1,
            "VEC2" => 2,
            "VEC3" => 3,
            "MAT4" => 16,
            _ => 4,
        };
        self.accessor(kind, 5126, &bytes, numbers.len() / width)
    }

    /// An animation of one track.
    fn animate(
        &mut self,
        name: &str,
        node: usize,
        path: &str,
        keys: &[f32],
        values: (&str, &[f32]),
        how: &str,
    ) {
        let input = self.floats("SCALAR", keys);
        let output = self.floats(values.0, values.1);
        let animation = json!({
            "name": name,
            "samplers": [{"input": input, "output": output, "interpolation": how}],
            "channels": [{"sampler": 0, "target": {"node": node, "path": path}}]
        });
        self.push("animations", animation);
    }

    fn world(mut self) -> MemoryWorld {
        let world = MemoryWorld::new();
        self.root["buffers"] = json!([{"uri": "a%20b.bin", "byteLength": self.bytes.len()}]);
        for list in ["animations", "skins"] {
            if self.root[list] == json!([]) {
                self.root.as_object_mut().unwrap().remove(list);
            }
        }
        world.insert("in/a b.bin", self.bytes);
        world.insert("in/scene.gltf", self.root.to_string());
        world
    }
}

fn frames(world: &MemoryWorld, path: &str) -> (Vec<Vec<f32>>, Capture, Vec<String>) {
    let opened = open(world, &InputSpec::new(path), &Task::default());
    let opened = opened.unwrap_or_else(|error| panic!("{error}"));
    let warnings = opened.warnings.iter().map(ToString::to_string).collect();
    let source = opened.output.content.frames();
    let frames = (0..source.frames()).map(|frame| {
        let mut positions = vec![0.0; 3 * source.topology().vertices()];
        source.read_frame(frame, &mut positions).unwrap();
        positions
    });
    (frames.collect(), opened.output, warnings)
}

/// Two triangles that share an edge, given as six vertices, in node 0.
fn seam(scene: &mut Scene) {
    let corners = [
        [0., 0., 0.],
        [1., 0., 0.],
        [0., 1., 0.],
        [1., 0., 0.],
        [1., 1., 0.],
        [-0., 1., 0.],
    ];
    let positions = scene.floats("VEC3", corners.as_flattened());
    let texture = scene.floats("VEC2", &[0., 0., 1., 0., 0., 1., 0.5, 0.5, 1., 1., 0., 1.]);
    let primitive = json!({"attributes": {"POSITION": positions, "TEXCOORD_0": texture}});
    scene.push("meshes", json!({"primitives": [primitive]}));
    scene.push("nodes", json!({"mesh": 0, "name": "sheet"}));
}

#[test]
fn seams_are_welded_and_texture_coordinates_kept() {
    let mut scene = Scene::new();
    seam(&mut scene);
    let world = scene.world();
    let (frames, capture, warnings) = frames(&world, "in/scene.gltf");
    assert_eq!(warnings, [""; 0]);
    assert_eq!(frames, [[0., 0., 0., 1., 0., 0., 0., 1., 0., 1., 1., 0.]]);
    let source = capture.content.frames();
    assert_eq!(source.fps(), None);
    assert_eq!(source.topology().triangles(), [[0, 1, 2], [1, 3, 2]]);
    save(&world, &*source, &Output::from("out.obj"), &Task::default()).unwrap();
    let text = meshloom::world::World::read(&world, Path::new("out.obj")).unwrap();
    let text = String::from_utf8(text).unwrap();
    // v points up in OBJ
    assert!(
        text.contains("vt 0.5 0.5\n") && text.contains("vt 0 0\nf") || text.contains("o sheet")
    );
    assert!(text.ends_with("f 1/1 2/2 3/3\nf 2/4 4/5 3/6\n"), "{text}");
}

#[test]
fn nodes_move_below_their_parents() {
    let mut scene = Scene::new();
    seam(&mut scene);
    scene.root["nodes"][0] =
        json!({"children": [1], "translation": [10, 0, 0], "scale": [2, 2, 2]});
    scene.push("nodes", json!({"mesh": 0}));
    // a quarter turn about z in half a second, in steps of 1/10
    let keys: Vec<f32> = (0..6).map(|i| i as f32 / 10.0).collect();
    let turn: Vec<f32> = keys
        .iter()
        .flat_map(|t| {
            let half = t / 0.5 * std::f32::consts::FRAC_PI_4;
            [0.0, 0.0, half.sin(), half.cos()]
        })
        .collect();
    scene.animate("turn", 1, "rotation", &keys, ("VEC4", &turn), "LINEAR");
    let (frames, capture, _) = frames(&scene.world(), "in/scene.gltf");
    assert_eq!(
        (frames.len(), capture.content.frames().fps()),
        (6, Some(10.0))
    );
    for (vertex, expected) in [[10., 0., 0.], [10., 2., 0.], [8., 0., 0.], [8., 2., 0.]]
        .iter()
        .enumerate()
    {
        for axis in 0..3 {
            // f32 keys: a few units in the last place of numbers around 10
            assert!((frames[5][3 * vertex + axis] - expected[axis]).abs() < 1e-5);
        }
    }
}

#[test]
fn two_keys_are_sampled_thirty_times_a_second() {
    let mut scene = Scene::new();
    seam(&mut scene);
    let slide = [0., 0., 0., 4., 0., 0.];
    scene.animate(
        "slide",
        0,
        "translation",
        &[1.0, 3.0],
        ("VEC3", &slide),
        "LINEAR",
    );
    let held = [5., 5., 5., 0., 0., 0.];
    scene.animate(
        "jump",
        0,
        "translation",
        &[0.0, 1.0],
        ("VEC3", &held),
        "STEP",
    );
    let world = scene.world();
    let (slid, capture, warnings) = frames(&world, "in/scene.gltf");
    assert_eq!(
        (slid.len(), capture.content.frames().fps()),
        (61, Some(30.0))
    );
    for (frame, positions) in slid.iter().enumerate() {
        let expected = 4.0 * frame as f32 / 60.0;
        assert!((positions[0] - expected).abs() < 1e-6, "frame {frame}");
    }
    assert_eq!(warnings.len(), 1);
    assert!(
        warnings[0].contains("2 animations, `slide` is taken")
            && warnings[0].contains("slide, jump")
    );
    let (jumped, _, warnings) = frames(&world, "in/scene.gltf#jump");
    assert_eq!(
        (jumped[29][0], jumped[30][0], warnings.len()),
        (5.0, 0.0, 0)
    );
    let unknown = open(
        &world,
        &InputSpec::new("in/scene.gltf#walk"),
        &Task::default(),
    );
    assert_eq!(unknown.unwrap_err().hints, ["there are slide, jump"]);
}

#[test]
fn morph_targets_displace_by_their_weights() {
    let mut scene = Scene::new();
    seam(&mut scene);
    let lift = [[0., 0., 1.], [0.; 3], [0.; 3], [0.; 3], [0.; 3], [0.; 3]];
    let lift = scene.floats("VEC3", lift.as_flattened());
    // only the sixth vertex, as a sparse accessor: it parts from the third, which it was welded to
    let indices = scene.accessor("SCALAR", 5123, &5_u16.to_le_bytes(), 1);
    let values = scene.floats("VEC3", &[0., 0., -2.]);
    let view =
        |scene: &Scene, accessor: usize| scene.root["accessors"][accessor]["bufferView"].clone();
    let (indices, values) = (view(&scene, indices), view(&scene, values));
    let sparse = json!({
        "componentType": 5126, "count": 6, "type": "VEC3",
        "sparse": {
            "count": 1,
            "indices": {"bufferView": indices, "componentType": 5123},
            "values": {"bufferView": values}
        }
    });
    let sparse = scene.push("accessors", sparse);
    scene.root["meshes"][0]["primitives"][0]["targets"] =
        json!([{"POSITION": lift}, {"POSITION": sparse}]);
    scene.root["meshes"][0]["weights"] = json!([0.0, 1.0]);
    let cubic = [
        0., 0., 0., 1., 0., 0., // slopes before, values, slopes after
        0., 0., 1., 0.5, 0., 0.,
    ];
    scene.animate(
        "smile",
        0,
        "weights",
        &[0.0, 0.2],
        ("SCALAR", &cubic),
        "CUBICSPLINE",
    );
    let (frames, ..) = frames(&scene.world(), "in/scene.gltf");
    assert_eq!((frames.len(), frames[0].len()), (7, 15));
    let heights = |frame: &[f32]| [frame[2], frame[14]];
    assert_eq!(heights(&frames[0]), [0.0, -2.0]);
    assert_eq!(heights(&frames[6]), [1.0, -1.0]);
    for (found, expected) in heights(&frames[3]).iter().zip([0.5, -1.5]) {
        // the middle of Hermite's cubic; key times are f32
        assert!((found - expected).abs() < 1e-6);
    }
}

#[test]
fn joints_carry_vertices() {
    let mut scene = Scene::new();
    seam(&mut scene);
    let joints: Vec<u8> = [[0_u8, 1, 0, 0]; 6].concat();
    let joints = scene.accessor("VEC4", 5121, &joints, 6);
    // by height: those at y = 1 hang on joint 1; given as bytes that sum to 255
    let weight = |up: bool| {
        if up {
            [0_u8, 255, 0, 0]
        } else {
            [255, 0, 0, 0]
        }
    };
    let weights = [false, false, true, false, true, true].map(weight).concat();
    let weights = scene.accessor("VEC4", 5121, &weights, 6);
    scene.root["accessors"][weights]["normalized"] = json!(true);
    let attributes = &mut scene.root["meshes"][0]["primitives"][0]["attributes"];
    attributes["JOINTS_0"] = json!(joints);
    attributes["WEIGHTS_0"] = json!(weights);
    // joint 1 stands at y = 1 in bind pose
    let mut bind = [0.0_f32; 32];
    for at in 0..4 {
        bind[5 * at] = 1.0;
        bind[16 + 5 * at] = 1.0;
    }
    bind[16 + 13] = -1.0;
    let bind = scene.floats("MAT4", &bind);
    scene.push(
        "skins",
        json!({"joints": [1, 2], "inverseBindMatrices": bind}),
    );
    // the place of the skinned node itself does not count
    scene.root["nodes"][0] = json!({"mesh": 0, "skin": 0, "translation": [7, 7, 7]});
    scene.push("nodes", json!({"children": [2]}));
    scene.push("nodes", json!({"translation": [0, 1, 0]}));
    scene.root["scenes"][0] = json!({"nodes": [0, 1]});
    let keys: Vec<f32> = (0..3).map(|i| i as f32 / 24.0).collect();
    let up = [0., 1., 0., 0., 2., 0., 0., 3., 0.];
    scene.animate("rise", 2, "translation", &keys, ("VEC3", &up), "LINEAR");
    let (frames, capture, _) = frames(&scene.world(), "in/scene.gltf");
    assert_eq!(capture.content.frames().fps(), Some(24.0));
    assert_eq!(frames[2], [0., 0., 0., 1., 0., 0., 0., 3., 0., 1., 3., 0.]);
}

#[test]
fn damaged_scenes_are_refused() {
    let changes: [(&str, Value); 9] = [
        ("/accessors/0/count", json!(4_000_000_000_u64)),
        ("/accessors/0/bufferView", json!(99)),
        ("/accessors/0/byteOffset", json!(u64::MAX / 2)),
        ("/bufferViews/0/byteLength", json!(4_000_000_000_u64)),
        ("/bufferViews/0/byteOffset", json!(1_u64 << 60)),
        ("/nodes/0/children", json!([0])),
        ("/animations/0/channels/0/target/node", json!(5)),
        ("/animations/0/channels/0/target/path", json!("colour")),
        ("/meshes/0/primitives/0/attributes/POSITION", json!(1)),
    ];
    for (place, value) in changes {
        let mut scene = Scene::new();
        seam(&mut scene);
        let slide = [0., 0., 0., 4., 0., 0.];
        scene.animate(
            "slide",
            0,
            "translation",
            &[1.0, 3.0],
            ("VEC3", &slide),
            "LINEAR",
        );
        let (parent, key) = place.rsplit_once('/').unwrap();
        scene.root.pointer_mut(parent).unwrap()[key] = value;
        let opened = open(
            &scene.world(),
            &InputSpec::new("in/scene.gltf"),
            &Task::default(),
        );
        let error = opened.map(|_| ()).expect_err(place);
        assert_eq!(
            error.place.file.as_deref(),
            Some(Path::new("in/scene.gltf")),
            "{error}"
        );
    }
    let mut scene = Scene::new();
    seam(&mut scene);
    let world = scene.world();
    world.remove("in/a b.bin");
    let error = open(&world, &InputSpec::new("in/scene.gltf"), &Task::default()).map(|_| ());
    let error = error.unwrap_err();
    assert_eq!(error.place.file.as_deref(), Some(Path::new("in/a b.bin")));
}

#[test]
fn the_fox_runs() {
    let fox = concat!(env!("CARGO_MANIFEST_DIR"), "/../shared/data/fox/Fox.glb");
    if !Path::new(fox).exists() {
        println!("skipped: no real captures");
        return;
    }
    let mut topologies = Vec::new();
    // the keys of `Run` skip 4.8 steps of 1/24 s once: no grid
    for (name, frames) in [("Survey", 83), ("Walk", 18), ("Run", 35)] {
        let spec = InputSpec::new(format!("{fox}#{name}"));
        let opened = open(&Disk, &spec, &Task::default()).unwrap_or_else(|error| panic!("{error}"));
        assert_eq!(opened.warnings, []);
        let source = opened.output.content.frames();
        assert_eq!(source.frames(), frames, "{name}");
        assert_eq!(source.fps(), Some(if name == "Run" { 30.0 } else { 24.0 }));
        topologies.push(source.topology().clone());
    }
    assert!(
        topologies
            .iter()
            .all(|one| one.same_connectivity(&topologies[0]))
    );
    // 576 triangles over split vertices; a closed surface has half as many vertices as triangles
    assert_eq!(topologies[0].faces(), 576);
    assert!(
        topologies[0].vertices() < 576 / 2 + 20,
        "{}",
        topologies[0].vertices()
    );
}
