//! `meshloom open INPUT`: the studio.

use std::io::{self, IsTerminal};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::args::{Input, positive};
use super::desk::{self, RecipeDesk};
use super::recipes;
use super::runs::Runs;
use super::session::{Outcome, Session};
use crate::demo::{Demo, Kind};
use crate::diag::{Diagnostic, Result, Warned};
use crate::io::Disk;
use crate::mesh::{FrameSource, Sequence};
use crate::pipeline::{self, Content, FrameRange, Frames, InputSpec, Output};
use crate::recipe::{self, Recipe, Request};
use crate::task::Task;
use crate::tui::{self, Files, Opened, Options, Protocol};
use crate::world::World;

/// Look at a capture or a loom in the terminal
///
/// The capture is shown while it is read, then fitted in the background; a loom is shown at once. Poses that
/// are no motion become the keys of one, or are shown by their principal components. The keys are listed by ?.
#[derive(Debug, clap::Args)]
pub(super) struct Args {
    #[command(flatten)]
    input: Input,

    /// Frames a second, if the capture does not say or says wrong
    #[arg(long, value_name = "RATE", value_parser = positive)]
    fps: Option<f64>,

    /// What is made of it: a recipe, run again whenever it is saved; gestures become lines of it
    /// [default: the fit, written beside the capture with the first gesture]
    #[arg(long, value_name = "RECIPE")]
    recipe: Option<PathBuf>,

    /// How pictures are shown: kitty, iterm2, sixel, blocks, braille, ascii [default: as the terminal says it can]
    #[arg(long, value_name = "HOW", value_parser = protocol)]
    graphics: Option<Protocol>,
}

fn protocol(name: &str) -> Result<Protocol, String> {
    let known = Protocol::ALL.map(Protocol::name).join(", ");
    let found = Protocol::ALL
        .into_iter()
        .find(|protocol| protocol.name() == name);
    found.ok_or(format!("there are {known}"))
}

pub(super) fn run(args: &Args, session: &Session) -> Result<Outcome> {
    refuse_pipes()?;
    let spec = args.input.part.of(&args.input.inputs, args.fps);
    let name = title(&args.input.inputs);
    let runs = Arc::new(Runs::new());
    let loom = spec.paths.len() == 1 && pipeline::is_loom(&spec.paths[0]);
    let recipe = match &args.recipe {
        Some(path) => recipes::find(session.world(), path)?,
        None => desk::beginning(&spec.paths, loom),
    };
    let request = request(recipe::Input::Files(spec.clone()));
    let desk = RecipeDesk::on(Arc::clone(&runs), request, recipe, args.fps);
    let source = Source::Disk(spec);
    let shown = Shown { source, name, runs };
    studio(shown, desk, args.graphics, session)
}

/// What runs in the studio are given. What a recipe saves is written by `meshloom run` alone, but has to
/// have a place.
fn request(input: recipe::Input) -> Request {
    Request {
        input: Some(input),
        output: Some(PathBuf::from("meshloom-out")),
        ..Request::default()
    }
}

/// The studio on a built-in capture.
pub(super) fn demo(demo: &'static Demo, session: &Session) -> Result<Outcome> {
    let name = demo.name.to_string();
    let root = if demo.travels {
        ", #{ root: \"ground\" }"
    } else {
        ""
    };
    let recipe = Recipe {
        path: PathBuf::from(format!("{name}.rhai")),
        text: match demo.kind {
            Kind::Motion => format!("fit(demo({name:?}){root})\n"),
            Kind::Poses => format!("complete(demo({name:?}))\n"),
        },
    };
    let runs = Arc::new(Runs::new());
    let request = request(recipe::Input::Demo(name.clone()));
    let desk = RecipeDesk::on(Arc::clone(&runs), request, recipe, None);
    let source = Source::Demo(demo);
    let shown = Shown { source, name, runs };
    studio(shown, desk, None, session)
}

fn studio(
    shown: Shown,
    desk: RecipeDesk,
    graphics: Option<Protocol>,
    session: &Session,
) -> Result<Outcome> {
    let options = options(shown.name.clone(), graphics);
    session.progress.end();
    let desk: Arc<dyn tui::Desk> = Arc::new(desk);
    tui::run(&options, Arc::new(shown), &desk, &session.task)?;
    Ok(Outcome::default())
}

/// The files of a capture that is looked at.
pub(super) fn files(spec: InputSpec, name: String) -> tui::Shown {
    let runs = Arc::new(Runs::new());
    let loom = spec.paths.len() == 1 && pipeline::is_loom(&spec.paths[0]);
    let mut recipe = desk::beginning(&spec.paths, loom);
    if !loom && let Some(name) = recipe.path.file_name() {
        // Not among the captures that land.
        recipe.path = PathBuf::from(name);
    }
    let request = request(recipe::Input::Files(spec.clone()));
    let desk = RecipeDesk::on(Arc::clone(&runs), request, recipe, None);
    let source = Source::Disk(spec);
    (Arc::new(Shown { source, name, runs }), Arc::new(desk))
}

/// Whether there is a keyboard and a screen.
pub(super) fn at_a_terminal() -> bool {
    refuse_pipes().is_ok()
}

/// The studio needs a keyboard and a screen.
pub(super) fn refuse_pipes() -> Result<()> {
    let name = match (io::stdin().is_terminal(), io::stdout().is_terminal()) {
        (true, true) => return Ok(()),
        (false, _) => "stdin",
        (true, false) => "stdout",
    };
    Diagnostic::error(format!("the studio needs a terminal, and {name} is none"))
        .hint("`meshloom fit INPUT -o OUT.loom` and `meshloom plot OUT.loom -o OUT.png` need none")
        .err()
}

fn title(inputs: &[PathBuf]) -> String {
    let name = |path: &Path| {
        path.file_name()
            .unwrap_or(path.as_os_str())
            .to_string_lossy()
            .into_owned()
    };
    inputs.first().map_or_else(String::new, |path| name(path))
}

pub(super) fn options(name: String, graphics: Option<Protocol>) -> Options {
    let variable = |name| std::env::var(name).unwrap_or_default();
    Options {
        name,
        graphics,
        tmux: !variable("TMUX").is_empty(),
        colour: variable("NO_COLOR").is_empty() && variable("TERM") != "dumb",
        true_colour: matches!(variable("COLORTERM").as_str(), "truecolor" | "24bit"),
    }
}

/// What is shown; the working directory takes what is written.
struct Shown {
    source: Source,
    name: String,
    /// What is opened here is open for recipes.
    runs: Arc<Runs>,
}

enum Source {
    Disk(InputSpec),
    Demo(&'static Demo),
}

impl Shown {
    /// The first of `STEM-1ENDING`, `STEM-2ENDING`, .. that is not there yet.
    fn fresh(&self, stem: &str, ending: &str) -> PathBuf {
        let named = |number| PathBuf::from(format!("{stem}-{number}{ending}"));
        let free = |path: &PathBuf| matches!(Disk.identity(path), Ok(None));
        (1..1000)
            .map(named)
            .find(free)
            .unwrap_or_else(|| named(1000))
    }
}

impl Files for Shown {
    fn first(&self, task: &Task) -> Result<Option<Sequence>> {
        let Source::Disk(spec) = &self.source else {
            return Ok(None);
        };
        // A loom has no first frame that could be read alone.
        if spec
            .paths
            .iter()
            .any(|path| path.extension().is_some_and(|ending| ending == "loom"))
        {
            return Ok(None);
        }
        let start = spec.range.and_then(|range| range.first).unwrap_or(1);
        let range = FrameRange {
            first: Some(start),
            last: Some(start),
        };
        let spec = InputSpec {
            range: Some(range),
            ..spec.clone()
        };
        Ok(match pipeline::open(&Disk, &spec, task)?.output.content {
            Content::Sequence(sequence) => Some(sequence),
            Content::Loom(_) => None,
        })
    }

    fn open(&self, task: &Task) -> Result<Warned<Opened>> {
        let bench = self.runs.bench(task);
        let capture = |frames: Frames| Opened::Capture((*frames.value).clone());
        let spec = match &self.source {
            Source::Disk(spec) => spec,
            Source::Demo(demo) => return Ok(bench.demo(demo.name)?.map(capture)),
        };
        let [path] = spec.paths.as_slice() else {
            return Ok(bench.open_frames(spec)?.map(capture));
        };
        if !pipeline::is_loom(path) {
            return Ok(bench.open_frames(spec)?.map(capture));
        }
        if spec.range.is_some() {
            return Diagnostic::error("a range is for captures, and this is a loom")
                .in_file(path)
                .hint("leave --range out, and mark a loop with [ and ]")
                .err();
        }
        let loom = bench.load(path)?.loom.value;
        let loom = match spec.fps {
            Some(fps) => Arc::new(loom.with_fps(Some(fps))?),
            None => loom,
        };
        Ok(Warned::clean(Opened::Loom(loom)))
    }

    fn save(&self, name: &str, png: &[u8]) -> Result<PathBuf> {
        let stem = name.trim_end_matches(".png");
        let path = self.fresh(&format!("{}-{stem}", stem_of(&self.name)), ".png");
        let stage = Disk.stage(&path)?;
        stage.write("picture", png)?;
        stage.commit(&[("picture".to_string(), path.clone())], &[])?;
        Ok(path)
    }

    fn export(&self, frames: &dyn FrameSource, task: &Task) -> Result<PathBuf> {
        let folder = self.fresh(&format!("{}-frames", stem_of(&self.name)), "");
        let inputs = match &self.source {
            Source::Disk(spec) => spec.paths.as_slice(),
            Source::Demo(_) => &[],
        };
        let output = Output::from(folder.join("####.obj")).protecting(inputs);
        pipeline::save(&Disk, frames, &output, task)?;
        Ok(folder)
    }
}

fn stem_of(name: &str) -> &str {
    name.split('.')
        .next()
        .filter(|stem| !stem.is_empty())
        .unwrap_or("meshloom")
}
