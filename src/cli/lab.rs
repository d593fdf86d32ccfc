//! The ladder of estimators on one scene: the lectures' comparison, made executable.

use super::args::{Flags, LabArgs, RenderArgs};
use super::bounces::write_sheet;
use super::error::CliError;
use super::job::Job;
use super::outputs::Outputs;
use super::progress::{Heeding, Progress};
use super::warnings::ShownWarnings;
use crate::accel::Dispatch;
use crate::compare::Errors;
use crate::film::{Film, RgbImage};
use crate::integrator::{DirectLight, Directions, Heuristic};
use crate::io::{Output, Panel, read_exr, write_contact_sheet};
use crate::options::{
    Denoising, IntegratorKind, IntegratorOptions, Method, Named, PathReuse, SamplingOptions, name_of,
};
use crate::render::{Observer, Outcome, last_cut};
use crate::session::{AccelTask, Prepared, Session};
use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::Instant;

/// How many times the samples of the best rung the reference has.
const REFERENCE_FACTOR: u32 = 64;
/// Samples of a pixel where nothing says how many.
const USUAL_SAMPLES: u32 = 64;
/// Pictures in a row of the sheet.
const COLUMNS: usize = 4;

/// Renders the ladder and writes what came out.
pub(super) fn lab(args: &LabArgs) -> Result<ExitCode, CliError> {
    // Everything that can be wrong is found before the first ray.
    let prefix = match &args.output {
        Some(prefix) => prefix.clone(),
        None => {
            let stem = args.scene.file_stem().unwrap_or_default();
            PathBuf::from(format!("{}-lab", Path::new(stem).display()))
        }
    };
    if args.bounces {
        return bounces(args, &prefix);
    }
    let [sheet, csv, markdown] = ["png", "csv", "md"].map(|e| Output::prepare(&with_extension(&prefix, e)));
    let outputs = [sheet?, csv?, markdown?];
    let mut named = Outputs::default();
    outputs.iter().try_for_each(|output| named.add("-o", output))?;
    named.spare([Some(&*args.scene), args.reference.as_deref()].into_iter().flatten())?;
    let job = Job::new(&render_args(args))?;
    let reference = args.reference.as_deref().map(read_exr).transpose()?;
    if let (Some(image), Some(path)) = (&reference, &args.reference) {
        let size = job.settings.crop().size().as_usizevec2().to_array();
        if [image.width, image.height] != size {
            return Err(CliError::Usage(format!(
                "{} has {}x{} pixels, but {}x{} are rendered\n  help: give --size {}x{}",
                path.display(),
                image.width,
                image.height,
                size[0],
                size[1],
                image.width,
                image.height
            )));
        }
    }
    let estimators = match args.methods.is_empty() {
        true => ladder(&job.settings.integrator),
        false => methods(&job.settings.integrator, &args.methods),
    };
    estimators.iter().try_for_each(|(_, estimator)| estimator.check())?;
    let is_true = |(_, estimator): &(&str, Method)| estimator.finds_all_light();
    if reference.is_none() && !estimators.iter().any(is_true) {
        return Err(no_truth(&estimators));
    }
    let session = Session::load(&job.scene, job.settings, &())?;
    named.spare(session.files().iter().map(PathBuf::as_path))?;
    ShownWarnings::Summary.show(session.warnings(), &job.scene_path);
    // Light from points or single directions is not met by chance.
    let lights = |estimator: &Method| match estimator.check_lights(session.scene()) {
        Ok(missing) => missing,
        Err(error) => Some(error.to_string()),
    };
    let rungs = estimators.iter().map(|&(name, estimator)| Rung {
        name,
        estimator,
        refused: lights(&estimator),
    });
    let rungs: Vec<Rung> = rungs.collect();
    let truth = rungs
        .iter()
        .rposition(|rung| rung.refused.is_none() && rung.estimator.finds_all_light());
    let truth = match (reference, truth) {
        (Some(image), _) => Truth::Image(image),
        (None, Some(rung)) => Truth::Rung(rung),
        (None, None) => return Err(no_truth(&estimators)),
    };
    let renderer = session.renderer()?;
    let _heeding = Heeding::begin();
    let (rows, reference) = renderer.accel().with(Ladder {
        session: &session,
        quiet: args.quiet,
        budget: args
            .time
            .map_or(Budget::Samples(args.spp.unwrap_or(USUAL_SAMPLES)), Budget::Seconds),
        truth,
        rungs,
    })?;

    let [sheet, csv, markdown] = &outputs;
    let mut panels: Vec<Panel> = rows.iter().map(Row::panel).collect();
    if let Some((name, image)) = &reference {
        panels.push(Panel {
            label: vec!["reference".into(), name.clone()],
            image: image.clone(),
        });
    }
    write_contact_sheet(sheet, &panels, COLUMNS)?;
    let table = markdown_table(&rows);
    csv.write(|w| std::io::Write::write_all(w, csv_table(&rows).as_bytes()))?;
    markdown.write(|w| std::io::Write::write_all(w, table.as_bytes()))?;
    if !args.quiet {
        out!("{table}");
        let names = outputs.each_ref().map(|o| o.path().display().to_string());
        errln!("-> {}", names.join(", "));
    }
    if reference.is_none() {
        let words = "interrupted while the reference was made: what is written has no errors in it";
        return Err(CliError::Interrupted(words.into()));
    }
    Ok(ExitCode::SUCCESS)
}

/// Writes the sheet of bounces.
fn bounces(args: &LabArgs, prefix: &Path) -> Result<ExitCode, CliError> {
    let output = Output::prepare(&with_extension(prefix, "png"))?;
    let mut named = Outputs::default();
    named.add("-o", &output)?;
    named.spare([&*args.scene])?;
    let mut job = Job::new(&render_args(args))?;
    job.settings.spp = args.spp.unwrap_or(USUAL_SAMPLES);
    write_sheet(job, &output, &named, args.quiet)?;
    Ok(ExitCode::SUCCESS)
}

/// `prefix.extension`, whatever dots the prefix has.
fn with_extension(prefix: &Path, extension: &str) -> PathBuf {
    let mut name = prefix.as_os_str().to_owned();
    name.push(format!(".{extension}"));
    name.into()
}

/// The render command that differs from a rung by its estimator alone.
fn render_args(args: &LabArgs) -> RenderArgs {
    RenderArgs {
        scene: args.scene.clone(),
        sampling: Flags(SamplingOptions {
            samples: args.spp,
            seed: args.seed,
            backend: args.backend,
            // The picture's noise is measured, not looked at.
            denoise: Some(Denoising::Off),
            ..SamplingOptions::default()
        }),
        size: args.size,
        threads: args.threads,
        quiet: args.quiet,
        integrator: Flags(IntegratorOptions {
            integrator: Some(IntegratorKind::Path),
            max_depth: args.max_depth,
            ..IntegratorOptions::default()
        }),
        ..RenderArgs::default()
    }
}

/// The steps of the ladder, each with one idea more than the one before.
fn ladder(best: &IntegratorOptions) -> Vec<(&'static str, Method)> {
    let alone = IntegratorOptions {
        reuse: Some(PathReuse::None),
        ..*best
    };
    let endless = Some(u32::MAX);
    let step = |directions, direct, mis, roulette_depth| IntegratorOptions {
        directions: Some(directions),
        direct: Some(direct),
        mis: Some(mis),
        roulette_depth,
        ..alone
    };
    let naive = IntegratorOptions {
        integrator: Some(IntegratorKind::Naive),
        roulette_depth: endless,
        ..*best
    };
    let (power, roulette) = (Heuristic::Power, best.roulette_depth);
    let steps = [
        ("naive: emit or reflect", naive),
        (
            "uniform directions",
            step(Directions::Uniform, DirectLight::None, power, endless),
        ),
        (
            "+ cosine directions",
            step(Directions::Cosine, DirectLight::None, power, endless),
        ),
        (
            "+ Russian roulette",
            step(Directions::Cosine, DirectLight::None, power, roulette),
        ),
        (
            "+ light sampling",
            step(Directions::Cosine, DirectLight::Light, power, roulette),
        ),
        (
            "+ MIS",
            step(Directions::Cosine, DirectLight::Mis, Heuristic::Balance, roulette),
        ),
        ("+ BSDF, power", alone),
        ("best: + shared paths", *best),
    ];
    steps.map(|(name, options)| (name, Method::new(&options))).into()
}

/// The integrators `kinds`, each as it is by default.
fn methods(best: &IntegratorOptions, kinds: &[IntegratorKind]) -> Vec<(&'static str, Method)> {
    let method = |&kind: &IntegratorKind| {
        let options = IntegratorOptions {
            integrator: Some(kind),
            ..*best
        };
        (name_of(IntegratorKind::NAMES, kind), Method::new(&options))
    };
    kinds.iter().map(method).collect()
}

/// Of estimators none of which may be taken for the truth.
fn no_truth(estimators: &[(&'static str, Method)]) -> CliError {
    let names: Vec<&str> = estimators.iter().map(|(name, _)| *name).collect();
    CliError::Usage(format!(
        "--methods {}: none of them is sure to find all light of this scene without bias, so that none makes a reference\n  \
         help: give --reference FILE, or add a method such as bdpt or path",
        names.join(",")
    ))
}

/// What is compared.
struct Rung {
    name: &'static str,
    estimator: Method,
    /// Why it is not rendered.
    refused: Option<String>,
}

/// What all are compared with.
enum Truth {
    Image(RgbImage),
    /// That rung, with more samples.
    Rung(usize),
}

/// What every rung may spend.
#[derive(Clone, Copy)]
enum Budget {
    Samples(u32),
    Seconds(f64),
}

/// What came out of a rung.
struct Row {
    name: &'static str,
    /// Why it was not rendered.
    refused: Option<String>,
    samples: u32,
    seconds: f64,
    image: RgbImage,
    /// `None` where there is no reference.
    rel_mse: Option<f64>,
}

impl Row {
    fn efficiency(&self) -> Option<f64> {
        Some(1.0 / (self.rel_mse? * self.seconds))
    }

    fn panel(&self) -> Panel {
        let figures = match &self.refused {
            Some(_) => vec!["cannot find this light".into()],
            None => {
                let error = self.rel_mse.map(|error| format!("relMSE {error:.3e}"));
                let spent = format!("{} samples, {:.2} s", self.samples, self.seconds);
                [spent].into_iter().chain(error).collect()
            }
        };
        Panel {
            label: [vec![self.name.to_string()], figures].concat(),
            image: self.image.clone(),
        }
    }
}

struct Ladder<'a> {
    session: &'a Session,
    quiet: bool,
    budget: Budget,
    truth: Truth,
    rungs: Vec<Rung>,
}

impl AccelTask for Ladder<'_> {
    /// The rows, and the reference with its name, if it was not interrupted.
    type Output = Result<(Vec<Row>, Option<(String, RgbImage)>), CliError>;

    fn run<A: Dispatch>(self, accel: &A) -> Self::Output {
        let settings = self.session.settings();
        let mut rows = Vec::new();
        for rung in &self.rungs {
            let (film, samples, seconds) = if rung.refused.is_some() {
                (Film::new(settings.resolution, settings.crop()), 0, 0.0)
            } else {
                self.spend(accel, &rung.estimator, self.budget, settings.seed, rung.name)?
            };
            rows.push(Row {
                name: rung.name,
                refused: rung.refused.clone(),
                samples,
                seconds,
                image: RgbImage::from(&film.develop()),
                rel_mse: None,
            });
        }

        // The reference has numbers of its own, so that no error is shared.
        let (name, reference) = match &self.truth {
            Truth::Image(image) => ("as given".into(), image.clone()),
            Truth::Rung(rung) => {
                let (row, rung) = (&rows[*rung], &self.rungs[*rung]);
                let samples = row.samples.saturating_mul(REFERENCE_FACTOR);
                let name = format!("{}, {samples} samples", rung.name);
                if !self.quiet {
                    let seconds = row.seconds * REFERENCE_FACTOR as f64;
                    errln!("reference: {name} of another seed, about {seconds:.0} s");
                }
                let seed = settings.seed.wrapping_add(1);
                match self.spend(accel, &rung.estimator, Budget::Samples(samples), seed, "reference") {
                    Ok((film, ..)) => (name, RgbImage::from(&film.develop())),
                    // What was rendered is there.
                    Err(CliError::Interrupted(_)) => return Ok((rows, None)),
                    Err(error) => return Err(error),
                }
            }
        };
        for row in rows.iter_mut().filter(|row| row.refused.is_none()) {
            let errors = Errors::new(&row.image, &reference);
            let errors = errors.map_err(|e| CliError::Failed(format!("--reference: {e}")))?;
            row.rel_mse = Some(errors.rel_mse);
        }
        Ok((rows, Some((name, reference))))
    }
}

impl Ladder<'_> {
    /// Renders within the budget; the film, the samples of each pixel and the seconds that took.
    fn spend<A: Dispatch>(
        &self,
        accel: &A,
        estimator: &Method,
        budget: Budget,
        seed: u64,
        name: &'static str,
    ) -> Result<(Film, u32, f64), CliError> {
        let settings = self.session.settings();
        let sampler = estimator.sampler(settings.sampler, seed, settings.spp);
        let prepared = Prepared::new(settings.resolution, seed);
        let mut film = Film::new(settings.resolution, settings.crop());
        let most = match budget {
            Budget::Samples(n) => n,
            Budget::Seconds(_) => 0,
        };
        let progress = Progress::new(settings.crop().area() * most as u64, self.quiet || most == 0);
        let start = Instant::now();
        let (mut done, mut is_last) = (0, false);
        loop {
            // As many samples as the rest of the budget is good for, judged by those there are
            let elapsed = start.elapsed().as_secs_f64();
            let next = match budget {
                Budget::Samples(n) => n - done,
                Budget::Seconds(_) if done == 0 => 1,
                Budget::Seconds(s) => ((s - elapsed) * done as f64 / elapsed).clamp(0.0, done as f64) as u32,
            };
            if next == 0 || is_last {
                break;
            }
            // What follows on a step that ends between cuts would take its last samples once more: such a step is the last.
            let cut = last_cut(done + next);
            is_last = cut <= done;
            let end = if is_last { done + next } else { cut };
            let world = self.session.world(accel);
            let (outcome, _) = self
                .session
                .install(|| estimator.render((world, &prepared), &sampler, &mut film, end, None, &progress));
            done = end;
            if outcome == Outcome::Stopped || progress.should_stop() {
                progress.finish();
                let words = format!("interrupted during `{name}`; nothing is written");
                return Err(CliError::Interrupted(words));
            }
        }
        let seconds = start.elapsed().as_secs_f64();
        progress.finish();
        Ok((film, done, seconds))
    }
}

fn csv_table(rows: &[Row]) -> String {
    let mut text = String::from("estimator,samples,seconds,relmse,efficiency\n");
    for row in rows.iter().filter(|row| row.refused.is_none()) {
        let _ = writeln!(
            text,
            "\"{}\",{},{:.4},{},{}",
            row.name,
            row.samples,
            row.seconds,
            row.rel_mse.map_or(String::new(), |error| format!("{error:.6e}")),
            row.efficiency().map_or(String::new(), |e| format!("{e:.6e}"))
        );
    }
    text
}

fn markdown_table(rows: &[Row]) -> String {
    let mut text = String::from("| estimator | samples | seconds | relMSE | efficiency |\n|---|---|---|---|---|\n");
    for row in rows {
        let _ = match &row.refused {
            Some(why) => {
                let why = why.lines().next().unwrap_or_default();
                writeln!(text, "| {} | not rendered: {why} | | | |", row.name)
            }
            None => writeln!(
                text,
                "| {} | {} | {:.2} | {} | {} |",
                row.name,
                row.samples,
                row.seconds,
                row.rel_mse.map_or(String::new(), |error| format!("{error:.3e}")),
                row.efficiency().map_or(String::new(), |e| format!("{e:.3}"))
            ),
        };
    }
    text
}
