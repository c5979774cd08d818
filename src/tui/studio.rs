//! The loop: events in, the state changes, commands are carried out, the screen is drawn.

use std::io;
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{self, Receiver, RecvTimeoutError, Sender};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

use ratatui::buffer::Buffer;
use ratatui::crossterm::event::{self as keyboard, KeyEventKind};
use ratatui::crossterm::terminal::size;
use ratatui::layout::Rect;

use super::event::{Answer, Command, Event};
use super::graphics::{Answers, Aside, Choice, Painter, Protocol, choose, painter, read_answers};
use super::hands::{Desk, Errand, Reply, Workers};
use super::keys::LateAnswer;
use super::panels::MESH;
use super::screen;
use super::stage;
use super::state::{Content, Same, Scene, Span, State};
use super::terminal;
use super::theme::{Depth, Look};
use super::thumbs::{Newest, start_thumbs};
use super::update::update;
use super::wire::write_cells;
use super::work::{Brush, Mailbox, Wish, start, start_painter};
use crate::diag::{Diagnostic, Result, Warned};
use crate::loom::Loom;
use crate::mesh::{Bounds, FrameSource, Sequence};
use crate::sample::{Sampled, Sampling};
use crate::task::{Cancelled, Observer, Task};

/// Between two frames of playback.
const FRAME: Duration = Duration::from_millis(33);
/// How often a signal is looked for while no key is pressed: within the grace it gives.
const WATCH: Duration = Duration::from_millis(25);
/// When nothing has happened for so long, what moved has come to rest: about as long as a hand needs to
/// answer what the eye sees.
const STILL: Duration = Duration::from_millis(150);
/// Answers of a slow terminal come no later.
const LATEST: Duration = Duration::from_secs(10);

/// What the studio needs of the files. Called on worker threads.
pub trait Files: Send + Sync {
    /// The first frame alone, as fast as it can be had; `None` where opening everything is as fast.
    ///
    /// # Errors
    /// It cannot be read.
    fn first(&self, task: &Task) -> Result<Option<Sequence>>;

    /// Everything.
    ///
    /// # Errors
    /// It cannot be read.
    fn open(&self, task: &Task) -> Result<Warned<Opened>>;

    /// Writes a picture to a PNG file of that name and says where it is.
    ///
    /// # Errors
    /// It cannot be written.
    fn save(&self, name: &str, png: &[u8]) -> Result<PathBuf>;

    /// Writes frames to files and says where they are.
    ///
    /// # Errors
    /// They cannot be written.
    fn export(&self, frames: &dyn FrameSource, task: &Task) -> Result<PathBuf>;
}

/// What a file held.
pub enum Opened {
    /// Frames.
    Capture(Sequence),
    /// A loom.
    Loom(Arc<Loom>),
}

/// How the studio looks.
#[derive(Debug, Clone)]
pub struct Options {
    /// What stands in the status line.
    pub name: String,
    /// How pictures are shown; none: as the terminal says it can.
    pub graphics: Option<Protocol>,
    /// Whether this runs within tmux.
    pub tmux: bool,
    /// Whether colours are wanted.
    pub colour: bool,
    /// Whether the terminal has all colours, not 256.
    pub true_colour: bool,
}

impl Options {
    /// How pictures are shown until the terminal has answered: in characters, which show everywhere.
    fn first_choice(&self) -> Choice {
        let wanted = self.graphics.filter(|wanted| !wanted.has_pixels());
        choose(wanted, &Answers::default(), self.tmux, self.colour)
    }

    /// How many colours there are.
    pub(super) fn depth(&self) -> Depth {
        match (self.colour, self.true_colour) {
            (false, _) => Depth::Mono,
            (true, false) => Depth::Indexed,
            (true, true) => Depth::True,
        }
    }
}

/// Runs the studio until it is quit. `task` is cancelled when the program is to end.
///
/// # Errors
/// There is no terminal, or it is gone; cancellation.
pub fn run(
    options: &Options,
    files: Arc<dyn Files>,
    desk: &Arc<dyn Desk>,
    task: &Task,
) -> Result<()> {
    let screen = size().map_err(lost)?;
    terminal::take().map_err(lost)?;
    let (send, receive) = mpsc::channel();
    let cancel = Task::default();
    // Files are read while the terminal is waited for.
    start_opening(&files, desk, &send, &cancel);
    let choice = options.first_choice();
    let look = Look {
        dark: true,
        depth: options.depth(),
    };
    let mut state = State::new(options.name.clone(), screen, choice.cell, look);
    state.plain_letters = choice.protocol == Protocol::Ascii;
    state.work = Some(("load", 0, 0));
    let mut studio = Studio::new(state, painter(&choice, look), files, desk, send, cancel);
    studio.listen(options.clone(), task);
    let ended = studio.run(&receive, task);
    studio.cancel.cancel();
    studio.hands.cancel();
    studio.forget();
    terminal::restore();
    // The keyboard is somebody else's again.
    thread::sleep(WATCH);
    ended
}

#[expect(clippy::needless_pass_by_value, reason = "as map_err hands it over")]
pub(super) fn lost(error: io::Error) -> Box<Diagnostic> {
    Box::new(Diagnostic::error(format!(
        "the terminal cannot be used: {error}"
    )))
}

/// Whether light text stands out from this background more than dark text.
pub(super) fn is_dark([red, green, blue]: [u8; 3]) -> bool {
    // BT.601, against the middle.
    299 * u32::from(red) + 587 * u32::from(green) + 114 * u32::from(blue) < 128_000
}

struct Studio {
    state: State,
    painter: Box<dyn Painter>,
    /// What the terminal shows.
    shown: Buffer,
    /// Whether it is to be cleared first.
    stale: bool,
    /// Questions about plots, and about the mesh: neither waits for the other.
    mailboxes: [Arc<Mailbox>; 2],
    thumbs: Arc<Newest>,
    files: Arc<dyn Files>,
    hands: Workers,
    events: Sender<Event>,
    /// Ends the work in the background.
    cancel: Task,
    keyboard: Arc<Keyboard>,
    last_tick: Instant,
}

/// Who reads the keyboard: the studio, or a program that it has lent the terminal to.
#[derive(Default)]
struct Keyboard {
    lent: AtomicBool,
    reading: Mutex<()>,
}

impl Keyboard {
    /// Runs `program` while nobody here reads keys.
    fn lend<T>(&self, program: impl FnOnce() -> T) -> T {
        self.lent.store(true, Ordering::SeqCst);
        let reading = self.reading.lock().unwrap_or_else(PoisonError::into_inner);
        let result = program();
        drop(reading);
        self.lent.store(false, Ordering::SeqCst);
        result
    }

    /// The next event of the keyboard, if there is one soon.
    fn read(&self) -> Option<io::Result<keyboard::Event>> {
        if self.lent.load(Ordering::SeqCst) {
            std::thread::sleep(WATCH);
            return None;
        }
        let _reading = self.reading.lock().unwrap_or_else(PoisonError::into_inner);
        match keyboard::poll(WATCH) {
            Ok(false) => None,
            Ok(true) => Some(keyboard::read()),
            Err(error) => Some(Err(error)),
        }
    }
}

impl Studio {
    fn new(
        state: State,
        painter: Box<dyn Painter>,
        files: Arc<dyn Files>,
        desk: &Arc<dyn Desk>,
        events: Sender<Event>,
        cancel: Task,
    ) -> Self {
        let progress = Task::observed(Arc::new(Progress::new(events.clone())));
        let hands = Workers::start(Arc::clone(desk), &events, progress, &cancel);
        Studio {
            shown: Buffer::empty(Rect::ZERO),
            stale: true,
            state,
            painter,
            mailboxes: Default::default(),
            thumbs: Arc::default(),
            files,
            hands,
            events,
            cancel,
            keyboard: Arc::default(),
            last_tick: Instant::now(),
        }
    }

    fn run(&mut self, receive: &Receiver<Event>, task: &Task) -> Result<()> {
        for mailbox in &self.mailboxes {
            start_painter(Arc::clone(mailbox), self.events.clone());
        }
        start_thumbs(Arc::clone(&self.thumbs), self.events.clone());
        self.draw()?;
        loop {
            let Some(event) = self.next(receive)? else {
                return Ok(());
            };
            let mut commands = update(&mut self.state, event);
            // Whatever else has happened meanwhile is drawn once.
            while let Ok(event) = receive.try_recv() {
                commands.extend(update(&mut self.state, event));
            }
            for command in commands {
                if !self.carry_out(command)? {
                    return task.check().map_err(|Cancelled| Cancelled.into());
                }
            }
            self.draw()?;
        }
    }

    /// The next event; a tick while time passes; none when nothing can come any more.
    fn next(&mut self, receive: &Receiver<Event>) -> Result<Option<Event>> {
        if !self.state.playback.playing {
            self.last_tick = Instant::now();
            if !self.state.is_unsettled() {
                return Ok(receive.recv().ok());
            }
            return Ok(match receive.recv_timeout(STILL) {
                Ok(event) => Some(event),
                Err(RecvTimeoutError::Timeout) => Some(Event::Still),
                Err(RecvTimeoutError::Disconnected) => None,
            });
        }
        let wait = FRAME.saturating_sub(self.last_tick.elapsed());
        match receive.recv_timeout(wait) {
            Ok(event) => Ok(Some(event)),
            Err(RecvTimeoutError::Timeout) => {
                let passed = self.last_tick.elapsed();
                self.last_tick = Instant::now();
                Ok(Some(Event::Tick(passed)))
            }
            Err(RecvTimeoutError::Disconnected) => Ok(None),
        }
    }

    /// False at the end.
    fn carry_out(&mut self, command: Command) -> Result<bool> {
        match command {
            Command::Draw {
                panel,
                number,
                wish,
            } => self.mailboxes[usize::from(panel == MESH)].ask(panel, number, wish),
            Command::DrawThumbs(number, wish) => self.thumbs.ask(number, wish),
            Command::SavePicture(name, wish) => self.save_picture(name, wish),
            Command::Export(span) => self.export(span),
            Command::Hands(Errand::Edit) => self.edit()?,
            Command::Hands(errand) => self.hands.carry_out(errand),
            Command::Present(choice) => self.present(&choice)?,
            Command::Redraw => self.stale = true,
            Command::Suspend => {
                terminal::suspend().map_err(lost)?;
                self.stale = true;
            }
            Command::Quit => return Ok(false),
        }
        Ok(true)
    }

    /// Shows pictures in another way.
    fn present(&mut self, choice: &Choice) -> Result<()> {
        self.forget();
        self.painter = painter(choice, self.state.look);
        self.stale = true;
        Ok(())
    }

    /// Lends the terminal to the user's editor.
    fn edit(&mut self) -> Result<()> {
        terminal::restore();
        let edited = self.keyboard.lend(|| self.hands.edit());
        terminal::take().map_err(lost)?;
        self.stale = true;
        if let Ok((columns, rows)) = size() {
            self.state.size = (columns, rows);
        }
        let _ = self
            .events
            .send(Event::Answer(Answer::Hands(Reply::Edited(edited))));
        Ok(())
    }

    /// Sends what has changed since the last time.
    fn draw(&mut self) -> Result<()> {
        let (columns, rows) = self.state.size;
        let area = Rect::new(0, 0, columns, rows);
        let (mut aside, mut next) = (Aside::default(), Buffer::empty(area));
        let mut bytes = Vec::new();
        if self.stale {
            self.shown = Buffer::empty(area);
            self.painter.forget(&mut aside);
            bytes.extend_from_slice(b"\x1b[0m\x1b[2J");
        }
        screen::draw(&self.state, &mut *self.painter, &mut next, &mut aside);
        self.painter.finish(&mut next, &mut aside);
        let changes = self.shown.diff(&next);
        if changes.is_empty() && !self.stale && aside == Aside::default() {
            return Ok(());
        }
        bytes.extend(aside.before);
        bytes.extend(write_cells(&changes, self.shown.area.width));
        (self.shown, self.stale) = (next, false);
        terminal::send(&bytes).map_err(lost)
    }

    /// Pictures leave the terminal.
    fn forget(&mut self) {
        let mut aside = Aside::default();
        self.painter.forget(&mut aside);
        // A terminal that is gone shows none.
        let _ = terminal::send(&aside.before);
    }

    /// What the terminal answers, keys, mouse, sizes and signals become events.
    fn listen(&self, options: Options, task: &Task) {
        let (events, task, ended) = (self.events.clone(), task.clone(), self.cancel.clone());
        let board = Arc::clone(&self.keyboard);
        start("keyboard", move || {
            let mut interview = Interview::new(options);
            let (answers, typed) = terminal::ask_while_typed_at(interview.options.tmux);
            interview.hear(answers, &events);
            for event in typed.into_iter().filter_map(|event| heard(&event)) {
                let _ = events.send(event);
            }
            let (begin, mut late) = (Instant::now(), LateAnswer::default());
            loop {
                if ended.cancelled() {
                    return;
                }
                if task.cancelled() {
                    let _ = events.send(Event::Signal);
                    return;
                }
                let Some(event) = board.read() else { continue };
                if let Ok(keyboard::Event::Key(key)) = &event
                    && begin.elapsed() < LATEST
                    && late.takes(*key)
                {
                    if let Some(answer) = late.answer() {
                        interview.hear_late(&answer, &events);
                    }
                    continue;
                }
                let event = event.map_or(Some(Event::Signal), |event| heard(&event));
                if event.is_some_and(|event| events.send(event).is_err()) {
                    return;
                }
            }
        });
    }

    fn save_picture(&self, name: String, wish: Wish) {
        let (files, events) = (Arc::clone(&self.files), self.events.clone());
        start("picture", move || {
            let image = Brush::default().paint(&wish).image;
            let png = image
                .png()
                .map_err(|error| Diagnostic::error(format!("no picture: {error}")).into());
            let saved = png.and_then(|png| files.save(&name, &png));
            let answer = saved.map_or_else(Answer::NotSaved, Answer::Saved);
            let _ = events.send(Event::Answer(answer));
        });
    }

    fn export(&self, span: Span) {
        let (files, events) = (Arc::clone(&self.files), self.events.clone());
        let cancel = self.cancel.clone();
        let Some(frames) = shown_frames(&self.state.content, span) else {
            return;
        };
        start("export", move || {
            let progress = Arc::new(Progress::new(events.clone()));
            let task = Task::observed(progress).with_flag(cancel.flag());
            let saved = frames.and_then(|frames| files.export(&*frames, &task));
            let answer = saved.map_or_else(Answer::NotSaved, Answer::Saved);
            let _ = events.send(Event::Answer(answer));
        });
    }
}

/// What the keyboard says, as far as it is listened to.
fn heard(event: &keyboard::Event) -> Option<Event> {
    match *event {
        keyboard::Event::Key(key) if key.kind != KeyEventKind::Release => Some(Event::Key(key)),
        keyboard::Event::Mouse(mouse) => Some(Event::Mouse(mouse)),
        keyboard::Event::Resize(columns, rows) => Some(Event::Resize(columns, rows)),
        _ => None,
    }
}

/// What the terminal has answered so far, and what was made of it.
struct Interview {
    options: Options,
    answers: Answers,
    /// The choice that is in force, and whether the background is dark.
    told: (Choice, bool),
}

impl Interview {
    fn new(options: Options) -> Self {
        Interview {
            told: (options.first_choice(), true),
            answers: Answers::default(),
            options,
        }
    }

    /// Tells the studio if it is to look otherwise.
    fn hear(&mut self, answers: Answers, events: &Sender<Event>) {
        let Options {
            graphics,
            tmux,
            colour,
            ..
        } = self.options;
        let choice = choose(graphics, &answers, tmux, colour);
        let dark = answers.background.is_none_or(is_dark);
        self.answers = answers;
        let same = (self.told.0.protocol, self.told.0.cell, self.told.1)
            == (choice.protocol, choice.cell, dark);
        if !same {
            self.told = (choice.clone(), dark);
            let answer = Answer::Terminal(Box::new(choice), dark);
            let _ = events.send(Event::Answer(answer));
        }
    }

    /// An answer that came among the keys.
    fn hear_late(&mut self, answer: &str, events: &Sender<Event>) {
        let mut bytes = std::mem::take(&mut self.answers.bytes);
        bytes.extend_from_slice(answer.as_bytes());
        let cell = self.answers.cell;
        let mut answers = read_answers(&bytes);
        answers.cell = answers.cell.or(cell);
        self.hear(answers, events);
    }
}

/// Reads and fits in the background.
fn start_opening(
    files: &Arc<dyn Files>,
    desk: &Arc<dyn Desk>,
    events: &Sender<Event>,
    cancel: &Task,
) {
    let (files, events) = (Arc::clone(files), events.clone());
    let (desk, cancel) = (Arc::clone(desk), cancel.clone());
    start("opening", move || {
        let progress = Arc::new(Progress::new(events.clone()));
        let task = Task::observed(progress).with_flag(cancel.flag());
        if let Err(error) = open(&*files, &*desk, &events, &task) {
            let _ = events.send(Event::Answer(Answer::Failed(error)));
        }
    });
}

/// The frames between two times, if there are any.
fn shown_frames(content: &Content, span: Span) -> Option<Result<Box<dyn FrameSource>>> {
    match content {
        Content::Nothing | Content::FirstFrame(_) => None,
        Content::Capture(scene) => Some(Ok(within(scene, span))),
        Content::Loom(scene, _) => {
            let loom = &scene.of.0;
            let count = (span.to - span.from + 1e-9) as usize;
            let times = (0..=count).map(|i| span.from + i as f64).collect();
            let sampling = Sampling {
                times,
                fps: loom.fps(),
            };
            Some(Ok(Box::new(Sampled::new(Loom::clone(loom), sampling))))
        }
        Content::Keys(keys) => Some(Ok(within(keys.frames.as_ref()?, span))),
        Content::Poses(poses) => Some(Ok(within(&poses.poses, span))),
    }
}

/// The frames of a span.
fn within(scene: &Scene<Sequence>, span: Span) -> Box<dyn FrameSource> {
    let first = span.from.ceil() as usize - 1;
    let last = (span.to.floor() as usize).clamp(first + 1, scene.of.0.frames());
    Box::new(scene.of.0.slice(first..last))
}

/// First frame, all frames, what the recipe makes of them: each is shown as soon as it is there.
fn open(files: &dyn Files, desk: &dyn Desk, events: &Sender<Event>, task: &Task) -> Result<()> {
    let say = |answer| {
        let _ = events.send(Event::Answer(answer));
    };
    let show = |content, warnings| say(Answer::Opened(Box::new(content), warnings));
    let (recipe, saved) = desk.recipe()?;
    say(Answer::Hands(Reply::Found(recipe, saved, desk.kept())));
    // What is wrong with the first frame is said again, with its place, by opening everything.
    if let Ok(Some(first)) = files.first(task)
        && let Some(bounds) = Bounds::of(first.frame(0))
    {
        let scene = Scene {
            of: Same::new(first),
            bounds,
        };
        show(Content::FirstFrame(scene), Vec::new());
    }
    let mut warnings = Vec::new();
    match files.open(task)?.unpack(&mut warnings) {
        Opened::Loom(loom) => show(stage::loom(loom)?, warnings),
        Opened::Capture(sequence) => {
            if let Some(recipe) = desk.suited(&sequence) {
                say(Answer::Hands(Reply::Found(recipe, false, desk.kept())));
            }
            if let Some(content) = stage::frames(sequence)? {
                show(content, warnings);
            }
        }
    }
    say(Answer::Hands(Reply::Ready));
    Ok(())
}

/// Tells the studio how far the work has come, not oftener than it can be seen.
struct Progress {
    events: Sender<Event>,
    now: std::sync::Mutex<(&'static str, usize, usize, Instant)>,
}

impl Progress {
    fn new(events: Sender<Event>) -> Self {
        let now = std::sync::Mutex::new(("", 0, 0, Instant::now()));
        Progress { events, now }
    }

    fn tell(&self, phase: &'static str, done: usize, steps: usize) {
        let answer = Answer::Progress(phase, done, steps);
        let _ = self.events.send(Event::Answer(answer));
    }
}

impl Observer for Progress {
    fn phase(&self, name: &'static str, steps: usize) {
        if let Ok(mut now) = self.now.lock() {
            *now = (name, 0, steps, Instant::now());
        }
        self.tell(name, 0, steps);
    }

    fn step(&self) {
        let Ok(mut now) = self.now.lock() else { return };
        now.1 += 1;
        if now.3.elapsed() >= Duration::from_millis(100) {
            now.3 = Instant::now();
            self.tell(now.0, now.1, now.2);
        }
    }
}
