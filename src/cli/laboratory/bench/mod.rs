//! `embrasure bench`: ray rates and the cost of a render, backend by backend.

mod tables;

use crate::accel::{Accel, Query, QueryKind, Recorder};
use crate::cli::args::{BenchArgs, Flags, RenderArgs};
use crate::cli::error::CliError;
use crate::cli::job::Job;
use crate::cli::progress::Progress;
use crate::cli::warnings::{ShownWarnings, note_middle_eye};
use crate::film::{Film, FirstSurface};
use crate::integrator::{FoundLight, RayKind, RaySink, Sink};
use crate::math::UVec2;
use crate::options::{Backend, Denoising, IntegratorOptions, PathReuse, SamplingOptions};
use crate::render::StopCondition;
use crate::sampler::SampleKey;
use crate::session::{AnyAccel, Preparation, RenderContext, Session, thread_pool};
use rayon::prelude::*;
use serde::Serialize;
use std::hint::black_box;
use std::ops::Range;
use std::path::Path;
use std::process::ExitCode;
use std::time::Instant;
use tables::tables;

/// Maximum number of recorded samples over all pixels: enough to fill every cache, and few enough
/// to fit in memory.
const MAX_SAMPLES: u64 = 1 << 19;
/// Indices of the recorded samples. Renders take them in a single pass.
const SAMPLES: Range<u32> = 16..32;
/// Minimum time of a measurement in seconds. A shorter measurement is repeated.
const SHORTEST: f64 = 0.05;

/// Report of `embrasure bench`.
#[derive(Debug, Serialize)]
struct BenchReport {
    pub version: &'static str,
    pub cpu: Option<String>,
    pub cores: usize,
    pub scenes: Vec<SceneRuns>,
}

#[derive(Debug, Serialize)]
struct SceneRuns {
    pub scene: String,
    pub triangles: u64,
    pub lights: usize,
    pub width: u32,
    pub height: u32,
    /// Samples per pixel of the measured renders.
    pub spp: usize,
    pub backends: Vec<BackendReport>,
}

#[derive(Debug, Serialize)]
struct BackendReport {
    pub name: &'static str,
    pub version: String,
    pub isa: &'static str,
    /// Seconds of a build with all threads. All times here are medians.
    pub build_s: f64,
    pub bytes: u64,
    pub bytes_per_triangle: f64,
    pub runs: Vec<ThreadRun>,
}

/// Measurements with `threads` threads.
#[derive(Debug, Serialize)]
struct ThreadRun {
    pub threads: usize,
    pub mrays_per_s: Rates,
    pub rays: usize,
    pub render_s: f64,
    /// Seconds to trace the rays of the render without the integrator.
    pub replay_s: f64,
    /// Median of the ratios of render time to replay time. Both times of a ratio are measured one
    /// directly after the other, so this median has less noise than the ratio of the median times.
    pub render_over_replay: f64,
}

/// Million rays per second by kind of ray; `null` if the scene has no rays of the kind.
#[derive(Debug, Serialize)]
struct Rates {
    pub camera: Option<f64>,
    pub first_bounce: Option<f64>,
    pub second_bounce: Option<f64>,
    pub shadow: Option<f64>,
}

/// Measures the scenes and prints tables or JSON.
pub(in crate::cli) fn bench(args: &BenchArgs) -> Result<ExitCode, CliError> {
    // All arguments are checked before the first ray.
    let jobs: Result<Vec<Job>, CliError> = args.scenes.iter().map(|s| Job::new(&render_args(args, s))).collect();
    let mut jobs = jobs?;
    jobs.iter_mut().for_each(shrink);
    let scenes: Result<Vec<_>, CliError> = jobs.into_iter().map(|job| bench_scene(args, job)).collect();
    let report = BenchReport {
        version: env!("CARGO_PKG_VERSION"),
        cpu: cpu_name(),
        cores: std::thread::available_parallelism().map_or(1, |n| n.get()),
        scenes: scenes?,
    };
    if args.json {
        let json = serde_json::to_string_pretty(&report).map_err(|e| CliError::Failed(e.to_string()))?;
        outln!("{json}");
    } else {
        out!("{}", tables(&report));
    }
    Ok(ExitCode::SUCCESS)
}

/// Arguments of the render whose rays are measured.
fn render_args(args: &BenchArgs, scene: &Path) -> RenderArgs {
    RenderArgs {
        scene: scene.to_path_buf(),
        size: args.size,
        sampling: Flags(SamplingOptions {
            backend: args.backend,
            // The picture is not used, so it is not denoised.
            denoise: Some(Denoising::Off),
            ..SamplingOptions::default()
        }),
        threads: args.threads,
        quiet: true,
        // Without path reuse, rays are traced one by one and can be repeated.
        integrator: Flags(IntegratorOptions {
            reuse: Some(PathReuse::None),
            ..IntegratorOptions::default()
        }),
        ..RenderArgs::default()
    }
}

fn bench_scene(args: &BenchArgs, job: Job) -> Result<SceneRuns, CliError> {
    let session = Session::load(&job.scene, job.settings, &())?;
    ShownWarnings::Summary.show(session.warnings(), &job.scene_path);
    note_middle_eye(&session);
    let (scene, settings) = (session.scene(), session.settings());
    let name = job.scene_path.file_stem().unwrap_or_default().to_string_lossy();

    // Measure brute force only if the user names it, or if there is no other backend.
    let chosen = |b: &Backend| match args.backend {
        Some(_) => *b == settings.backend,
        None => *b != Backend::Brute || Backend::ALL.len() == 1,
    };
    let mut backends = Vec::new();
    for backend in Backend::ALL.iter().copied().filter(chosen) {
        let print_step = |what: &str| {
            if !args.quiet {
                errln!("{name}: {}, {what}", backend.name());
            }
        };
        print_step("build");
        let mut build_s = Vec::new();
        for _ in 0..args.repeat.get() {
            let start = Instant::now();
            let _accel = backend.build(scene, session.pool())?;
            build_s.push(start.elapsed().as_secs_f64());
        }
        print_step("rays");
        let measure = BackendMeasurement {
            session: &session,
            accel: backend.build(scene, session.pool())?,
            prepared: session.prepared(),
            repeat: args.repeat.get(),
            build_s: median(build_s),
        };
        backends.push(measure.run()?);
    }
    Ok(SceneRuns {
        scene: name.into_owned(),
        triangles: scene.triangle_count(),
        lights: scene.lights().len(),
        width: settings.resolution.x,
        height: settings.resolution.y,
        spp: SAMPLES.len(),
        backends,
    })
}

/// Scales the image down until it has at most [`MAX_SAMPLES`] samples with 16 samples per pixel.
/// With fewer samples per pixel, camera rays would not be traced together as in renders.
fn shrink(job: &mut Job) {
    let resolution = &mut job.settings.resolution;
    let pixels = (MAX_SAMPLES / SAMPLES.len() as u64) as f64;
    let scale = (pixels / (resolution.x as f64 * resolution.y as f64)).sqrt().min(1.0);
    let side = |n: u32| ((n as f64 * scale) as u32).max(1);
    *resolution = UVec2::new(side(resolution.x), side(resolution.y));
}

/// Measurements of one backend on one scene.
struct BackendMeasurement<'a> {
    session: &'a Session,
    accel: AnyAccel<'a>,
    prepared: Preparation,
    repeat: usize,
    build_s: f64,
}

/// The rays of a render, tile by tile in the order of tracing.
#[derive(Default)]
struct RecordedRays {
    all: Vec<Vec<Query>>,
    /// Closest-hit rays after 0, 1 and 2 scattering events, and shadow rays.
    by_kind: [Vec<Vec<Query>>; 4],
}

/// Index of the shadow rays in `by_kind`.
const SHADOW: usize = 3;

impl BackendMeasurement<'_> {
    fn run(&self) -> Result<BackendReport, CliError> {
        let recording = self.session.install(|| self.record());
        let mut threads = vec![1, self.session.settings().threads];
        threads.dedup();
        let runs: Result<Vec<ThreadRun>, CliError> = threads.iter().map(|&n| self.measure(&recording, n)).collect();
        let accel = self.accel.as_dyn();
        let info = accel.info();
        Ok(BackendReport {
            name: info.name,
            version: info.version,
            isa: info.isa,
            build_s: self.build_s,
            bytes: accel.bytes(),
            bytes_per_triangle: accel.bytes() as f64 / self.session.scene().triangle_count().max(1) as f64,
            runs: runs?,
        })
    }

    /// Renders once, and stores the rays.
    fn record(&self) -> RecordedRays {
        let settings = self.session.settings();
        let (integrator, progress) = (settings.chosen_integrator(), Progress::new(0, true));
        let context = RenderContext {
            world: self.session.world(&self.accel),
            prepared: &self.prepared,
        };
        integrator.prepare(context, &settings.random_numbers(), &progress);
        let film = Film::new(settings.resolution, settings.crop());
        let tiles = film.tiles().par_iter().map(|tile| {
            let any = self.accel.as_dyn();
            let recorder = Recorder::new(&any);
            let recorded: &dyn Accel = &recorder;
            let mut sampler = settings.random_numbers();
            let mut rays = <[Vec<Query>; 4]>::default();
            let mut all = Vec::new();
            for pixel in tile.bounds().pixels() {
                for index in SAMPLES {
                    let key = SampleKey::new(pixel.x, pixel.y, index);
                    let context = RenderContext {
                        world: self.session.world(&recorded),
                        prepared: &self.prepared,
                    };
                    let key = (settings.resolution, key);
                    integrator.sample(context, key, &mut sampler, &|_| Box::new(NullSink));
                    let mut scatterings = 0;
                    for (query, _) in recorder.take() {
                        all.push(query);
                        match query.kind {
                            QueryKind::Occlusion => rays[SHADOW].push(query),
                            QueryKind::Closest => {
                                if scatterings < SHADOW {
                                    rays[scatterings].push(query);
                                }
                                scatterings += 1;
                            }
                        }
                    }
                }
            }
            (all, rays)
        });
        let tiles: Vec<_> = tiles.collect();
        let mut recording = RecordedRays::default();
        for (all, rays) in tiles {
            recording.all.push(all);
            for (list, rays) in recording.by_kind.iter_mut().zip(rays) {
                list.push(rays);
            }
        }
        recording
    }

    fn measure(&self, recording: &RecordedRays, threads: usize) -> Result<ThreadRun, CliError> {
        let pool = thread_pool(threads)?;
        let seconds = |work: &(dyn Fn() + Sync)| pool.install(|| repeated_seconds(work));
        let accel = self.accel.as_dyn();

        // Measure a render and a replay of the recorded rays in turn.
        let mut pairs = Vec::new();
        for _ in 0..self.repeat {
            let render_s = seconds(&|| self.render());
            let replay_s = seconds(&|| trace(accel, &recording.all));
            pairs.push((render_s, replay_s));
        }

        let rate = |rays: &[Vec<Query>]| {
            let count: usize = rays.iter().map(Vec::len).sum();
            let times = (0..self.repeat).map(|_| seconds(&|| trace(accel, rays)));
            (count > 0).then(|| count as f64 / median(times.collect()) / 1e6)
        };
        let [camera, first_bounce, second_bounce, shadow] = &recording.by_kind;
        Ok(ThreadRun {
            threads,
            mrays_per_s: Rates {
                camera: rate(camera),
                first_bounce: rate(first_bounce),
                second_bounce: rate(second_bounce),
                shadow: rate(shadow),
            },
            rays: recording.all.iter().map(Vec::len).sum(),
            render_s: median(pairs.iter().map(|(render, _)| *render).collect()),
            replay_s: median(pairs.iter().map(|(_, replay)| *replay).collect()),
            render_over_replay: median(pairs.iter().map(|(render, replay)| render / replay).collect()),
        })
    }

    fn render(&self) {
        let settings = self.session.settings();
        let mut film = Film::starting_at(settings.resolution, settings.crop(), SAMPLES.start);
        let context = RenderContext {
            world: self.session.world(&self.accel),
            prepared: &self.prepared,
        };
        let sampler = settings.random_numbers();
        let integrator = settings.chosen_integrator();
        let progress = Progress::new(0, true);
        black_box(integrator.render(context, &sampler, &mut film, StopCondition::at(SAMPLES.end), &progress));
    }
}

/// Traces all rays; each thread takes one tile at a time.
fn trace(accel: &dyn Accel, tiles: &[Vec<Query>]) {
    let hits = tiles.par_iter().map(|tile| accel.count_hits(tile));
    black_box(hits.sum::<usize>());
}

/// Seconds of one run of `work`. Runs are repeated until the total is at least [`SHORTEST`].
fn repeated_seconds(work: impl Fn()) -> f64 {
    let start = Instant::now();
    for times in 1.. {
        work();
        let elapsed = start.elapsed().as_secs_f64();
        if elapsed >= SHORTEST {
            return elapsed / times as f64;
        }
    }
    f64::NAN
}

/// The middle value, or the mean of the two middle values.
fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    match values.len() {
        0 => f64::NAN,
        n => (values[(n - 1) / 2] + values[n / 2]) / 2.0,
    }
}

/// Name of the processor on Linux.
fn cpu_name() -> Option<String> {
    let text = std::fs::read_to_string("/proc/cpuinfo").ok()?;
    let line = text.lines().find(|line| line.starts_with("model name"))?;
    Some(line.split_once(':')?.1.trim().to_string())
}

/// Sink that discards everything.
struct NullSink;

impl Sink for NullSink {
    fn weight(&mut self, _: f32) {}
    fn light(&mut self, _: FoundLight) {}
    fn first_surface(&mut self, _: FirstSurface) {}
}

impl RaySink for NullSink {
    fn ray(&mut self, _: RayKind) {}
    fn cut_walk(&mut self) {}
}
