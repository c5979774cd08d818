//! The command line's contracts, through the real binary: JSON keys, exit codes, what goes where.

mod support;

use std::fs;
use std::io::Read;
use std::process::Stdio;

use support::capture::sheet;
use support::{command, keys, meshloom, run, subcommands};
use tempfile::tempdir;

#[test]
fn info_says_what_a_capture_holds() {
    let folder = tempdir().unwrap();
    sheet(5, 3).write_objs(&folder.path().join("sheet"));
    let info = meshloom(folder.path(), "info sheet --json").done().object();
    assert_eq!(
        keys(&info),
        [
            "boundary_edges",
            "bounds",
            "bytes",
            "closed",
            "components",
            "edges",
            "faces",
            "format",
            "fps",
            "frames",
            "vertices",
        ]
    );
    let count = |key: &str| info[key].as_u64().unwrap();
    // A grid of 5 x 5 vertices: 2 * 5 * 4 sides and 16 diagonals, 16 of the sides on the border.
    assert_eq!(
        [count("frames"), count("vertices"), count("faces")],
        [3, 25, 32]
    );
    assert_eq!(
        [count("edges"), count("boundary_edges"), count("components")],
        [56, 16, 1]
    );
    assert_eq!(
        (info["closed"].as_bool(), info["format"].as_str()),
        (Some(false), Some("OBJ"))
    );
    assert!(info["fps"].is_null());
    assert_eq!(info["bounds"]["max"][0], 4.0);
}

#[test]
fn a_part_of_a_capture_is_a_capture() {
    let folder = tempdir().unwrap();
    let capture = sheet(4, 9);
    capture.write_objs(&folder.path().join("sheet"));
    meshloom(folder.path(), "convert sheet --range 3:5 -o part/f_##.obj").done();
    let names: Vec<_> = fs::read_dir(folder.path().join("part")).unwrap().collect();
    assert_eq!(names.len(), 3);
    let info = meshloom(folder.path(), "info part --json").done().object();
    assert_eq!(info["frames"], 3);
    let same = meshloom(
        folder.path(),
        "compare part/f_##.obj sheet --range 1:3 --json",
    )
    .done();
    assert!(
        same.object()["kg_percent"].as_f64().unwrap() > 1.0,
        "other frames differ"
    );
}

#[test]
fn comparing_with_itself_finds_nothing() {
    let folder = tempdir().unwrap();
    sheet(4, 5).write_objs(&folder.path().join("sheet"));
    let found = meshloom(folder.path(), "compare sheet sheet --json")
        .done()
        .object();
    assert_eq!(
        keys(&found),
        [
            "edge_max_percent",
            "edge_rms_percent",
            "frames",
            "kg_percent",
            "max",
            "rms"
        ]
    );
    for key in [
        "kg_percent",
        "rms",
        "max",
        "edge_rms_percent",
        "edge_max_percent",
    ] {
        assert_eq!(found[key], 0.0, "{key}");
    }
    assert_eq!(found["frames"], 5);
}

#[test]
fn converting_there_and_back_changes_no_bit() {
    let folder = tempdir().unwrap();
    sheet(4, 5).write_objs(&folder.path().join("sheet"));
    let saved = meshloom(folder.path(), "convert sheet -o again/f_####.obj --json")
        .done()
        .object();
    assert_eq!(saved["frames"], 5);
    assert_eq!(saved["outputs"][4], "again/f_0005.obj");
    let found = meshloom(folder.path(), "compare sheet again --json")
        .done()
        .object();
    assert_eq!(found["max"], 0.0);
}

#[test]
fn people_read_stderr_and_scripts_stdout() {
    let folder = tempdir().unwrap();
    sheet(4, 2).write_objs(&folder.path().join("sheet"));
    let run = meshloom(folder.path(), "info sheet").done();
    assert_eq!(run.stdout, "");
    assert!(
        run.stderr.contains("vertices") && !run.stderr.contains('\x1b'),
        "{}",
        run.stderr
    );
    let run = meshloom(folder.path(), "info sheet --quiet --json").done();
    assert_eq!(run.stderr, "");
    assert_eq!(run.stdout.lines().count(), 1);
}

#[test]
fn failures_are_data_too() {
    let folder = tempdir().unwrap();
    fs::write(
        folder.path().join("a.obj"),
        "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9\n",
    )
    .unwrap();
    let run = meshloom(folder.path(), "info a.obj --json");
    run.fails_with(&["a.obj:4", "9"]);
    let error = &run.object()["error"];
    assert_eq!(error["severity"], "error");
    assert_eq!(
        (error["file"].as_str(), error["line"].as_u64()),
        (Some("a.obj"), Some(4))
    );
    assert!(error["message"].is_string() && error["hints"].is_array());
}

#[test]
fn wrong_usage_is_2_and_says_so_as_data_as_well() {
    let folder = tempdir().unwrap();
    for args in [
        "",
        "nonsense",
        "info",
        "info x --range 0:3",
        "info x --range 5:3",
        "info x --threads 0",
        "convert x",
        "doctor --nope",
    ] {
        let run = meshloom(folder.path(), args);
        assert_eq!(
            (run.code, run.stdout.as_str()),
            (Some(2), ""),
            "{args}: {}",
            run.stderr
        );
    }
    let run = meshloom(folder.path(), "info --json");
    assert_eq!(run.code, Some(2));
    assert_eq!(run.object()["error"]["severity"], "error");
}

#[test]
fn help_and_version_are_asked_for_and_go_to_stdout() {
    let folder = tempdir().unwrap();
    let help = meshloom(folder.path(), "--help").done();
    assert!(help.stdout.contains("Usage: meshloom") && help.stderr.is_empty());
    let version = meshloom(folder.path(), "--version").done();
    assert_eq!(
        version.stdout,
        format!("meshloom {}\n", env!("CARGO_PKG_VERSION"))
    );
}

#[test]
fn completions_and_manual_name_every_subcommand() {
    let folder = tempdir().unwrap();
    let commands = subcommands();
    assert!(commands.iter().any(|name| name == "info"));
    let manual = meshloom(folder.path(), "man").done().stdout;
    for shell in ["bash", "zsh", "fish", "elvish", "powershell"] {
        let script = meshloom(folder.path(), &format!("completions {shell}"))
            .done()
            .stdout;
        for name in &commands {
            assert!(script.contains(name.as_str()), "{shell}: {name}");
        }
    }
    for name in commands {
        assert!(
            manual.contains(&format!(".TH meshloom\\-{name}"))
                || manual.contains(&format!(".TH meshloom-{name}")),
            "{name}"
        );
    }
}

#[test]
fn threads_come_from_the_flag_then_the_scheduler() {
    let folder = tempdir().unwrap();
    let machine = |args: &str, slurm: Option<&str>| {
        let mut command = command(folder.path(), args.split_whitespace());
        command.envs(slurm.map(|count| ("SLURM_CPUS_PER_TASK", count)));
        run(command).done().object()["machine"].clone()
    };
    let flag = machine("doctor --json --threads 3", Some("5"));
    assert_eq!(
        (flag["threads"].as_u64(), flag["threads_from"].as_str()),
        (Some(3), Some("--threads"))
    );
    let slurm = machine("doctor --json", Some("5"));
    assert_eq!(
        (slurm["threads"].as_u64(), slurm["threads_from"].as_str()),
        (Some(5), Some("SLURM_CPUS_PER_TASK"))
    );
    let cores = machine("doctor --json", None);
    assert_eq!(cores["threads"], cores["cores"]);
    assert_eq!(
        machine("doctor --json", Some("many"))["threads_from"],
        "cores"
    );
}

#[test]
fn a_reader_that_leaves_is_no_error() {
    let folder = tempdir().unwrap();
    let mut command = command(folder.path(), ["man"]);
    let mut child = command
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    drop(child.stdout.take());
    let mut stderr = String::new();
    child
        .stderr
        .take()
        .unwrap()
        .read_to_string(&mut stderr)
        .unwrap();
    assert_eq!(
        (child.wait().unwrap().code(), stderr.as_str()),
        (Some(0), "")
    );
}

#[test]
#[cfg(target_os = "linux")]
fn a_full_stdout_is_an_error() {
    let folder = tempdir().unwrap();
    let mut command = command(folder.path(), ["doctor", "--json"]);
    command.stdout(
        fs::OpenOptions::new()
            .write(true)
            .open("/dev/full")
            .unwrap(),
    );
    let run = run(command);
    assert_eq!(run.code, Some(1));
    assert!(
        run.stderr.contains("stdout cannot be written"),
        "{}",
        run.stderr
    );
}

/// A terminal of 24 rows and 80 columns with the binary in it.
#[cfg(unix)]
mod terminal {
    use std::io::Write;
    use std::path::Path;
    use std::process::Command;

    use portable_pty::{CommandBuilder, PtySize, native_pty_system};

    use super::*;

    /// Runs the binary; types `keys` once the screen shows `wanted`. What came on the screen, and the
    /// exit code.
    fn in_terminal(folder: &Path, args: &str, wanted: &str, keys: &str) -> (String, u32) {
        let size = PtySize {
            rows: 24,
            cols: 80,
            ..PtySize::default()
        };
        let pair = native_pty_system().openpty(size).unwrap();
        let mut command = CommandBuilder::new(env!("CARGO_BIN_EXE_meshloom"));
        command.args(args.split_whitespace());
        command.cwd(folder);
        command.env("TERM", "xterm-256color");
        command.env_remove("NO_COLOR");
        let mut child = pair.slave.spawn_command(command).unwrap();
        drop(pair.slave);
        let mut reader = pair.master.try_clone_reader().unwrap();
        let mut writer = pair.master.take_writer().unwrap();
        let (mut seen, mut typed, mut buffer) = (Vec::new(), false, [0; 4096]);
        // The end of the process shows as the end of the stream, or as an error (Linux).
        while let Ok(count @ 1..) = reader.read(&mut buffer) {
            seen.extend_from_slice(&buffer[..count]);
            if !typed && String::from_utf8_lossy(&seen).contains(wanted) {
                writer.write_all(keys.as_bytes()).unwrap();
                typed = true;
            }
        }
        let text = String::from_utf8_lossy(&seen).into_owned();
        (text, child.wait().unwrap().exit_code())
    }

    #[test]
    fn long_work_shows_its_phase_and_ends_at_ctrl_c() {
        let folder = tempdir().unwrap();
        let input = folder.path().join("sheet");
        sheet(4, 2).write_objs(&input);
        let pipe = input.join("frame_0003.obj");
        assert!(Command::new("mkfifo").arg(pipe).status().unwrap().success());
        let (screen, code) = in_terminal(folder.path(), "convert sheet -o out", "load", "\x03");
        assert!(screen.contains("/3"), "{screen:?}");
        assert!(screen.trim_end().ends_with("interrupted"), "{screen:?}");
        assert_eq!(code, 1);
    }

    #[test]
    fn reports_and_errors_are_coloured_there_only() {
        let folder = tempdir().unwrap();
        sheet(4, 2).write_objs(&folder.path().join("sheet"));
        let (screen, code) = in_terminal(folder.path(), "info sheet", "\n", "");
        assert!(screen.contains("\x1b[1msheet\x1b[0m"), "{screen:?}");
        assert_eq!(code, 0);
        let (screen, code) = in_terminal(folder.path(), "info shet", "\n", "");
        assert!(
            screen.contains("\x1b[1;31merror\x1b[0m: shet"),
            "{screen:?}"
        );
        assert_eq!(code, 1);
    }
}

#[cfg(unix)]
mod interruption {
    use std::path::Path;
    use std::process::{Child, Command};
    use std::time::Duration;

    use super::*;
    use support::{Run, everything};

    /// Starts the binary, waits until `ready`, sends it `signal`, and waits for its end.
    fn interrupted(folder: &Path, args: &str, signal: &str, ready: impl Fn(u32) -> bool) -> Run {
        let mut command = command(folder, args.split_whitespace());
        let piped = command.stdout(Stdio::piped()).stderr(Stdio::piped());
        let mut child: Child = piped.spawn().unwrap();
        while !ready(child.id()) && child.try_wait().unwrap().is_none() {
            std::thread::sleep(Duration::from_millis(1));
        }
        let id = child.id().to_string();
        Command::new("kill").args([signal, &id]).status().unwrap();
        Run::of(child.wait_with_output().unwrap())
    }

    /// Whether the process catches signals by now, where the system tells; else it is given time.
    fn listens(process: u32) -> bool {
        let Ok(status) = fs::read_to_string(format!("/proc/{process}/status")) else {
            std::thread::sleep(Duration::from_secs(1));
            return true;
        };
        let caught = status.lines().find_map(|line| line.strip_prefix("SigCgt:"));
        let caught = caught.and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok());
        let all = 1 | 1 << 1 | 1 << 14; // SIGHUP, SIGINT, SIGTERM
        caught.is_some_and(|mask| mask & all == all)
    }

    #[test]
    fn work_that_hangs_in_a_read_is_ended_all_the_same() {
        let folder = tempdir().unwrap();
        let input = folder.path().join("sheet");
        sheet(4, 2).write_objs(&input);
        let pipe = input.join("frame_0003.obj");
        assert!(
            Command::new("mkfifo")
                .arg(&pipe)
                .status()
                .unwrap()
                .success()
        );
        for signal in ["-INT", "-TERM", "-HUP"] {
            // Nobody writes to the pipe: the read does not return.
            let args = "convert sheet -o out --json";
            let run = interrupted(folder.path(), args, signal, listens);
            assert_eq!(run.code, Some(1), "{signal}: {}", run.stderr);
            assert_eq!(run.stderr, "interrupted\n");
            assert_eq!(run.object()["error"]["severity"], "cancelled");
            assert!(!folder.path().join("out").exists());
        }
    }

    #[test]
    fn staged_files_go_and_old_outputs_stay() {
        let folder = tempdir().unwrap();
        let out = folder.path().join("out");
        sheet(30, 120).write_objs(&folder.path().join("sheet"));
        sheet(3, 2).write_objs(&out);
        let before = everything(&out);
        let staging = |_| {
            let mut names = fs::read_dir(folder.path()).unwrap();
            names.any(|name| name.unwrap().file_name().to_string_lossy().starts_with('.'))
        };
        let run = interrupted(folder.path(), "convert sheet -o out", "-INT", staging);
        if run.code == Some(0) {
            // Faster than the signal: then everything is there.
            assert_eq!(fs::read_dir(&out).unwrap().count(), 120);
        } else {
            assert_eq!((run.code, run.stderr.as_str()), (Some(1), "interrupted\n"));
            assert_eq!(everything(&out), before);
        }
        assert!(!staging(0), "nothing hidden is left");
    }
}

#[test]
fn every_format_carries_the_same_frames() {
    let folder = tempdir().unwrap();
    sheet(4, 5).write_objs(&folder.path().join("sheet"));
    for (out, mesh) in [
        ("again.pc2", " --mesh sheet/frame_0001.obj"),
        ("again.mdd", " --mesh sheet/frame_0001.obj"),
        ("again/f_###.ply", ""),
    ] {
        let saved = format!("convert sheet -o {out} --fps 24 --json");
        assert_eq!(meshloom(folder.path(), &saved).done().object()["frames"], 5);
        let back = format!("convert {out}{mesh} -o back");
        meshloom(folder.path(), &back).done();
        let found = meshloom(folder.path(), "compare sheet back --json")
            .done()
            .object();
        assert_eq!(found["max"], 0.0, "{out}");
    }
}

#[test]
fn fit_reports_what_compare_measures() {
    let folder = tempdir().unwrap();
    sheet(8, 20).write_objs(&folder.path().join("sheet"));
    let fit = "fit sheet -o s.loom --method ch12 -k 12 -l 9 -m 5 --fps 24 --json";
    let report = meshloom(folder.path(), fit).done().object();
    let present = keys(&report);
    for key in [
        "frames",
        "vertices",
        "faces",
        "space",
        "dimension",
        "controls",
        "sites",
        "modes",
        "fps",
        "error",
        "left_out",
        "stress",
        "seconds",
        "warnings",
    ] {
        assert!(present.contains(&key), "{key} in {present:?}");
    }
    assert_eq!(
        keys(&report["error"]),
        ["pose", "positions", "shape", "time", "total"]
    );
    assert_eq!(keys(&report["left_out"]), ["cubic", "linear", "psi"]);
    assert_eq!(
        keys(&report["seconds"]),
        ["encode", "layout", "load", "pose", "shape", "time", "total"]
    );
    let count = |key: &str| report[key].as_u64().unwrap();
    assert_eq!(
        [count("frames"), count("vertices"), count("dimension")],
        [20, 64, 192]
    );
    assert_eq!(
        [count("controls"), count("sites"), count("modes")],
        [12, 9, 5]
    );
    assert_eq!(report["fps"], 24.0);

    meshloom(
        folder.path(),
        "sample s.loom -o back/f_###.obj --times 1:20:1",
    )
    .done();
    let found = meshloom(folder.path(), "compare sheet back --json")
        .done()
        .object();
    let (kg, total) = (&found["kg_percent"], &report["error"]["total"]);
    let (kg, total) = (kg.as_f64().unwrap() / 100.0, total.as_f64().unwrap());
    assert!(total > 0.01, "the fit is not exact: {total}");
    // Frames are rounded to f32 on their way through files: 6e-8 of the coordinates, which are up to
    // 20 times the motion, against errors of some per cent of it.
    assert!((kg / total - 1.0).abs() < 1e-4, "{kg} {total}");
    let direct = meshloom(folder.path(), "compare sheet s.loom --json")
        .done()
        .object();
    assert_eq!(direct, found, "a loom stands for its frames");
}

#[test]
fn full_fidelity_reproduces_every_frame() {
    let folder = tempdir().unwrap();
    sheet(6, 12).write_objs(&folder.path().join("sheet"));
    let fit = "fit sheet -o s.loom --method ch12 -k 14 -l 12 -m 11 --json";
    let report = meshloom(folder.path(), fit).done().object();
    assert!(report["error"]["total"].as_f64().unwrap() <= 1e-8);
    let found = meshloom(folder.path(), "compare sheet s.loom --json")
        .done()
        .object();
    assert!(
        found["kg_percent"].as_f64().unwrap() <= 1e-4,
        "1e-6 through files: {found}"
    );
}

#[test]
fn samples_are_as_many_as_asked_for() {
    let folder = tempdir().unwrap();
    sheet(4, 13).write_objs(&folder.path().join("sheet"));
    meshloom(folder.path(), "fit sheet -o s.loom --fps 24").done();
    for (times, frames) in [
        ("", 13),
        ("--frames 30", 30),
        ("--frames 1", 1),
        ("--rate 2", 25),
        ("--fps 30", 16), // floor(12 * 30/24 + 1e-9) + 1
        ("--times 1,2.5,13", 3),
        ("--times 1:13:0.5", 25),
        ("--range 3:7", 5),
        ("--range 3:7 --rate 4", 17),
    ] {
        let sample = format!("sample s.loom -o out/f_###.obj --json {times}");
        assert_eq!(
            meshloom(folder.path(), &sample).done().object()["frames"],
            frames,
            "{times}"
        );
        // Frames of the longer run before are gone.
        assert_eq!(
            fs::read_dir(folder.path().join("out")).unwrap().count(),
            frames,
            "{times}"
        );
    }
    for wrong in [
        "--frames 3 --rate 2",
        "--times 1:0:1",
        "--times a",
        "--rate -1",
        "--times 1:3:0",
    ] {
        let run = meshloom(folder.path(), &format!("sample s.loom -o out {wrong}"));
        assert_eq!(run.code, Some(2), "{wrong}: {}", run.stderr);
    }
    // Part of a loom is that part of its frames.
    meshloom(folder.path(), "sample s.loom -o whole").done();
    meshloom(folder.path(), "sample s.loom -o part --range 3:7").done();
    for frame in 1..=5 {
        let read = |name: String| fs::read(folder.path().join(name)).unwrap();
        let part = read(format!("part/frame_{frame:04}.obj"));
        assert_eq!(part, read(format!("whole/frame_{:04}.obj", frame + 2)));
    }
}

#[test]
fn any_number_of_threads_gives_the_same_bytes() {
    let folder = tempdir().unwrap();
    // More than 2^16 coordinates.
    let capture = sheet(150, 6);
    assert!(3 * capture.vertices() > 1 << 16);
    fs::write(folder.path().join("base.obj"), capture.obj(0)).unwrap();
    fs::write(folder.path().join("sheet.pc2"), capture.pc2()).unwrap();
    let with = |threads: &str| {
        let run_with = |args: String| {
            let mut command = command(folder.path(), args.split_whitespace());
            command.env("RAYON_NUM_THREADS", threads);
            run(command).done();
        };
        run_with(format!("fit sheet.pc2 --mesh base.obj -o {threads}.loom"));
        run_with(format!("sample {threads}.loom -o {threads}.pc2 --frames 9"));
        ["loom", "pc2"]
            .map(|kind| fs::read(folder.path().join(format!("{threads}.{kind}"))).unwrap())
    };
    let (one, two) = (with("1"), with("2"));
    assert!(one == two, "bytes differ");
    assert!(with("2") == two, "bytes differ between runs");
}

#[test]
fn pins_hold_their_frames_and_are_counted() {
    let folder = tempdir().unwrap();
    sheet(4, 13).write_objs(&folder.path().join("sheet"));
    let fit = "fit sheet -o s.loom --json --pin 2=0.5,-0.25 --pin 9=10%,90%";
    let report = meshloom(folder.path(), fit).done().object();
    assert_eq!(report["layout"]["pinned"], 2);
    for wrong in ["2", "2=1", "2=1,x", "two=1,1"] {
        let run = meshloom(folder.path(), &format!("fit sheet -o s.loom --pin {wrong}"));
        assert_eq!(run.code, Some(2), "{wrong}");
    }
}

#[test]
fn real_captures_are_fitted_as_well_as_the_paper_says() {
    let Some(data) = support::real_captures() else {
        return;
    };
    let folder = tempdir().unwrap();
    let horse = data.join("horse-gallop");
    let input = format!(
        "{} --mesh {}",
        horse.join("frames.pc2").display(),
        horse.join("base.obj").display()
    );
    meshloom(folder.path(), &format!("convert {input} -o all.pc2")).done();
    let fit = format!(
        "fit all.pc2 --mesh {} -o horse.loom --json --method ch12 --tolerance 0.02",
        horse.join("base.obj").display()
    );
    let report = meshloom(folder.path(), &fit).done().object();
    assert!(
        report["error"]["total"].as_f64().unwrap() <= 0.02,
        "{report}"
    );
    // Two strides of 24 frames: half of the frames are enough for the map.
    assert!(report["sites"].as_u64().unwrap() <= 24, "{report}");
}

#[test]
fn a_demo_writes_loom_picture_and_in_betweens() {
    let folder = tempdir().unwrap();
    let demos = meshloom(folder.path(), "demo --list --json")
        .done()
        .object();
    let names: Vec<String> = demos["demos"]
        .as_array()
        .unwrap()
        .iter()
        .map(|demo| demo["name"].as_str().unwrap().to_string())
        .collect();
    assert!(
        names.contains(&"bar".to_string())
            && names.len()
                == names
                    .iter()
                    .collect::<std::collections::BTreeSet<_>>()
                    .len()
    );
    let demo = meshloom(folder.path(), "demo bar --write new/place --json")
        .done()
        .object();
    assert_eq!(demo["demo"], "bar");
    assert!(demo["report"]["error"]["total"].as_f64().unwrap() <= 0.01);
    for output in demo["outputs"].as_array().unwrap() {
        assert!(
            folder.path().join(output.as_str().unwrap()).is_file(),
            "{output}"
        );
    }
    let place = folder.path().join("new/place");
    let info = meshloom(&place, "info bar.loom --json").done().object();
    let written = fs::read_dir(place.join("frames")).unwrap().count() as u64;
    assert_eq!(written, 2 * info["frames"].as_u64().unwrap() - 1);
    assert_eq!(demo["frames"].as_u64().unwrap(), written);
    assert_eq!(meshloom(folder.path(), "demo nonsense").code, Some(2));
}

#[test]
fn a_plot_is_png_or_svg_by_its_ending() {
    let folder = tempdir().unwrap();
    sheet(4, 13).write_objs(&folder.path().join("sheet"));
    meshloom(folder.path(), "fit sheet -o s.loom").done();
    for (name, start) in [("a/p.png", &b"\x89PNG"[..]), ("p.svg", b"<svg")] {
        meshloom(
            folder.path(),
            &format!("plot s.loom -o {name} --theme dark"),
        )
        .done();
        let bytes = fs::read(folder.path().join(name)).unwrap();
        assert!(bytes.starts_with(start), "{name}");
    }
    let size = |args: &str| {
        meshloom(folder.path(), &format!("plot s.loom -o p.png {args}")).done();
        let bytes = fs::read(folder.path().join("p.png")).unwrap();
        [16, 20].map(|at: usize| u32::from_be_bytes(bytes[at..at + 4].try_into().unwrap()))
    };
    assert_eq!(size("--size 500x300"), [1000, 600]);
    meshloom(folder.path(), "plot s.loom -o p.jpg").fails_with(&["p.jpg", ".png"]);
    meshloom(folder.path(), "plot s.loom -o s.loom").fails_with(&["s.loom"]);
}

#[test]
fn few_frames_and_no_motion_are_fitted_too() {
    let folder = tempdir().unwrap();
    for frames in 1..=5 {
        let name = format!("s{frames}");
        sheet(4, frames).write_objs(&folder.path().join(&name));
        meshloom(folder.path(), &format!("fit {name} -o {name}.loom")).done();
        let compare = format!("compare {name} {name}.loom --json");
        let found = meshloom(folder.path(), &compare).done().object();
        assert!(found["max"].as_f64().unwrap() < 0.1, "{frames}: {found}");
        meshloom(folder.path(), &format!("plot {name}.loom -o {name}.png")).done();
    }
    let mut still = sheet(4, 1);
    still.frames = vec![still.frames[0].clone(); 6];
    still.write_objs(&folder.path().join("still"));
    let fit = meshloom(folder.path(), "fit still -o still.loom --json")
        .done()
        .object();
    assert_eq!(fit["error"]["total"], 0.0);
    let found = meshloom(folder.path(), "compare still still.loom --json")
        .done()
        .object();
    assert!(found["max"].as_f64().unwrap() < 1e-6);
    // Against frames that move, an error relative to no motion has no number.
    sheet(4, 6).write_objs(&folder.path().join("moving"));
    let found = meshloom(folder.path(), "compare still moving --json").done();
    assert!(found.object()["kg_percent"].is_null());
    assert!(found.stderr.contains("not defined"), "{}", found.stderr);
}

#[test]
fn a_gltf_animation_is_a_capture() {
    let Some(data) = support::real_captures() else {
        return;
    };
    let folder = tempdir().unwrap();
    let fox = data.join("fox/Fox.glb");
    // Three animations: the choice is said.
    let run = meshloom(folder.path(), &format!("info {}", fox.display())).done();
    for name in ["Survey", "Walk", "Run"] {
        assert!(run.stderr.contains(name), "{}", run.stderr);
    }
    let info = format!("info {}#Walk --json", fox.display());
    let walk = meshloom(folder.path(), &info).done().object();
    assert_eq!(
        (walk["format"].as_str(), walk["closed"].as_bool()),
        (Some("glTF"), Some(true))
    );
    meshloom(
        folder.path(),
        &format!("fit {}#Walk -o walk.loom", fox.display()),
    )
    .done();
}
