//! Comparison of two backends, ray by ray.

use super::args::{AuditArgs, Flags, RenderArgs};
use super::error::{CliError, INTERRUPTED};
use super::job::Job;
use super::outputs::Outputs;
use super::printing::percent;
use super::progress::{InterruptGuard, Progress};
use super::warnings::{ShownWarnings, note_middle_eye};
use crate::accel::brute::{self, BruteForce};
use crate::accel::{Accel, Answer, AuditFindings, Auditor, BackendInfo, Cause, Disagreement, Query, QueryKind};
use crate::files::read_text;
use crate::film::Film;
use crate::geometry::InstanceId;
use crate::io::FileError;
use crate::math::{Ray, list};
use crate::options::{Backend, Denoising, SamplingOptions};
use crate::render::{Outcome, Statistics, StopCondition};
use crate::scene::Scene;
use crate::session::{AnyAccel, RenderContext, Session};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

/// Maximum number of ray-triangle pairs (triangles × rays) for a check by brute force.
const MAX_BRUTE: u64 = 2_000_000_000;

/// Accepted number of leaks per ray. A ray leaks if it passes between two triangles at their shared
/// edge. Embree and other backends have a few leaks.
const LEAK_BUDGET: f64 = 1e-6;

/// Number of rays in a packet of `--replay`. All rays of the packet are copies of the recorded ray.
/// A packet is traced if the first backend traced the recorded ray in a packet.
const PACKET: usize = 16;

/// Maximum number of disagreements that the text lists. The JSON report may have more.
const MAX_LISTED: usize = 5;

/// Report of an audit as JSON. It has enough data to trace every ray again, also on another
/// machine.
#[derive(Debug, Serialize)]
pub(super) struct AuditReport {
    version: &'static str,
    scene: String,
    scene_hash: String,
    triangles: u64,
    /// The checked backend, and the backend to compare with.
    backends: [BackendName; 2],
    closest_rays: u64,
    occlusion_rays: u64,
    disagreements: u64,
    /// Number of disagreements divided by the number of rays.
    rate: f64,
    /// Number of disagreements by cause.
    causes: BTreeMap<&'static str, u64>,
    /// Number of errors of each backend in `rays`.
    wrong: BTreeMap<&'static str, u64>,
    /// The disagreements that were kept: first unexplained disagreements, then leaks.
    rays: Vec<Entry>,
}

#[derive(Debug, Serialize)]
struct BackendName {
    name: &'static str,
    version: String,
    isa: &'static str,
}

impl From<BackendInfo> for BackendName {
    fn from(info: BackendInfo) -> Self {
        let BackendInfo { name, version, isa } = info;
        Self { name, version, isa }
    }
}

/// A ray on which backends disagree.
#[derive(Debug, Serialize)]
struct Entry {
    kind: &'static str,
    /// True if the first backend traced the ray in a packet.
    packet: bool,
    cause: &'static str,
    /// The backends that are wrong.
    wrong: Vec<&'static str>,
    origin: [f32; 3],
    direction: [f32; 3],
    t_min: f32,
    /// `null` for an infinite ray.
    t_max: Option<f32>,
    /// Origin, direction, `t_min`, `t_max` and time as 32-bit floats, in hexadecimal.
    bits: [String; 9],
    answers: BTreeMap<String, serde_json::Value>,
}

/// Fields of a report that `--replay` reads.
#[derive(Debug, Deserialize)]
struct Replay {
    scene_hash: String,
    rays: Vec<ReplayRay>,
}

#[derive(Debug, Deserialize)]
struct ReplayRay {
    kind: String,
    #[serde(default)]
    packet: bool,
    bits: [String; 9],
}

/// Runs `embrasure audit`.
pub(super) fn audit(args: &AuditArgs) -> Result<ExitCode, CliError> {
    let job = Job::new(&render_args(args))?;
    let other = other_backend(job.settings.backend, args.against)?;
    let mut outputs = Outputs::default();
    let output = args.output.as_deref();
    let output = output.map(|path| outputs.prepare("-o", path)).transpose()?;
    outputs.refuse_inputs([Some(&*args.scene), args.replay.as_deref()].into_iter().flatten())?;
    let replay = args.replay.as_deref().map(read_replay).transpose()?;
    let session = Session::load(&job.scene, job.settings.clone(), &())?;
    outputs.refuse_inputs(session.files().iter().map(PathBuf::as_path))?;
    ShownWarnings::Summary.show(session.warnings(), &job.scene_path);
    note_middle_eye(&session);
    if let (Some(replay), Some(file)) = (&replay, &args.replay) {
        if replay.scene_hash != session.scene_hash() {
            errln!(
                "warning: {} was made with another scene, or another camera",
                file.display()
            );
        }
    }
    let [first, second] = [job.settings.backend, other].map(|backend| backend.build(session.scene(), session.pool()));
    let (first, second) = (first?, second?);
    let audit = Audit {
        session: &session,
        accels: [first.as_dyn(), second.as_dyn()],
        quiet: args.quiet,
    };
    let (findings, outcome) = match &replay {
        Some(replay) => (audit.retrace(replay)?, Outcome::Complete),
        None => audit.sample(args.rays.get())?,
    };
    let report = AuditReport::new(args.scene.display().to_string(), &session, audit.accels, &findings);
    let json = serde_json::to_string_pretty(&report).map_err(|e| CliError::Failed(e.to_string()))?;
    if let Some(output) = &output {
        output.write(|w| std::io::Write::write_all(w, json.as_bytes()))?;
    }
    if args.json {
        outln!("{json}");
    } else {
        out!("{}", report.text());
    }
    Ok(match outcome {
        Outcome::Stopped => ExitCode::from(INTERRUPTED),
        Outcome::Complete if report.is_wrong() => ExitCode::FAILURE,
        Outcome::Complete => ExitCode::SUCCESS,
    })
}

/// Arguments of the render whose rays are checked.
fn render_args(args: &AuditArgs) -> RenderArgs {
    RenderArgs {
        scene: args.scene.clone(),
        sampling: Flags(SamplingOptions {
            seed: args.seed,
            backend: args.backend,
            // The picture is not used, so it is not denoised.
            denoise: Some(Denoising::Off),
            ..SamplingOptions::default()
        }),
        size: args.size,
        threads: args.threads,
        quiet: args.quiet,
        ..RenderArgs::default()
    }
}

/// Backend to compare `backend` with: `against` if given, else another built-in backend.
pub(super) fn other_backend(backend: Backend, against: Option<Backend>) -> Result<Backend, CliError> {
    let other = against.or_else(|| Backend::ALL.iter().copied().find(|b| *b != backend));
    other.filter(|other| *other != backend).ok_or_else(|| {
        let message = format!("there is no second backend to check {} against", backend.name());
        let help = match against {
            Some(_) => "name another backend with --against (`embrasure --version` lists them)",
            None => "build the program with a second backend",
        };
        CliError::Usage(format!("{message}\n  help: {help}"))
    })
}

/// An audit: a scene with two backends.
struct Audit<'a> {
    session: &'a Session,
    accels: [&'a dyn Accel; 2],
    quiet: bool,
}

impl Audit<'_> {
    /// Checks about `rays` rays, spread evenly over the rays of a render.
    fn sample(&self, rays: u64) -> Result<(AuditFindings, Outcome), CliError> {
        let _interrupts = InterruptGuard::begin();
        // A render with one sample per pixel counts the rays.
        let (_, statistics) = self.render(0.0, 1);
        let traced = statistics.rays.camera + statistics.rays.bounce + statistics.rays.shadow;
        let samples = rays.div_ceil(traced.max(1));
        let samples = u32::try_from(samples).map_err(|_| {
            let message = format!("--rays {rays} is more than this image has in 2^32 samples");
            CliError::Usage(format!("{message}\n  help: use fewer rays"))
        })?;
        let share = rays as f64 / (traced.max(1) as f64 * samples as f64);
        let (checked, statistics) = self.render(share, samples);
        let outcome = if statistics.samples == self.session.settings().crop().area() * samples as u64 {
            Outcome::Complete
        } else {
            Outcome::Stopped
        };
        Ok((checked, outcome))
    }

    /// Renders `samples` samples per pixel, and checks the fraction `share` of the rays.
    fn render(&self, share: f64, samples: u32) -> (AuditFindings, Statistics) {
        let settings = self.session.settings();
        let auditor = Auditor::new(self.session.scene(), self.accels, share);
        let audited = AnyAccel::Audited(&auditor);
        let (sampler, prepared) = (settings.random_numbers(), self.session.prepared());
        let stop = StopCondition::at(samples);
        let context = RenderContext {
            world: self.session.world(&audited),
            prepared: &prepared,
        };
        let mut film = Film::new(settings.resolution, settings.crop());
        let progress = Progress::new(settings.crop().area() * samples as u64, self.quiet);
        let integrator = settings.chosen_integrator();
        let render = || integrator.render(context, &sampler, &mut film, stop, &progress);
        let (_, statistics) = self.session.install(render);
        progress.finish();
        (auditor.findings(), statistics)
    }

    /// Checks the rays of a report again.
    fn retrace(&self, replay: &Replay) -> Result<AuditFindings, CliError> {
        let auditor = Auditor::new(self.session.scene(), self.accels, 1.0);
        for (i, ray) in replay.rays.iter().enumerate() {
            let broken = || CliError::Failed(format!("--replay: ray {i} of the report cannot be read"));
            let query = ray.query().ok_or_else(broken)?;
            match (ray.packet, query.kind) {
                (false, _) => {
                    query.trace(&auditor);
                }
                (true, QueryKind::Closest) => auditor.intersect_coherent(&[query.ray; PACKET], &mut [None; PACKET]),
                (true, QueryKind::Occlusion) => auditor.occluded_coherent(&[query.ray; PACKET], &mut [false; PACKET]),
            }
        }
        Ok(auditor.findings())
    }
}

fn read_replay(path: &Path) -> Result<Replay, FileError> {
    let text = read_text(path, "the report")?;
    serde_json::from_str(&text).map_err(|e| {
        let error = FileError::new(path, format!("not a report of an audit: {e}"));
        error.help("give the JSON that `embrasure audit` wrote")
    })
}

impl ReplayRay {
    fn query(&self) -> Option<Query> {
        let kind = match self.kind.as_str() {
            "closest" => QueryKind::Closest,
            "occlusion" => QueryKind::Occlusion,
            _ => return None,
        };
        let mut bits = [0; 9];
        for (bits, text) in bits.iter_mut().zip(&self.bits) {
            *bits = u32::from_str_radix(text, 16).ok()?;
        }
        let ray = Ray::from_bits(bits);
        (0.0..=1.0).contains(&ray.time).then_some(Query { ray, kind })
    }
}

impl AuditReport {
    pub fn new(scene_name: String, session: &Session, accels: [&dyn Accel; 2], findings: &AuditFindings) -> Self {
        let scene = session.scene();
        let kept = &findings.disagreements;
        let backends = accels.map(|accel| accel.info());
        // If brute force takes only a moment, it decides which backend is wrong.
        let work = scene.placed_triangle_count().saturating_mul(kept.len() as u64);
        let brute = (work <= MAX_BRUTE).then(|| BruteForce::new(scene));
        let rays: Vec<Entry> = kept
            .iter()
            .map(|d| Entry::new(d, scene, accels, brute.as_ref()))
            .collect();
        let wrong = |name: &str| rays.iter().filter(|ray| ray.wrong.contains(&name)).count() as u64;
        Self {
            version: env!("CARGO_PKG_VERSION"),
            scene: scene_name,
            scene_hash: session.scene_hash().into(),
            triangles: scene.triangle_count(),
            closest_rays: findings.closest,
            occlusion_rays: findings.occlusion,
            disagreements: findings.count(),
            rate: findings.count() as f64 / findings.rays().max(1) as f64,
            causes: Cause::ALL.map(|c| (c.name(), findings.caused_by(c))).into(),
            wrong: [&backends[0], &backends[1]].map(|b| (b.name, wrong(b.name))).into(),
            backends: backends.map(BackendName::from),
            rays,
        }
    }

    /// Text for users: one line, and further lines if there are disagreements.
    pub fn text(&self) -> String {
        let [a, b] = &self.backends;
        let mut text = format!(
            "{}: {} {} and {} {} disagree on {} of {} rays ({})",
            self.scene,
            a.name,
            a.version,
            b.name,
            b.version,
            self.disagreements,
            self.closest_rays + self.occlusion_rays,
            percent(self.rate)
        );
        let causes: Vec<String> = self
            .causes
            .iter()
            .filter(|c| *c.1 > 0)
            .map(|(c, n)| format!("{n} {c}"))
            .collect();
        if !causes.is_empty() {
            text += &format!(": {}", causes.join(", "));
        }
        text.push('\n');
        for ray in self.rays.iter().take(MAX_LISTED) {
            let packet = if ray.packet { ", in a packet" } else { "" };
            text += &format!(
                "  {} {}{packet} from {} along {}",
                ray.cause,
                ray.kind,
                list(&ray.origin),
                list(&ray.direction)
            );
            text += &match ray.wrong.as_slice() {
                [] => "\n".to_string(),
                [one] => format!(": {one} is wrong\n"),
                several => format!(": {} are wrong\n", several.join(" and ")),
            };
            for (who, what) in &ray.answers {
                text += &format!("    {who}: {}\n", words(what));
            }
        }
        text
    }

    /// Returns true if a backend is unreliable: a disagreement is unexplained, or there are more
    /// leaks than [`LEAK_BUDGET`].
    pub fn is_wrong(&self) -> bool {
        let caused_by = |cause: Cause| self.causes.get(cause.name()).copied().unwrap_or(0);
        let rays = self.closest_rays + self.occlusion_rays;
        caused_by(Cause::Unexplained) > 0 || caused_by(Cause::Leak) as f64 > LEAK_BUDGET * rays as f64
    }
}

impl Entry {
    fn new(found: &Disagreement, scene: &Scene, accels: [&dyn Accel; 2], brute: Option<&BruteForce>) -> Self {
        let Disagreement {
            query,
            is_packet,
            cause,
            ..
        } = *found;
        let Query { ray, kind } = query;
        let names = accels.map(|accel| accel.info().name);
        let mut answers: BTreeMap<String, _> = names
            .into_iter()
            .map(String::from)
            .zip(found.answers.map(|a| answer(&a)))
            .collect();
        if is_packet {
            answers.insert(format!("{}, single ray", names[0]), answer(&query.trace(accels[0])));
        }
        if let Some(brute) = brute {
            answers.insert(brute::NAME.into(), answer(&query.trace(brute)));
        }
        let wrong = names
            .into_iter()
            .zip(found.wrong(scene, brute))
            .filter(|(_, is_wrong)| *is_wrong);
        Self {
            kind: match kind {
                QueryKind::Closest => "closest",
                QueryKind::Occlusion => "occlusion",
            },
            packet: is_packet,
            cause: cause.name(),
            wrong: wrong.map(|(name, _)| name).collect(),
            origin: ray.origin.to_array(),
            direction: ray.direction.to_array(),
            t_min: ray.t_min,
            t_max: ray.t_max.is_finite().then_some(ray.t_max),
            bits: ray.bits().map(|b| format!("{b:08x}")),
            answers,
        }
    }
}

/// Text for the result of a ray in a report: occluded, free, the hit, or nothing.
fn words(answer: &serde_json::Value) -> String {
    use serde_json::Value;
    match answer {
        Value::Bool(true) => "occluded".into(),
        Value::Bool(false) => "free".into(),
        Value::Null => "nothing".into(),
        hit => format!("triangle {} of mesh {} at t {}", hit["prim"], hit["geom"], hit["t"]),
    }
}

fn answer(answer: &Answer) -> serde_json::Value {
    match answer {
        Answer::Closest(None) => serde_json::Value::Null,
        Answer::Closest(Some(hit)) => serde_json::json!({
            "t": hit.t, "b1": hit.b1, "b2": hit.b2, "prim": hit.prim.0, "geom": hit.geom.0,
            "inst": (hit.inst != InstanceId::NONE).then_some(hit.inst.0),
        }),
        Answer::Occlusion(occluded) => serde_json::json!(occluded),
    }
}
