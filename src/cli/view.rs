//! `embrasure view`: the part of the viewer that belongs to the command line. `crate::view` serves
//! the page and renders.

use super::args::{LoadArgs, RenderArgs, ViewArgs};
use super::error::CliError;
use super::job::{Job, read_scene, scene_of_text};
use super::paths;
use super::printing;
use super::progress::{InterruptGuard, LoadingBar, is_interrupted, leave, leave_interrupted};
use super::summary::print_choices;
use super::warnings::ShownWarnings;
use crate::io::{LoadObserver, read_exr};
use crate::session::{Error, Renderer, Session};
use crate::view::{FileLight, Host, LightEdit, Options, SavedPart, SceneChanges, SceneRequest, serve};
use serde_json::Value;
use std::env;
#[cfg(unix)]
use std::fs::Permissions;
use std::io::{self, Write};
use std::ops::Range;
#[cfg(unix)]
use std::os::unix::fs::PermissionsExt;
use std::path::Path;
use std::process::{Command, ExitCode, Stdio};
use std::sync::{Mutex, PoisonError};
use std::thread;
use std::time::{Duration, Instant, SystemTime};
use tempfile::NamedTempFile;

/// Serves the render of a scene until an interrupt.
pub(super) fn view(args: &ViewArgs) -> Result<ExitCode, CliError> {
    let started = SystemTime::now();
    let render = render_args(args);
    let (job, lights) = job(&render, &SceneChanges::default())?;
    job.shown_warnings.show_each(&job.warnings);
    let options = Options {
        listen: args.listen,
        port: args.port,
        exit_when_closed: args.exit_when_closed,
        compare: args.compare.as_deref().map(two_settings).transpose()?,
        reference: args.reference.as_deref().map(read_exr).transpose()?,
        started,
    };
    if !args.listen.is_loopback() {
        printing::warning(format_args!(
            "--listen {}: anyone who reaches this address and has the link can see and control the render, and can write its camera, materials and lights into the scene file; the link and the pictures are not encrypted\n  help: use ssh -L in place of --listen, as `embrasure view --help` shows",
            args.listen
        ));
    }
    // Ctrl-C is the normal way to end the render and the server.
    let _interrupts = InterruptGuard::begin();
    let commands = Commands {
        render: &render,
        args,
        redirect: Mutex::new(None),
        shown_warnings: job.shown_warnings,
    };
    let is_busy = serve(options, &commands, request(job, lights, &render)?)?;
    drop(commands);
    if is_busy {
        leave(0);
    }
    Ok(ExitCode::SUCCESS)
}

/// Reports the progress of loading on the terminal and to the page. Ends the program at an
/// interrupt.
struct LoadingReporter<'a> {
    bar: LoadingBar,
    page: &'a dyn LoadObserver,
    commands: &'a Commands<'a>,
}

impl LoadObserver for LoadingReporter<'_> {
    fn begin(&self, what: &str, units: u64) {
        self.commands.leave_if_interrupted();
        self.bar.begin(what, units);
        self.page.begin(what, units);
    }

    fn advance(&self, units: u64) {
        self.commands.leave_if_interrupted();
        self.bar.advance(units);
        self.page.advance(units);
    }
}

/// The two settings of `--compare`.
fn two_settings(text: &str) -> Result<[String; 2], CliError> {
    let settings: Vec<&str> = text.split(',').map(str::trim).collect();
    match settings[..] {
        [first, second] => Ok([first.into(), second.into()]),
        _ => Err(CliError::Usage(format!(
            "--compare {text}: {} in place of two\n  help: write two, such as path,bdpt or path,path+reuse=none",
            printing::count(settings.len() as u64, "setting")
        ))),
    }
}

/// Arguments of the equivalent render.
fn render_args(args: &ViewArgs) -> RenderArgs {
    RenderArgs {
        scene: args.scene.clone(),
        noise: args.noise,
        size: args.size,
        threads: args.threads,
        quiet: args.quiet,
        aov: args.aov.clone(),
        camera: args.camera.clone(),
        sampling: args.sampling,
        quality: args.quality,
        integrator: args.integrator,
        filter: args.filter,
        background: args.background,
        ground: args.ground,
        light: args.light.clone(),
        tone: args.tone,
        exr: args.exr.clone(),
        load: args.load.clone(),
        warnings: ShownWarnings::Summary,
        ..RenderArgs::default()
    }
}

/// The job of `render` after `changes`, and the lights of the scene file.
fn job(render: &RenderArgs, changes: &SceneChanges) -> Result<(Job, Vec<FileLight>), CliError> {
    let mut load = render.load.clone();
    load.set.extend(changes.lights.iter().map(LightEdit::flag));
    load.set.extend_from_slice(&changes.groups);
    let mut scene = read_scene(&render.scene, &load)?;
    for edit in &changes.materials {
        scene.patch_material(&edit.name, &edit.key, &edit.value)?;
    }
    let lights = scene.light.iter().cloned().enumerate();
    let lights = lights.map(|(index, section)| FileLight { index, section });
    let lights = lights.filter(|light| !render.light.replaces(&light.section)).collect();
    Ok((Job::to_show_scene(render, scene)?, lights))
}

/// Checks `text`, the new contents of the scene file, with the flags `args`. If `part` says that
/// only the camera has changed, checks only the camera. Else loads the whole scene.
fn check_text(args: &RenderArgs, text: &str, part: SavedPart) -> Result<(), CliError> {
    let scene = scene_of_text(&args.scene, text, &args.load)?;
    let job = Job::to_show_scene(args, scene)?;
    match part {
        SavedPart::Camera => {
            let checked = job.settings.camera.check(job.settings.resolution);
            checked.map_err(|error| CliError::Failed(error.to_string()))?;
        }
        SavedPart::Changes => drop(Session::load(&job.scene, job.settings, &())?),
    }
    Ok(())
}

/// `args` without flags that change the scene. Flags for reading and finding files are kept.
fn without_changes(args: &RenderArgs) -> RenderArgs {
    RenderArgs {
        scene: args.scene.clone(),
        threads: args.threads,
        load: LoadArgs {
            set: Vec::new(),
            patches: Vec::new(),
            ..args.load.clone()
        },
        ..RenderArgs::default()
    }
}

/// Data of a job for the viewer.
fn request(job: Job, lights: Vec<FileLight>, render: &RenderArgs) -> Result<SceneRequest, CliError> {
    Ok(SceneRequest {
        exr: render.exr.format()?,
        file: job.scene,
        lights,
        path: job.scene_path,
        settings: job.settings,
        options: job.options,
    })
}

/// Implements [`Host`], the functions that the command line provides for the viewer.
struct Commands<'a> {
    render: &'a RenderArgs,
    args: &'a ViewArgs,
    /// File that redirects the browser to the page. It is deleted when the viewer ends.
    redirect: Mutex<Option<NamedTempFile>>,
    shown_warnings: ShownWarnings,
}

impl Commands<'_> {
    fn set_redirect(&self, file: Option<NamedTempFile>) {
        *self.redirect.lock().unwrap_or_else(PoisonError::into_inner) = file;
    }

    /// Ends the program after an interrupt, because loading cannot be stopped in another way.
    fn leave_if_interrupted(&self) {
        if is_interrupted() {
            self.set_redirect(None);
            leave_interrupted();
        }
    }
}

impl Host for Commands<'_> {
    fn load(&self, request: &SceneRequest, observer: &dyn LoadObserver) -> Result<Session, Error> {
        let reading = LoadingReporter {
            bar: LoadingBar::new(self.args.quiet),
            page: observer,
            commands: self,
        };
        let session = Session::load(&request.file, request.settings.clone(), &reading);
        reading.bar.finish();
        let session = session?;
        self.shown_warnings.show(session.warnings(), &request.path);
        if !self.args.quiet {
            print_choices(&session);
        }
        Ok(session)
    }

    fn read(&self, changes: &SceneChanges) -> Result<SceneRequest, String> {
        let read = || {
            let (job, lights) = job(self.render, changes)?;
            request(job, lights, self.render)
        };
        read().map_err(|error: CliError| error.to_string())
    }

    fn check(&self, text: &str, before: &str, part: SavedPart) -> Result<(), String> {
        let plain = without_changes(self.render);
        let Err(error) = check_text(&plain, text, part) else {
            return Ok(());
        };
        let needs_flags = check_text(&plain, before, part).is_err();
        if needs_flags {
            check_text(self.render, text, part).map_err(|error| error.to_string())
        } else {
            Err(error.to_string())
        }
    }

    fn inspect(&self, renderer: &Renderer, pixel: [u32; 2], sample: u32) -> Result<Value, String> {
        let traces = paths::traces(renderer, pixel, sample..sample.saturating_add(1));
        let traces = traces.map_err(|error| error.to_string())?;
        Ok(paths::facts(renderer, pixel, &traces))
    }

    fn samples_of(
        &self,
        renderer: &Renderer,
        pixel: [u32; 2],
        samples: Range<u32>,
        time: Duration,
    ) -> Result<Vec<[f32; 3]>, String> {
        let start = Instant::now();
        let mut lights = Vec::new();
        for sample in samples {
            // Check the time before each sample, because a sample may be a whole iteration
            // (photons, chains).
            if start.elapsed() > time || is_interrupted() {
                break;
            }
            let one = sample..sample.saturating_add(1);
            let traces = paths::traces(renderer, pixel, one).map_err(|error| error.to_string())?;
            lights.extend(traces.iter().map(|(_, traces)| paths::light_of(traces).to_array()));
        }
        Ok(lights)
    }

    fn is_interrupted(&self) -> bool {
        is_interrupted()
    }

    fn ready(&self, link: &str) {
        outln!("{link}");
        if !self.args.quiet {
            errln!("Open this link in a browser; Ctrl-C ends the render.");
        }
        if !self.args.no_open && has_display() {
            // If the file cannot be written, the user has the printed link.
            if let Ok(file) = redirect(link) {
                open(file.path());
                self.set_redirect(Some(file));
            }
        }
    }
}

/// Returns true if there is a desktop for a browser.
fn has_display() -> bool {
    let is_set = |name: &str| env::var_os(name).is_some_and(|value| !value.is_empty());
    let is_remote = is_set("SSH_CONNECTION");
    cfg!(target_os = "macos") || ((is_set("DISPLAY") || is_set("WAYLAND_DISPLAY")) && !is_remote)
}

/// Writes a file that redirects a browser to `link`. Only the owner can read the file. The link
/// itself is no argument of the browser, because all users of a machine can read arguments of
/// programs.
fn redirect(link: &str) -> io::Result<NamedTempFile> {
    let mut builder = tempfile::Builder::new();
    builder.prefix("embrasure-").suffix(".html");
    #[cfg(unix)]
    builder.permissions(Permissions::from_mode(0o600));
    let mut file = builder.tempfile()?;
    write!(
        file,
        "<!DOCTYPE html>\n<meta charset=\"utf-8\">\n<title>Embrasure</title>\n<meta http-equiv=\"refresh\" content=\"0; url={link}\">\n<a href=\"{link}\">Open the viewer</a>\n"
    )?;
    file.flush()?;
    Ok(file)
}

/// Opens `file` with the desktop's default program. If that fails, the user has the printed link.
fn open(file: &Path) {
    let program = if cfg!(target_os = "macos") { "open" } else { "xdg-open" };
    let started = Command::new(program)
        .arg(file)
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn();
    if let Ok(mut browser) = started {
        // Wait for the end of the browser, so that no zombie process remains.
        drop(thread::Builder::new().spawn(move || browser.wait()));
    }
}
