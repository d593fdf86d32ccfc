//! `embrasure view`: what the command line does for the viewer (`crate::view`), which serves the page and renders.

use super::args::{RenderArgs, ViewArgs};
use super::error::CliError;
use super::job::Job;
use super::paths;
use super::progress::{Heeding, Loading, is_interrupted};
use super::summary::print_choices;
use super::warnings::ShownWarnings;
use super::words;
use crate::io::read_exr;
use crate::session::{Renderer, Session};
use crate::view::{Host, Options, SceneChanges, SceneRequest, serve};
use serde_json::Value;
use std::env;
use std::ops::Range;
use std::process::{Command, ExitCode, Stdio};
use std::thread;
use std::time::{Duration, Instant};

/// Serves the render of a scene until an interrupt.
pub(super) fn view(args: &ViewArgs) -> Result<ExitCode, CliError> {
    let render = render_args(args);
    let job = Job::to_show(&render)?;
    job.shown_warnings.show_each(&job.warnings);
    let options = Options {
        listen: args.listen,
        port: args.port,
        exit_when_closed: args.exit_when_closed,
        compare: args.compare.as_deref().map(two_settings).transpose()?,
        reference: args.reference.as_deref().map(read_exr).transpose()?,
    };
    if !args.listen.is_loopback() {
        words::warning(format_args!(
            "--listen {}: anyone who reaches this address and has the link can see and control the render, and can write its camera into the scene file; the link and the pictures are not encrypted\n  help: use ssh -L in place of --listen (`embrasure view --help`)",
            args.listen
        ));
    }
    let loading = Loading::new(args.quiet);
    let session = Session::load(&job.scene, job.settings.clone(), &loading);
    loading.finish();
    let session = session?;
    job.shown_warnings.show(session.warnings(), &job.scene_path);
    if !args.quiet {
        print_choices(&session);
    }
    // Ctrl-C ends the render and the server, and that is how it should end.
    let _heeding = Heeding::begin();
    let commands = Commands { render: &render, args };
    serve(options, &commands, request(job, &render)?, session)?;
    Ok(ExitCode::SUCCESS)
}

/// The two settings of `--compare`.
fn two_settings(text: &str) -> Result<[String; 2], CliError> {
    let settings: Vec<&str> = text.split(',').map(str::trim).collect();
    match settings[..] {
        [first, second] => Ok([first.into(), second.into()]),
        _ => Err(CliError::Usage(format!(
            "--compare {text}: {} in place of two\n  help: write two, such as path,bdpt or path,path+reuse=none",
            words::count(settings.len() as u64, "setting")
        ))),
    }
}

/// What `render` would be told.
fn render_args(args: &ViewArgs) -> RenderArgs {
    RenderArgs {
        scene: args.scene.clone(),
        noise: args.noise,
        size: args.size,
        threads: args.threads,
        quiet: args.quiet,
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

/// What the viewer is to know of a job.
fn request(job: Job, render: &RenderArgs) -> Result<SceneRequest, CliError> {
    Ok(SceneRequest {
        exr: render.exr.format()?,
        file: job.scene,
        path: job.scene_path,
        settings: job.settings,
        options: job.options,
    })
}

/// The command line, as the viewer asks it.
struct Commands<'a> {
    render: &'a RenderArgs,
    args: &'a ViewArgs,
}

impl Host for Commands<'_> {
    fn read(&self, changes: &SceneChanges) -> Result<SceneRequest, String> {
        let mut render = self.render.clone();
        render.load.patches.extend_from_slice(&changes.materials);
        render.load.set.extend_from_slice(&changes.keys);
        let read = || request(Job::to_show(&render)?, &render);
        read().map_err(|error| error.to_string())
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
        /// Samples between two looks at the clock.
        const STEP: usize = 8;
        let start = Instant::now();
        let mut lights = Vec::new();
        for first in samples.clone().step_by(STEP) {
            if start.elapsed() > time || is_interrupted() {
                break;
            }
            let some = first..samples.end.min(first.saturating_add(STEP as u32));
            let traces = paths::traces(renderer, pixel, some).map_err(|error| error.to_string())?;
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
            open(link);
        }
    }
}

/// Whether there is a desktop that a browser could open on.
fn has_display() -> bool {
    let is_set = |name: &str| env::var_os(name).is_some_and(|value| !value.is_empty());
    let is_remote = is_set("SSH_CONNECTION");
    cfg!(target_os = "macos") || ((is_set("DISPLAY") || is_set("WAYLAND_DISPLAY")) && !is_remote)
}

/// Asks the desktop to open `link`; where it does not, the link that was printed is there.
fn open(link: &str) {
    let program = if cfg!(target_os = "macos") { "open" } else { "xdg-open" };
    let started = Command::new(program)
        .arg(link)
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn();
    if let Ok(mut browser) = started {
        // Its end is waited for, so that no dead process is left.
        drop(thread::Builder::new().spawn(move || browser.wait()));
    }
}
