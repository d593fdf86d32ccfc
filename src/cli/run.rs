use super::args::RenderArgs;
use super::audit::Report;
use super::backend::{BackendTask, PairTask, both, other_backend};
use super::clock::Clock;
use super::error::{CliError, INTERRUPTED};
use super::job::{Job, name_of};
use super::keeper::{Keeper, Progressed};
use super::pixel;
use super::progress::{Loading, Progress, Until, catch_interrupts};
use super::stats::{Denoised, Dropped, Noise, Rays, Stats, peak_rss_bytes};
use super::tev::Preview;
use super::words;
use crate::accel::{Accel, Auditor, BackendInfo};
use crate::camera::Camera;
use crate::color::Tone;
use crate::denoise::DenoiseError;
use crate::film::{Aov, Film, Image};
use crate::integrator::World;
use crate::io::{FeatureNames, FileError, Format, Loaded, Metadata, Output, in_words, load_scene_watched};
use crate::render::{Observer, Outcome, Statistics};
use crate::scene::Scene;
use std::path::PathBuf;
use std::process::ExitCode;
use std::time::Instant;

/// Renders as the arguments say, and writes the images.
pub(super) fn render(args: &RenderArgs) -> Result<ExitCode, CliError> {
    let start = Instant::now();
    let job = Job::new(args)?;
    let denoiser = job.denoiser_version()?;
    // Files that cannot be written are found before any work.
    let files = Files {
        images: images(args, job.tone)?,
        stats: args.stats.as_deref().map(Output::prepare).transpose()?,
        write_every: args.write_every,
    };
    let keeper = Keeper::new(args)?;
    let preview = Preview::new(args)?;
    let pool = job.thread_pool()?;
    let loading = Loading::new(job.quiet);
    let loaded = pool.install(|| load_scene_watched(&job.scene, job.estimator.scene_builder(), &loading));
    loading.finish();
    let Loaded { scene, mut warnings } = loaded?;
    let (scene, forecast) = job.within_memory(scene)?;
    if job.verbose {
        eprintln!("memory: about {} at most", in_words(forecast));
    }
    let (parameters, camera) = job.camera(scene.bounds())?;
    warnings.extend(job.estimator.check_lights(&scene)?);
    for warning in &warnings {
        words::warning(warning);
    }
    let prepared = Prepared {
        load_s: start.elapsed().as_secs_f64(),
        scene_hash: super::hash::scene_hash(&scene, &parameters),
        job: &job,
        files: &files,
        scene: &scene,
        camera: &camera,
        denoiser,
        start,
        pool: &pool,
    };

    let task = Task {
        prepared: &prepared,
        keeper,
        preview,
        warnings: &mut warnings,
    };
    match args.audit_rays {
        None => job.backend.with(&scene, &pool, task)?,
        Some(share) => {
            let other = other_backend(job.backend, None)?;
            both(job.backend, other, &scene, &pool, Audited { task, share })?
        }
    }
}

/// Renders with the backend that was chosen.
struct Task<'a> {
    prepared: &'a Prepared<'a>,
    keeper: Option<Keeper>,
    preview: Preview,
    warnings: &'a mut Vec<String>,
}

impl BackendTask for Task<'_> {
    type Output = Result<ExitCode, CliError>;

    fn run<A: Accel>(self, accel: &A, build_s: f64) -> Self::Output {
        self.prepared
            .render(accel, build_s, self.keeper, self.preview, self.warnings, || None)
    }
}

/// Renders with the backend that was chosen, and asks another one too for a share of the rays.
struct Audited<'a> {
    task: Task<'a>,
    share: f64,
}

impl PairTask for Audited<'_> {
    type Output = Result<ExitCode, CliError>;

    fn run(self, accels: [&dyn Accel; 2], build_s: f64) -> Self::Output {
        let Task {
            prepared,
            keeper,
            preview,
            warnings,
        } = self.task;
        let auditor = Auditor::new(prepared.scene, accels, self.share);
        prepared.render(&auditor, build_s, keeper, preview, warnings, || {
            let name = prepared.job.scene_path.display().to_string();
            let backends = accels.map(|accel| accel.info());
            let hash = prepared.scene_hash.clone();
            Some(Report::new(name, hash, prepared.scene, backends, &auditor.findings()))
        })
    }
}

/// What a render writes.
struct Files {
    images: Vec<(Format, Output)>,
    stats: Option<Output>,
    /// Seconds after which images are written while the render goes on.
    write_every: Option<f64>,
}

/// A job whose scene is loaded; what is missing is an acceleration structure.
struct Prepared<'a> {
    job: &'a Job,
    files: &'a Files,
    scene: &'a Scene,
    scene_hash: String,
    camera: &'a Camera,
    /// Name and version of what takes out noise.
    denoiser: Option<String>,
    load_s: f64,
    start: Instant,
    pool: &'a rayon::ThreadPool,
}

impl Prepared<'_> {
    /// `audit` says afterwards what was found about the backend, if anything was looked for.
    fn render<A: Accel>(
        &self,
        accel: &A,
        build_s: f64,
        mut keeper: Option<Keeper>,
        mut preview: Preview,
        warnings: &mut Vec<String>,
        audit: impl FnOnce() -> Option<Report>,
    ) -> Result<ExitCode, CliError> {
        let job = self.job;
        let world = World {
            scene: self.scene,
            accel,
            camera: self.camera,
            filter: &job.filter,
            features: job.aovs.iter().any(|aov| aov.is_of_surface()),
        };
        let mut sampler = job.sampler();
        if let Some((pixel, sample)) = job.pixel {
            let key = pixel::key(pixel, sample, job.crop)?;
            pixel::trace(&job.estimator, world, &mut sampler, (job.resolution, key));
            return Ok(ExitCode::SUCCESS);
        }

        // What was done before
        let info = accel.info();
        let mut metadata = self.metadata(&info);
        let restored = match &mut keeper {
            Some(keeper) => keeper.restore(job, &metadata)?,
            None => None,
        };
        let mut done = restored.unwrap_or_else(|| Progressed::start(job, &metadata));
        warn_of(preview.open(&done.film).as_slice());

        // The render, with breaks in which files are written and pictures shown
        let progress = Progress::new(job.crop.area() * job.samples.len() as u64, job.quiet);
        progress.skip(done.film.samples());
        catch_interrupts();
        let render_start = Instant::now();
        let seconds_before = done.seconds;
        let mut clock = Clock::new(
            keeper.as_ref().map(|keeper| keeper.interval),
            self.files.write_every,
            preview.interval,
            job.time_limit,
        );
        let stop = loop {
            let until = Until {
                progress: &progress,
                due: clock.next(),
            };
            let (outcome, statistics) = self.pool.install(|| {
                let (film, end) = (&mut done.film, job.samples.end);
                job.estimator.render(world, &sampler, film, end, job.noise, &until)
            });
            done.statistics = done.statistics.merge(statistics);
            done.seconds = seconds_before + render_start.elapsed().as_secs_f64();
            if outcome == Outcome::Complete {
                break Stop::of_complete(&done.film, job.noise);
            } else if progress.should_stop() {
                break Stop::Interrupt;
            } else if clock.is_over() {
                break Stop::TimeLimit;
            }
            let pause = Instant::now();
            let mut failures = self.write_meanwhile(&mut clock, keeper.as_ref(), &done, &metadata);
            if clock.preview.is_due() {
                failures.extend(preview.update(&done.film));
                clock.preview.restart_with(preview.interval);
            }
            progress.suspend(|| warn_of(&failures));
            clock.rest_after(pause.elapsed());
        };
        progress.finish();
        metadata.complete = stop.is_complete();
        metadata.render_seconds = done.seconds;
        let (film, statistics) = (&done.film, &done.statistics);
        if statistics.dropped > 0 {
            let warning = dropped_warning(statistics);
            words::warning(&warning);
            warnings.push(warning);
        }

        let noise = job.noise.map(|level| Noise::new(film, level));
        if let Some(noise) = noise.filter(|n| stop.is_complete() && !n.is_reached()) {
            let warning = noise.warning();
            words::warning(&warning);
            warnings.push(warning);
        }

        let audit = audit();
        if let Some(report) = &audit {
            if report.is_unexplained() {
                let warning = format!("the backends disagree: {}", report.text().trim_end());
                words::warning(&warning);
                warnings.push(warning);
            } else if !job.quiet {
                eprint!("{}", report.text());
            }
        }

        // Every output is tried, so that one full disk does not cost the other picture.
        let kept = keeper.map(|keeper| keeper.keep(&done, &metadata));
        let mut failures: Vec<String> = kept.and_then(Result::err).iter().map(FileError::to_string).collect();
        let mut image = done.develop(noise.is_some(), &metadata);
        // Where denoising fails, the raw picture is written all the same.
        let denoised = self.denoise(&mut image).unwrap_or_else(|error| {
            failures.push(error.to_string());
            None
        });
        metadata.denoiser = denoised.as_ref().map(|d| d.by.clone());
        let unwritten = done.write(&image, &self.files.images, job.is_part, &metadata);
        failures.extend(unwritten.iter().map(FileError::to_string));
        if let Some(lost) = preview.finish(&done.film) {
            words::warning(&lost);
            warnings.push(lost.to_string());
        }

        let stats = Stats {
            version: env!("CARGO_PKG_VERSION"),
            backend: info.name,
            backend_version: &info.version,
            isa: info.isa,
            integrator: job.estimator.name(),
            sampler: job.sampler_name(),
            spp: job.samples.len() as u32,
            threads: job.threads,
            width: job.resolution.x,
            height: job.resolution.y,
            triangles: self.scene.triangle_count(),
            lights: self.scene.lights().len(),
            load_s: self.load_s,
            build_s,
            render_s: done.seconds,
            total_s: self.start.elapsed().as_secs_f64(),
            rays: Rays {
                camera: statistics.rays.camera,
                bounce: statistics.rays.bounce,
                shadow: statistics.rays.shadow,
            },
            samples: statistics.samples,
            complete: stop.is_complete(),
            stop: stop.name(),
            error: film.relative_error(),
            scene_hash: &self.scene_hash,
            scene_bytes: self.scene.bytes(),
            bvh_bytes: accel.bytes(),
            peak_rss_bytes: peak_rss_bytes(),
            dropped_samples: statistics.dropped,
            dropped: statistics.first_dropped.iter().map(Dropped::from).collect(),
            noise,
            denoise: denoised,
            audit,
            warnings,
        };
        if let Some(output) = &self.files.stats {
            let json = serde_json::to_string_pretty(&stats).map_err(|e| CliError::Failed(e.to_string()))?;
            let unwritten = output.write(|w| std::io::Write::write_all(w, json.as_bytes())).err();
            failures.extend(unwritten.iter().map(FileError::to_string));
        }
        if !job.quiet {
            self.summarize(&stats, stop);
        }
        finish(failures, stop)
    }

    /// What files say of the render.
    fn metadata(&self, info: &BackendInfo) -> Metadata {
        let job = self.job;
        Metadata {
            version: env!("CARGO_PKG_VERSION").into(),
            scene_hash: self.scene_hash.clone(),
            settings: job.settings(),
            first_sample: job.samples.start,
            end_sample: job.samples.end,
            total_samples: job.total_samples,
            seed: job.seed,
            backend: info.name.into(),
            backend_version: format!("{} {}", info.version, info.isa),
            render_seconds: 0.0,
            complete: false,
            features: self.feature_names(),
            denoiser: None,
        }
    }

    /// What further channels are of, if any are asked for.
    fn feature_names(&self) -> Option<FeatureNames> {
        let aovs = &self.job.aovs;
        let materials = self.scene.materials().iter();
        (!aovs.is_empty()).then(|| FeatureNames {
            aovs: aovs.iter().map(|&aov| name_of(Aov::NAMES, aov).into()).collect(),
            objects: self.scene.objects().to_vec(),
            materials: materials.map(|m| m.name.clone()).collect(),
            lights: match aovs.contains(&Aov::Lights) {
                true => self.scene.light_groups().names().to_vec(),
                false => Vec::new(),
            },
        })
    }

    /// Writes what is due, and what went wrong with it.
    fn write_meanwhile(
        &self,
        clock: &mut Clock,
        keeper: Option<&Keeper>,
        done: &Progressed,
        metadata: &Metadata,
    ) -> Vec<FileError> {
        let metadata = Metadata {
            render_seconds: done.seconds,
            ..metadata.clone()
        };
        let mut failures = Vec::new();
        if let Some(keeper) = keeper.filter(|_| clock.checkpoint.is_due()) {
            failures.extend(keeper.keep(done, &metadata).err());
            clock.checkpoint.restart();
        }
        if clock.images.is_due() {
            failures.extend(self.write_images(done, &metadata));
            clock.images.restart();
        }
        failures
    }

    /// Writes the images as they are now, raw, and what went wrong with it. A part comes with its sums.
    fn write_images(&self, done: &Progressed, metadata: &Metadata) -> Vec<FileError> {
        let image = done.develop(self.job.noise.is_some(), metadata);
        done.write(&image, &self.files.images, self.job.is_part, metadata)
    }

    /// Takes the noise out of `image`, if that was asked for.
    fn denoise(&self, image: &mut Image) -> Result<Option<Denoised>, DenoiseError> {
        let (Some(denoiser), Some(by)) = (self.job.denoiser, self.denoiser.clone()) else {
            return Ok(None);
        };
        let start = Instant::now();
        self.pool.install(|| denoiser.apply(image))?;
        let seconds = start.elapsed().as_secs_f64();
        Ok(Some(Denoised { by, seconds }))
    }

    fn summarize(&self, stats: &Stats, stop: Stop) {
        let job = self.job;
        let names: Vec<String> = self
            .files
            .images
            .iter()
            .map(|(_, o)| o.path().display().to_string())
            .collect();
        eprintln!(
            "{}: {}x{}, {:.1} of {} samples a pixel in {:.2} s ({:.2} M samples/s, {} {}){}{} -> {}",
            job.scene_path.display(),
            stats.width,
            stats.height,
            stats.samples as f64 / job.crop.area() as f64,
            stats.spp,
            stats.render_s,
            stats.samples as f64 / stats.render_s.max(1e-9) / 1e6,
            stats.backend,
            stats.backend_version,
            stats
                .error
                .map_or(String::new(), |error| format!(", relative error {error:.2e}")),
            stop.words(),
            if names.is_empty() {
                "no image".into()
            } else {
                names.join(", ")
            },
        );
        if job.verbose {
            eprintln!(
                "  {} triangles, {} lights; load {:.3} s, build {:.3} s, in all {:.3} s",
                stats.triangles, stats.lights, stats.load_s, stats.build_s, stats.total_s
            );
            eprintln!(
                "  rays: {} camera, {} bounce, {} shadow; {} thread(s), {}",
                stats.rays.camera, stats.rays.bounce, stats.rays.shadow, stats.threads, stats.isa
            );
            eprintln!(
                "  memory: scene {:.1} MB, acceleration structure {:.1} MB, peak {:.1} MB; scene hash {}",
                stats.scene_bytes as f64 / 1e6,
                stats.bvh_bytes as f64 / 1e6,
                stats.peak_rss_bytes.unwrap_or(0) as f64 / 1e6,
                stats.scene_hash,
            );
        }
    }
}

/// Says what went wrong without ending the render.
fn warn_of(failures: &[FileError]) {
    for failure in failures {
        words::warning(format_args!("{failure}; the render goes on"));
    }
}

fn dropped_warning(statistics: &Statistics) -> String {
    let first = statistics.first_dropped.first().map_or_else(String::new, |d| {
        format!(
            "; the first is sample {} of pixel {},{}",
            d.key.sample, d.key.x, d.key.y
        )
    });
    format!(
        "{} samples were NaN, infinite or negative and count as black{first}",
        statistics.dropped
    )
}

fn finish(failures: Vec<String>, stop: Stop) -> Result<ExitCode, CliError> {
    if !failures.is_empty() {
        return Err(CliError::Failed(failures.join("\nerror: ")));
    }
    if stop == Stop::Interrupt {
        eprintln!("interrupted: what is written holds the samples taken so far");
        return Ok(ExitCode::from(INTERRUPTED));
    }
    Ok(ExitCode::SUCCESS)
}

/// Why a render ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Stop {
    /// All samples were taken.
    Samples,
    /// The noise is as low as was asked for.
    Noise,
    TimeLimit,
    Interrupt,
}

impl Stop {
    /// Of a render that has done all it was to do.
    fn of_complete(film: &Film, noise: Option<f64>) -> Self {
        match noise {
            Some(level) if Noise::new(film, level).is_reached() => Self::Noise,
            _ => Self::Samples,
        }
    }

    fn is_complete(self) -> bool {
        matches!(self, Self::Samples | Self::Noise)
    }

    fn name(self) -> &'static str {
        match self {
            Self::Samples => "samples",
            Self::Noise => "noise",
            Self::TimeLimit => "time-limit",
            Self::Interrupt => "interrupt",
        }
    }

    /// For the end of a sentence; nothing where all samples were taken.
    fn words(self) -> &'static str {
        match self {
            Self::Samples => "",
            Self::Noise => ", stopped by --noise",
            Self::TimeLimit => ", stopped by --time-limit",
            Self::Interrupt => ", stopped by an interrupt",
        }
    }
}

/// The images that a render writes.
fn images(args: &RenderArgs, tone: Tone) -> Result<Vec<(Format, Output)>, CliError> {
    let default = || vec![PathBuf::from(args.scene.file_stem().unwrap_or_default()).with_extension("exr")];
    let paths = if !args.output.is_empty() {
        args.output.clone()
    } else if args.samples.is_some() && args.checkpoint.is_some() {
        // A part that is kept: nobody has asked for a picture of it.
        Vec::new()
    } else {
        default()
    };
    prepare_images(&paths, tone)
}

/// The images to write, by name; PNG files with this tone.
pub(super) fn prepare_images(paths: &[PathBuf], tone: Tone) -> Result<Vec<(Format, Output)>, CliError> {
    if let Some(twice) = paths
        .iter()
        .enumerate()
        .find_map(|(i, p)| paths[..i].contains(p).then_some(p))
    {
        let twice = twice.display();
        return Err(CliError::Usage(format!(
            "-o {twice} is given twice\n  help: name each file once"
        )));
    }
    // A name that is no image is wrong usage; a folder that cannot be written is a failure.
    let prepared = paths.iter().map(|path| {
        let format = match Format::of_path(path).map_err(|e| CliError::Usage(e.to_string()))? {
            Format::Png(_) => Format::Png(tone),
            Format::Exr => Format::Exr,
        };
        Ok((format, Output::prepare(path)?))
    });
    prepared.collect()
}
