//! `embrasure render`: renders a scene, writes checkpoints, previews and pictures, and returns the
//! exit code.

use super::args::RenderArgs;
use super::audit::{AuditReport, other_backend};
use super::camera_files::{prepare_cameras, write_camera};
use super::checkpointer::Checkpointer;
use super::clock::Clock;
use super::dump::write_scene;
use super::error::{CliError, INTERRUPTED};
use super::job::Job;
use super::outputs::{Images, Outputs, images_of_render};
use super::picture_warnings::{
    cut_warning, doubtful_warning, dropped_warning, idle_aov, is_dim, metered_stops, narrow_picture, negative_lobes,
    panorama_shape, spikes_warning, unusual_exposure,
};
use super::pixel;
use super::printing;
use super::progress::{InterruptGuard, LoadingBar, Progress, TimedProgress, interrupted_for, is_interrupted};
use super::stats::{Chains, DenoiseStats, DroppedSampleEntry, NoiseOfRender, Rays, Stats, StatsOutput, peak_rss_bytes};
use super::stop::Stop;
use super::summary::{self, print_camera, print_choices, print_picture};
use super::tev::Preview;
use crate::accel::{Auditor, BackendInfo};
use crate::color::Exposure;
use crate::files::{guarded, in_words};
use crate::film::{Image, Spikes, metered};
use crate::io::{FileError, Format, LoadObserver, Metadata, Warning};
use crate::render::{Observer, Outcome};
use crate::session::{BUILD, RenderState, Renderer, Session, Unfinished};
use std::path::PathBuf;
use std::process::ExitCode;
use std::time::{Duration, Instant};

/// Renders with the arguments, and writes the images.
pub(super) fn render(args: &RenderArgs) -> Result<ExitCode, CliError> {
    let start = Instant::now();
    if args.quiet {
        printing::hide_notes();
    }
    let mut job = Job::to_show(args)?;
    // Check first that all files can be written.
    let mut outputs = Outputs::default();
    let stats = args.stats.as_deref();
    let mut files = RenderFiles {
        images: images_of_render(args, &job, &[], &mut outputs)?.0,
        stats: stats.map(|path| StatsOutput::prepare(path, &mut outputs)).transpose()?,
        write_every: args.write_every,
    };
    let [dump, checkpoint] = [&args.dump_scene, &args.checkpoint].map(Option::as_deref);
    let dump = dump.map(|path| outputs.prepare("--dump-scene", path)).transpose()?;
    let checkpoint = checkpoint
        .map(|path| outputs.prepare("--checkpoint", path))
        .transpose()?;
    if let Some(path) = &args.write_cameras {
        prepare_cameras(path, &mut outputs)?;
    }
    outputs.refuse_inputs([&*args.scene].into_iter().chain(args.cameras.as_deref()))?;
    let other = args
        .audit_rays
        .map(|_| other_backend(job.settings.backend, None))
        .transpose()?;
    let checkpointer = Checkpointer::new(args, checkpoint)?;
    let preview = Preview::new(args)?;
    let loading = LoadingBar::new(job.quiet);
    loading.begin("reading the scene", 1);
    let session = Session::load(&job.scene, job.settings.clone(), &loading);
    loading.finish();
    let session = session?;
    let elevation = job.settings.camera.elevation;
    // Take the image size from the session, because the size of a drawing to scale is computed from
    // the scene.
    job.settings.resolution = session.settings().resolution;
    // The exposure may depend on the light, which is known now.
    job.settings.tone = session.settings().tone;
    files.images.show(job.settings.tone);
    // Default names avoid the scene's files, which are known now.
    let mut renamed = None;
    if args.output.is_empty() && !job.scene.is_file() {
        outputs.remove("-o");
        (files.images, renamed) = images_of_render(args, &job, session.files(), &mut outputs)?;
    }
    outputs.refuse_inputs(session.files().iter().map(PathBuf::as_path))?;
    if job.verbose {
        errln!("memory: a maximum of about {}", in_words(session.memory()));
        print_camera(&session);
    }
    let of_flags = [
        &job.warnings[..],
        renamed.map(|words| Warning::new("renamed-output", words)).as_slice(),
        idle_aov(args, &files.images).as_slice(),
        narrow_picture(&job.settings).as_slice(),
        panorama_shape(&session).as_slice(),
        negative_lobes(&job.settings).as_slice(),
    ]
    .concat();
    job.shown_warnings.show_each(&of_flags);
    job.shown_warnings.show(session.warnings(), &job.scene_path);
    let mut warnings = [&of_flags, session.warnings()].concat();
    if !job.quiet {
        if let Some(elevation) = elevation {
            errln!("camera: {}", session.words_of(elevation));
        }
        print_choices(&session);
        if !job.scene.is_file() && job.pixel.is_none() {
            print_picture(&session);
        }
    }
    if let Some(words) = printing::panes(session.scene().panes()).filter(|_| !job.quiet) {
        errln!("Glass: {words}");
    }
    dump.map_or(Ok(()), |output| write_scene(&output, &job, &session))?;
    if let Some(path) = &args.write_cameras {
        write_camera(path, &files.images, &job, &session)?;
    }
    let load_s = start.elapsed().as_secs_f64() - session.guess_seconds();
    loading.begin("building the acceleration structure", 1);
    let renderer = session.renderer();
    loading.finish();
    let renderer = renderer?;
    let of_camera = renderer.camera_warning(&job.scene_path);
    job.shown_warnings.show(of_camera.as_slice(), &job.scene_path);
    warnings.extend(of_camera);
    let run = |renderer: &Renderer, audit: &dyn Fn() -> Option<AuditReport>| {
        let run = RenderInputs {
            job: &job,
            files: &files,
            renderer,
            start,
            load_s,
        };
        match job.pixel {
            Some((pixel, sample)) => pixel::trace(renderer, pixel, sample, args.json),
            None => run.render(checkpointer, preview, &mut warnings, audit),
        }
    };

    // Let another backend trace a fraction of the rays too, if the user requests it
    // (`--audit-rays`).
    let (Some(share), Some(other)) = (args.audit_rays, other) else {
        return run(&renderer, &|| None);
    };
    let other = other.build(session.scene(), session.pool())?;
    let accels = [renderer.accel().as_dyn(), other.as_dyn()];
    let auditor = Auditor::new(session.scene(), accels, share);
    run(
        &Renderer::audited(&session, &auditor, renderer.build_seconds()),
        &|| {
            let name = job.scene_path.display().to_string();
            Some(AuditReport::new(name, &session, accels, &auditor.findings()))
        },
    )
}

/// Maximum time of denoising after an interrupt.
const DENOISING_AT_END: Duration = Duration::from_millis(500);

/// Files that a render writes.
struct RenderFiles {
    images: Images,
    stats: Option<StatsOutput>,
    /// Interval in seconds at which images are written during the render.
    write_every: Option<f64>,
}

/// Inputs of a render.
struct RenderInputs<'a> {
    job: &'a Job,
    files: &'a RenderFiles,
    renderer: &'a Renderer<'a>,
    start: Instant,
    load_s: f64,
}

/// Measurements after the last sample.
#[derive(Default)]
struct RenderResults {
    denoised: Option<DenoiseStats>,
    write_s: f64,
}

impl RenderInputs<'_> {
    /// Renders and writes all files. If rays are audited, `audit` returns the report about the
    /// backend. It is called after the render.
    fn render(
        &self,
        mut checkpointer: Option<Checkpointer>,
        mut preview: Preview,
        warnings: &mut Vec<Warning>,
        audit: &dyn Fn() -> Option<AuditReport>,
    ) -> Result<ExitCode, CliError> {
        let job = self.job;
        let restored = checkpointer
            .as_mut()
            .map(|checkpointer| checkpointer.restore(self.renderer))
            .transpose()?;
        let mut state = restored.flatten().unwrap_or_else(|| self.renderer.start());
        // Handle interrupts until all files are written
        let _interrupts = InterruptGuard::begin();
        warn_of(preview.open(&state.film).as_slice());
        let stop = self.take_samples(&mut state, checkpointer.as_ref(), &mut preview);

        let is_empty_told = warnings.iter().any(|warning| warning.kind == "empty-view");
        // Print a warning about the result, and store it
        let mut warn = |warning: String| {
            let warning = Warning::new("render", warning);
            job.shown_warnings.show_each(std::slice::from_ref(&warning));
            warnings.push(warning);
        };
        if state.statistics.dropped > 0 {
            warn(dropped_warning(&state.statistics));
        }
        if state.statistics.rays.cut > 0 {
            warn(cut_warning(state.statistics.rays.cut));
        }
        if let Some(warning) = self.renderer.doubtful_records().and_then(doubtful_warning) {
            warn(warning);
        }
        if let Some(chains) = Chains::new(state.statistics.chains) {
            chains.warning().into_iter().for_each(&mut warn);
            Spikes::of(&state.film)
                .map(spikes_warning)
                .into_iter()
                .for_each(&mut warn);
        }
        let noise = job.settings.noise.map(|level| NoiseOfRender::new(&state.film, level));
        if let Some(noise) = noise.filter(|n| stop.is_complete() && !n.is_reached()) {
            warn(noise.warning(state.seconds));
        }
        let audit = audit();
        if let Some(report) = &audit {
            if report.is_wrong() {
                warn(format!("the backends disagree: {}", report.text().trim_end()));
            } else if !job.quiet {
                err!("{}", report.text());
            }
        }

        // Without samples nothing is written, and existing files are kept.
        let (mut failures, mut results, mut exposure) = (Vec::new(), RenderResults::default(), None);
        if !state.is_empty() {
            let image = self.write(&state, stop, checkpointer.as_ref(), (&mut failures, &mut results));
            let of_look;
            (exposure, of_look) = self.inspect_look(&image, is_empty_told);
            of_look.into_iter().for_each(&mut warn);
            if let Some(lost) = preview.finish(&image) {
                warn(lost.to_string());
            }
        }

        let info = self.renderer.backend();
        let stats = Stats {
            exposure,
            noise,
            denoise: results.denoised,
            write_s: results.write_s,
            audit,
            warnings: warnings.iter().map(|warning| warning.text.as_str()).collect(),
            ..self.stats(&state, stop, &info)
        };
        if let Some(output) = &self.files.stats {
            let json = serde_json::to_string_pretty(&stats).map_err(|e| CliError::Failed(e.to_string()))?;
            failures.extend(output.write(&json).err().iter().map(FileError::to_string));
        }
        if state.is_empty() {
            return Err(self.nothing_written(failures, stop));
        }
        if !job.quiet {
            summary::print(job, &self.files.images, &stats, stop);
            let guess = self.renderer.session().camera_guess();
            job.shown_warnings.note_doubt_about_up(guess);
        }
        finish(failures, stop, checkpointer.is_some())
    }

    /// Exposure of PNG files in stops, and warnings about a picture that shows little. The exposure
    /// is `None` if the picture is black. If `is_empty_told`, a warning already says that the
    /// picture shows no surface.
    fn inspect_look(&self, image: &Image, is_empty_told: bool) -> (Option<f32>, Vec<String>) {
        let (job, tone) = (self.job, self.job.settings.tone);
        let mut images = self.files.images.iter();
        let has_png = images.any(|(format, _)| matches!(format, Format::Png(_)));
        let darkness = self.renderer.darkness(image);
        let exposure = match darkness {
            Some(_) => None,
            None => metered(tone, image).exposure.stops(),
        };
        // Metering takes time, so a picture is metered once, and only for PNG files.
        let usual = match tone.exposure {
            Exposure::Auto => exposure,
            _ if has_png => metered_stops(tone, image),
            _ => None,
        };
        let mut warnings = Vec::new();
        if darkness.is_some() || usual.is_some_and(is_dim) {
            let of_lamps = self.renderer.warnings_of_lamps(&job.scene_path);
            warnings.extend(of_lamps.into_iter().map(|warning| warning.text));
        }
        if let Some(darkness) = darkness {
            warnings.push(format!(
                "the picture is {darkness}\n  help: `embrasure check {}` may find more, and `embrasure help black` lists causes",
                job.scene_path.display()
            ));
            return (exposure, warnings);
        }
        if let Some((chosen, usual)) = exposure.zip(usual).filter(|_| has_png) {
            warnings.extend(unusual_exposure(chosen, usual, job.options.tone.exposure.is_some()));
        }
        let reason = self.renderer.reason_for_emptiness().filter(|_| !is_empty_told);
        warnings.extend(reason.map(|reason| format!("the picture shows nothing: {reason}")));
        (exposure, warnings)
    }

    /// Writes all results of `state`, and returns its image. Every output is tried, so that a full
    /// disk does not lose the other pictures.
    fn write(
        &self,
        state: &RenderState,
        stop: Stop,
        checkpointer: Option<&Checkpointer>,
        (failures, results): (&mut Vec<String>, &mut RenderResults),
    ) -> Image {
        let mut metadata = self.renderer.metadata(state, stop.is_complete());
        let kept = checkpointer.map(|checkpointer| checkpointer.keep(state, &metadata));
        let is_kept = matches!(kept, Some(Ok(())));
        failures.extend(kept.and_then(Result::err).iter().map(FileError::to_string));
        let start = Instant::now();
        let image = self.develop(state, failures);
        // If denoising fails or is interrupted, the raw picture is still written.
        let done = self
            .renderer
            .denoise_unless(image, &mut metadata, &interrupted_for(DENOISING_AT_END));
        let image = done.unwrap_or_else(|unfinished| {
            match unfinished {
                Unfinished::Failed(error) => failures.push(error.to_string()),
                Unfinished::Cancelled => {
                    printing::warning("interrupted: denoising was cancelled, and the pictures are not denoised")
                }
            }
            self.develop(state, failures)
        });
        metadata.note_exposure(self.job.settings.tone, &image);
        results.denoised = metadata.denoiser.clone().map(|by| DenoiseStats {
            by,
            seconds: start.elapsed().as_secs_f64(),
        });
        let start = Instant::now();
        let images = &self.files.images;
        let before: Vec<_> = images.iter().map(|(_, output)| output.id()).collect();
        let unwritten = self.write_images(state, &image, &metadata);
        failures.extend(unwritten.iter().map(FileError::to_string));
        results.write_s = start.elapsed().as_secs_f64();
        // If `output.id()` has changed, the EXR file was replaced. The new file is complete, even
        // if later writes have failed.
        let mut files = images.iter().zip(&before);
        let has_floats =
            files.any(|((format, output), before)| matches!(format, Format::Exr(_)) && output.id() != *before);
        if !unwritten.is_empty() && !is_kept && !has_floats {
            match self.renderer.rescue(state, images, &metadata) {
                Some(Ok(rescued)) => {
                    let name = rescued.path().display();
                    printing::warning(format_args!(
                        "the picture and its samples are saved in {name}\n  help: repeat this command with --checkpoint {name} --resume to write the files"
                    ));
                }
                Some(Err(error)) => failures.push(error.to_string()),
                None => {}
            }
        }
        image
    }

    /// Writes `image`, the picture of `state`, to all image files, and returns the errors.
    fn write_images(&self, state: &RenderState, image: &Image, metadata: &Metadata) -> Vec<FileError> {
        let images = &self.files.images;
        let mut failures = self.renderer.write(state, image, images.whole(), metadata);
        failures.extend(images.write_faces(image, metadata));
        failures
    }

    /// The picture of `state`. If making the additional channels panics, the picture has only the
    /// usual channels.
    fn develop(&self, state: &RenderState, failures: &mut Vec<String>) -> Image {
        guarded(|| self.renderer.develop(state)).unwrap_or_else(|panic| {
            failures.push(fault("the picture has only the usual channels", &panic));
            state.film.develop()
        })
    }

    /// Error for a render that ended by `stop` before its first sample. The error also has the
    /// texts of all `failures`.
    fn nothing_written(&self, mut failures: Vec<String>, stop: Stop) -> CliError {
        let came = match stop {
            Stop::Interrupt => "interrupted".into(),
            _ => format!(
                "--time-limit was reached (reading and building took {:.1} s)",
                self.load_s + self.renderer.build_seconds()
            ),
        };
        let words = format!(
            "{came} before the first sample was complete: no picture was written, and existing files were kept"
        );
        if stop == Stop::Interrupt && failures.is_empty() {
            return CliError::Interrupted(words);
        }
        let name = self.job.settings.chosen_integrator().name();
        failures.push(format!(
            "{words}\n  help: allow more time, or render fewer pixels (--size, --crop): {name} needs longer to prepare or to take one sample of all pixels"
        ));
        CliError::of_failures(&failures)
    }

    /// Renders, with pauses to write files and to show pictures.
    fn take_samples(
        &self,
        state: &mut RenderState,
        checkpointer: Option<&Checkpointer>,
        preview: &mut Preview,
    ) -> Stop {
        let (job, settings) = (self.job, &self.job.settings);
        let samples = settings.crop().area() * settings.samples().len() as u64;
        let progress = Progress::to_noise(samples, settings.noise, job.quiet);
        progress.skip(state.film.samples());
        let interval = checkpointer.map(|checkpointer| checkpointer.interval);
        let limit = job.time_limit.and_then(|s| Duration::try_from_secs_f64(s).ok());
        let end = limit.and_then(|limit| self.start.checked_add(limit));
        let mut clock = Clock::new(interval, self.files.write_every, preview.interval, end);
        let stop = loop {
            let timed = TimedProgress {
                progress: &progress,
                end: clock.end(),
                pause: clock.pause(),
            };
            if self.renderer.render(state, &timed) == Outcome::Complete {
                break Stop::of_complete(&state.film, settings.noise);
            } else if progress.should_stop() {
                break Stop::Interrupt;
            } else if clock.is_over() {
                break Stop::TimeLimit;
            }
            let pause = Instant::now();
            let mut failures = self.write_meanwhile(&mut clock, checkpointer, state);
            if clock.preview.is_due() {
                if !state.is_empty() {
                    failures.extend(preview.update(&state.film));
                }
                clock.preview.restart_with(preview.interval);
            }
            progress.suspend(|| warn_of(&failures));
            clock.rest_after(pause.elapsed());
        };
        progress.finish();
        stop
    }

    /// Writes the files that are due, without denoising, if there are samples. Returns the errors.
    fn write_meanwhile(
        &self,
        clock: &mut Clock,
        checkpointer: Option<&Checkpointer>,
        state: &RenderState,
    ) -> Vec<FileError> {
        let mut metadata = self.renderer.metadata(state, false);
        let mut failures = Vec::new();
        if let Some(checkpointer) = checkpointer.filter(|_| clock.checkpoint.is_due()) {
            if !state.is_empty() {
                failures.extend(checkpointer.keep(state, &metadata).err());
            }
            clock.checkpoint.restart();
        }
        if clock.images.is_due() {
            if !state.is_empty() {
                let mut faults = Vec::new();
                let image = self.develop(state, &mut faults);
                faults.iter().for_each(printing::warning);
                metadata.note_exposure(self.job.settings.tone, &image);
                failures.extend(self.write_images(state, &image, &metadata));
            }
            clock.images.restart();
        }
        failures
    }

    /// Values of `--stats` that every render has.
    fn stats<'a>(&'a self, state: &'a RenderState, stop: Stop, info: &'a BackendInfo) -> Stats<'a> {
        let (session, settings) = (self.renderer.session(), &self.job.settings);
        let (scene, statistics) = (session.scene(), &state.statistics);
        let mutations = statistics.mutations.iter();
        Stats {
            version: env!("CARGO_PKG_VERSION"),
            build: BUILD,
            backend: info.name,
            backend_version: &info.version,
            isa: info.isa,
            integrator: settings.chosen_integrator().name(),
            sampler: settings.sampler_name(),
            spp: settings.samples().len() as u32,
            threads: settings.threads,
            width: settings.resolution.x,
            height: settings.resolution.y,
            triangles: scene.triangle_count(),
            lights: scene.lights().len(),
            focus_distance: self.renderer.session().camera_description().parameters.focus_distance,
            load_s: self.load_s,
            guess_s: session.guess_seconds(),
            build_s: self.renderer.build_seconds(),
            render_s: state.seconds,
            write_s: 0.0,
            total_s: self.start.elapsed().as_secs_f64(),
            rays: Rays {
                camera: statistics.rays.camera,
                bounce: statistics.rays.bounce,
                shadow: statistics.rays.shadow,
            },
            samples: statistics.samples,
            complete: stop.is_complete(),
            stop: stop.name(),
            error: state.film.relative_error(),
            scene_hash: session.scene_hash(),
            scene_bytes: scene.bytes(),
            bvh_bytes: self.renderer.accel_bytes(),
            peak_rss_bytes: peak_rss_bytes(),
            cut_walks: statistics.rays.cut,
            dropped_samples: statistics.dropped,
            dropped: statistics.first_dropped.iter().map(DroppedSampleEntry::from).collect(),
            mutations: mutations.map(|(kind, counts)| (&**kind, (*counts).into())).collect(),
            chains: Chains::new(statistics.chains),
            exposure: None,
            noise: None,
            denoise: None,
            audit: None,
            warnings: Vec::new(),
        }
    }
}

/// Warns of failures that do not end the render.
fn warn_of(failures: &[FileError]) {
    for failure in failures {
        printing::warning(format_args!("{failure}; the render continues"));
    }
}

/// Message for a caught panic. `outcome` is the consequence of the panic.
fn fault(outcome: &str, panic: &str) -> String {
    format!("internal error, so {outcome}: {panic}\n  help: please report this, with the command")
}

/// Exit code of a render. `has_checkpoint` is true if the render can be continued.
fn finish(failures: Vec<String>, stop: Stop, has_checkpoint: bool) -> Result<ExitCode, CliError> {
    if !failures.is_empty() {
        return Err(CliError::of_failures(&failures));
    }
    // An interrupt after the last sample counts too, because it may have cancelled work such as
    // denoising.
    if is_interrupted() && stop != Stop::Interrupt {
        return Ok(ExitCode::from(INTERRUPTED));
    }
    if stop == Stop::Interrupt {
        let how = if has_checkpoint {
            "--resume continues the render"
        } else {
            "a render with --checkpoint FILE can be continued by --resume"
        };
        errln!("interrupted: the files hold the samples so far; {how}");
        return Ok(ExitCode::from(INTERRUPTED));
    }
    Ok(ExitCode::SUCCESS)
}
