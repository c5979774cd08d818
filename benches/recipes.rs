//! What recipes and watched folders cost beside the least that they could: `cargo bench --bench recipes`.
//!
//! Each time stands beside a baseline of the same run: an empty recipe, the bare loop, a plain listing.

use std::hint::black_box;
use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::sync::Arc;
use std::time::{Duration, Instant};

use meshloom::inbox::{Inbox, Listed, Rules};
use meshloom::io::{Disk, listing};
use meshloom::pipeline::Memory;
use meshloom::recipe::{Input, Recipe, Request, Runner};
use meshloom::script::Scripts;
use meshloom::task::Task;

const RUNS: usize = 7;

/// What `--live` waits for further saves.
const QUIET: Duration = Duration::from_millis(30);

fn main() {
    recipes();
    live();
    interruptions();
    listings();
}

/// Median time in milliseconds.
fn median(mut time: impl FnMut() -> Duration) -> f64 {
    let mut times: Vec<Duration> = (0..RUNS).map(|_| time()).collect();
    times.sort();
    1e3 * times[RUNS / 2].as_secs_f64()
}

fn report(name: &str, time: f64, baseline: f64, what: &str) {
    println!(
        "{time:>9.2} ms  {:>7.1} x {what} ({baseline:.2} ms)   {name}",
        time / baseline
    );
}

/// Runs inside of one process, what is expensive remembered in memory.
fn recipes() {
    let scripts = Scripts::new(Arc::new(Disk), Arc::new(Memory::new(1 << 30, None)));
    let request = Request {
        input: Some(Input::Demo("gallop".into())),
        ..Request::default()
    };
    let run = |text: &str| {
        let recipe = Recipe {
            path: "bench.rhai".into(),
            text: text.into(),
        };
        let begun = Instant::now();
        let outcome = scripts.run(&recipe, &request, &Task::default());
        if let Err(failure) = outcome {
            panic!("{}", failure.diagnostic);
        }
        begun.elapsed()
    };
    let one = median(|| run("1"));
    let lines: String = (0..100)
        .map(|i| {
            format!("let a{i} = if {i} % 3 == 0 {{ [{i}, 2.5] }} else {{ `text ${{{i} + 1}}` }};\n")
        })
        .collect();
    report(
        "parse and run 100 lines",
        median(|| run(&lines)),
        one,
        "an empty recipe",
    );

    let fit = "let horse = fit(input(), #{ tolerance: 0.02 });\n";
    let computed = 1e3 * run(fit).as_secs_f64();
    let remembered = median(|| run(fit));
    report(
        "fit of the gallop, remembered",
        remembered,
        computed,
        "computed",
    );
    let edited = format!("{fit}horse.add_loop(8, 28, #{{ times: 2 }}).speed(30, 40, 0.5)");
    let edited = median(|| run(&edited));
    report(
        "the same, looped and slowed",
        edited,
        computed,
        "the fit computed",
    );

    // 8 samples a frame: 10001 calls
    let long = format!("{fit}let long = horse.retime([[1, 1], [1251, horse.frames]]);\n");
    let bare = median(|| run(&long));
    let closure = median(|| run(&format!("{long}long.retime(|t| 1 + (t - 1) * 0.999)")));
    let calls = "let f = |t| 1 + (t - 1) * 0.999; for i in 0..10001 { f.call(i); }";
    let calls = median(|| run(&format!("{long}{calls}"))) - bare;
    report(
        "retime by a function of 10001 samples",
        closure - bare,
        calls,
        "the calls alone",
    );
}

fn meshloom(folder: &Path, arguments: &str) -> Child {
    let mut command = Command::new(env!("CARGO_BIN_EXE_meshloom"));
    command
        .current_dir(folder)
        .env("MESHLOOM_CACHE", folder.join("cache"))
        .args(arguments.split(' '))
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(Stdio::null());
    command.spawn().expect("the binary starts")
}

/// From the save of a recipe to its result, by the whole program.
fn live() {
    let folder = tempfile::tempdir().expect("a folder");
    let recipe = folder.path().join("r.rhai");
    let text = |speed: f64| {
        format!("fit(input(), #{{ tolerance: 0.02 }}).add_loop(8, 28).speed(30, 40, {speed})")
    };
    let write = |speed: f64| std::fs::write(&recipe, text(speed)).expect("the recipe is saved");
    let capture = horse_gallop().unwrap_or_else(|| {
        let demo = meshloom(folder.path(), "demo gallop --write demo --json");
        demo.wait_with_output().expect("the demo is written");
        "demo/frames".into()
    });
    write(0.5);
    let mut child = meshloom(
        folder.path(),
        &format!("run r.rhai {capture} --live --json"),
    );
    let mut lines = BufReader::new(child.stdout.take().expect("a pipe")).lines();
    let begun = Instant::now();
    lines.next();
    let first = 1e3 * begun.elapsed().as_secs_f64();
    let mut speed = 0.5;
    let saved = median(|| {
        // another one every time; the watch is up by then
        std::thread::sleep(Duration::from_millis(100));
        speed += 0.01;
        let begun = Instant::now();
        write(speed);
        lines.next();
        begun.elapsed().saturating_sub(QUIET)
    });
    report(
        &format!("saved to new result after the quiet time, {capture}"),
        saved,
        first,
        "the first run",
    );
    let _ = child.kill();
    let _ = child.wait();
}

/// The horse of the papers, where it is at hand.
fn horse_gallop() -> Option<String> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/data/horse-gallop");
    path.is_dir().then(|| path.to_string_lossy().into_owned())
}

/// From a cancellation in the middle of native work to its end, in this process, as a reload waits for it;
/// and from Ctrl-C to the end of the program.
fn interruptions() {
    let jelly = "let j = demo(\"jelly\");\n";
    let fit = format!("{jelly}fit(j, #{{ tolerance: 0.02, space: \"gradients\" }})");
    let bar = "let b = fit(demo(\"bar\"), #{ tolerance: 0.02 });\n";
    let sample = format!("{bar}b.resample(frames(200000))");
    let pairs = format!(
        "{jelly}let a = fit(j, #{{ tolerance: 0.02 }});
        let s = []; for i in 0..20 {{ s.push(a.at(1.0 + 9 * i)); }}
        let t = [s[0]]; for i in 1..20 {{ t.push(a.at(9.5 * i)); }}\n"
    );
    let transfer = format!("{pairs}a.transfer(examples(t, s))");
    for (name, before, text) in [
        ("demo", "1", jelly),
        ("fit", jelly, fit.as_str()),
        ("sample", bar, &sample),
        ("transfer", &pairs, &transfer),
    ] {
        let native = cancelled(before, text);
        let folder = tempfile::tempdir().expect("a folder");
        std::fs::write(folder.path().join("r.rhai"), text).expect("the recipe is saved");
        let process = (0..RUNS as u64)
            .map(|run| interrupted(folder.path(), 120 + 60 * run))
            .max();
        let most = |time: Option<Duration>| 1e3 * time.unwrap_or_default().as_secs_f64();
        println!(
            "{:>9.2} ms at most from a cancellation in {name} to its end, {:.2} ms from Ctrl-C to the program's",
            most(native),
            most(process)
        );
    }
}

/// How long a run goes on at most after it is cancelled at some moment, what it needs `before` remembered.
fn cancelled(before: &str, text: &str) -> Option<Duration> {
    let scripts = Scripts::new(Arc::new(Disk), Arc::new(Memory::new(1 << 30, None)));
    let run = |text: &str, task: &Task| {
        let recipe = Recipe {
            path: "bench.rhai".into(),
            text: text.into(),
        };
        scripts.run(&recipe, &Request::default(), task).is_ok()
    };
    run(before, &Task::default());
    let after = |moment: u32| {
        let task = Task::default();
        std::thread::scope(|scope| {
            let work = scope.spawn(|| run(text, &task));
            std::thread::sleep(Duration::from_millis(20) * moment);
            let asked = Instant::now();
            task.cancel();
            let _ = work.join();
            asked.elapsed()
        })
    };
    (1..=RUNS as u32).map(after).max()
}

fn interrupted(folder: &Path, after: u64) -> Duration {
    let mut child = meshloom(folder, "run r.rhai");
    std::thread::sleep(Duration::from_millis(after));
    let asked = Instant::now();
    let id = child.id().to_string();
    let _ = Command::new("kill").args(["-INT", &id]).status();
    let _ = child.wait();
    asked.elapsed()
}

/// A folder of 100 000 files.
fn listings() {
    let folder = tempfile::tempdir().expect("a folder");
    for i in 0..100_000 {
        let name = format!("run_{i:06}.obj");
        std::fs::write(folder.path().join(name), "").expect("a file");
    }
    let plain = median(|| {
        let begun = Instant::now();
        let entries = std::fs::read_dir(folder.path())
            .into_iter()
            .flatten()
            .flatten();
        black_box(entries.filter_map(|entry| entry.metadata().ok()).count());
        begun.elapsed()
    });
    let out = folder.path().join("out");
    let list = || listing(folder.path(), &out).expect("the folder is listed");
    let listed = median(|| {
        let begun = Instant::now();
        black_box(list());
        begun.elapsed()
    });
    report("100000 files listed", listed, plain, "each looked at");
    let rules = Rules {
        settle: Duration::from_secs(2),
        workers: 2,
    };
    let mut inbox = Inbox::new(rules, "recipe", []);
    let observed = median(|| {
        let begun = Instant::now();
        let listed: Vec<Listed> = list()
            .into_iter()
            .map(|(path, length, modified)| Listed {
                path,
                length,
                modified,
            })
            .collect();
        inbox.observe(&listed, Duration::ZERO);
        begun.elapsed()
    });
    report(
        "the same, found to be one capture",
        observed,
        plain,
        "each looked at",
    );
}
