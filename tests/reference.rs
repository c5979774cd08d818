//! The reference of what recipes can call: every function is described, every example runs, and the
//! generated pages in `scripts/` are those of the code.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use meshloom::io::Disk;
use meshloom::loom::fit::{FitOptions, fit};
use meshloom::pipeline::{InputSpec, Memory, Output, save, save_loom};
use meshloom::recipe::{Input, Recipe, Request, Runner};
use meshloom::script::{Scripts, reference};
use meshloom::task::Task;

#[test]
fn every_function_is_described_with_forms_and_an_example() {
    let reference = reference();
    assert!(reference.entries().count() > 25);
    for (name, entry) in reference.entries() {
        assert!(entry.summary.ends_with('.'), "{name}: {}", entry.summary);
        assert!(entry.forms.contains(name), "{name}: {}", entry.forms);
        assert!(!entry.examples.is_empty(), "{name} has no example");
    }
}

#[test]
fn every_example_runs() {
    let folder = tempfile::tempdir().unwrap();
    let bar = meshloom::demo::Demo::find("bar").unwrap().generate();
    let task = Task::default();
    save(
        &Disk,
        &bar.slice(0..4),
        &Output::from(folder.path().join("capture/frame_#.obj")),
        &task,
    )
    .unwrap();
    let loom = fit(
        &bar,
        &FitOptions {
            tolerance: 0.05,
            ..FitOptions::default()
        },
        &task,
    )
    .unwrap()
    .output;
    save_loom(
        &Disk,
        &loom,
        &Output::from(folder.path().join("bar.loom")),
        &task,
    )
    .unwrap();
    let scripts = Scripts::new(Arc::new(Disk), Arc::new(Memory::new(1 << 30, None)));
    let request = Request {
        input: Some(Input::Files(InputSpec::new(folder.path().join("capture")))),
        output: Some(folder.path().join("out")),
        ..Request::default()
    };
    for (name, entry) in reference().entries() {
        for (index, example) in entry.examples.iter().enumerate() {
            let recipe = Recipe {
                path: folder.path().join(format!("{name}-{index}.rhai")),
                text: example.clone(),
            };
            if let Err(failure) = scripts.run(&recipe, &request, &task) {
                panic!("{name}: {}", failure.diagnostic);
            }
        }
    }
}

#[test]
fn the_pages_in_scripts_are_those_of_the_code() {
    let page = Path::new(env!("CARGO_MANIFEST_DIR")).join("scripts/reference.md");
    let definitions: PathBuf =
        Path::new(env!("CARGO_MANIFEST_DIR")).join("scripts/meshloom.d.rhai");
    for (path, text) in [
        (page, reference().page()),
        (definitions, reference().definitions()),
    ] {
        if std::env::var_os("UPDATE").is_some() {
            std::fs::write(&path, &text).unwrap();
        }
        let found = std::fs::read_to_string(&path).unwrap_or_default();
        assert!(
            found == text,
            "{} is stale: run the test with UPDATE=1",
            path.display()
        );
    }
}
