//! `embrasure lab`: one scene rendered by several estimators, each compared with a reference.
//!
//! `contenders` lists the estimators, `lessons` describes them, and `budget` limits their samples
//! or time. `renderer` orders the renders and makes the reference. `runs` renders an estimator,
//! with a snapshot at each point of the curves. `verdict` checks the reference. `tables`, `sheet`,
//! `curves` and `page` write the result.

mod bounces;
mod budget;
mod contenders;
mod curves;
mod lessons;
mod page;
mod renderer;
mod runs;
mod sheet;
mod tables;
mod verdict;

use crate::cli::args::{Flags, LabArgs, RenderArgs};
use crate::cli::error::CliError;
use crate::cli::job::Job;
use crate::cli::outputs::Outputs;
use crate::cli::plot::SvgTarget;
use crate::cli::printing;
use crate::cli::progress::{InterruptGuard, is_interrupted};
use crate::cli::warnings::{ShownWarnings, note_middle_eye};
use crate::color::Tone;
use crate::compare::Errors;
use crate::files::{MemoryLimit, Output, in_words};
use crate::io::write_contact_sheet;
use crate::options::{Denoising, IntegratorKind, IntegratorOptions, SamplingOptions};
use crate::session::{Session, Settings};
use budget::Budget;
use contenders::{Contender, idle_keys, ladder, methods};
use renderer::{ContenderRenderer, Reference};
use runs::{ContenderRun, Snapshot};
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use verdict::Verdict;

/// Results of a comparison.
struct Comparison {
    /// The scene as the user named it.
    scene: String,
    /// Width and height of the pictures in pixels.
    size: [usize; 2],
    budgets: Vec<Budget>,
    runs: Vec<(Contender, ContenderRun)>,
    /// `None` if an interrupt ended the render of the reference.
    reference: Option<Reference>,
    /// Tone of the pictures.
    tone: Tone,
    /// Verdict on the reference.
    verdict: Verdict,
}

impl Comparison {
    /// Estimators with at least one snapshot.
    fn rendered(&self) -> impl Iterator<Item = (&Contender, &ContenderRun)> {
        let runs = self.runs.iter().map(|(contender, run)| (contender, run));
        runs.filter(|(_, run)| !run.snapshots.is_empty())
    }
}

/// Files that `embrasure lab` writes.
struct LabFiles {
    sheet: Output,
    csv: Output,
    markdown: Output,
    curves_csv: Output,
    curves: Output,
    page: Option<Output>,
}

/// Renders all contenders and writes the results.
pub(in crate::cli) fn lab(args: &LabArgs) -> Result<ExitCode, CliError> {
    if args.bounces {
        return sheet_of_bounces(args);
    }
    // All arguments are checked before the first ray.
    let mut named = Outputs::default();
    let files = LabFiles::prepare(args, &mut named)?;
    named.refuse_inputs([Some(&*args.scene), args.reference.as_deref()].into_iter().flatten())?;
    let budgets = Budget::of(&args.spp, &args.time);
    let job = Job::to_compare(&render_args(args, &budgets))?;
    let given = args
        .reference
        .as_deref()
        .map(|path| Reference::read(path, &job.settings))
        .transpose()?;
    let mut contenders = if args.methods.is_empty() {
        ladder(&job.settings)
    } else {
        methods(&job.settings, &args.methods)
    };
    for contender in &contenders {
        let checked = contender.settings.check().map_err(CliError::from);
        checked.map_err(|error| named_error(contender, error))?;
    }
    if given.is_none() && !contenders.iter().any(Contender::finds_all_light) {
        return Err(no_reference(&contenders));
    }
    let session = Session::load(&job.scene, job.settings.clone(), &())?;
    named.refuse_inputs(session.files().iter().map(PathBuf::as_path))?;
    ShownWarnings::Summary.show(session.warnings(), &job.scene_path);
    note_middle_eye(&session);
    check_memory(&session, &job, contenders.len(), &budgets)?;
    for flag in &args.methods {
        let integrator = flag.name.split(':').next().unwrap_or_default();
        idle_keys(flag)
            .iter()
            .for_each(|key| printing::warning(format_args!("{}: {integrator} does not use {key}", flag.name)));
    }
    contenders.iter_mut().for_each(|contender| contender.judge(&session));
    let truth = contenders.iter().rposition(Contender::finds_all_light);
    if given.is_none() && truth.is_none() {
        return Err(no_reference(&contenders));
    }

    let _interrupts = InterruptGuard::begin();
    let mut renderer = ContenderRenderer {
        job: &job,
        quiet: args.quiet,
        session: Some(session),
    };
    let runs = renderer.runs(contenders, &budgets)?;
    runs.iter()
        .filter_map(|(contender, run)| Some((contender, run.overspent(&budgets)?)))
        .for_each(|(contender, [seconds, budget])| {
            printing::warning(format_args!(
                "{}: one sample per pixel takes {} s, with preparation and denoising: more than --time {budget}s\n  \
                 help: allow more time, or render fewer pixels with --size",
                contender.name,
                printing::measured(seconds)
            ));
        });
    if runs.iter().all(|(_, run)| run.snapshots.is_empty()) && is_interrupted() {
        let words = "interrupted before the first sample: nothing is written";
        return Err(CliError::Interrupted(words.into()));
    }
    let reference = match (given, truth.map(|truth| &runs[truth])) {
        (Some(given), _) => Some(given),
        (None, Some((contender, run))) if !is_interrupted() => renderer.reference(contender, run)?,
        _ => None,
    };
    let tone = runs
        .iter()
        .rev()
        .find(|(_, run)| !run.snapshots.is_empty())
        .map(|(_, run)| run.tone);
    let mut comparison = Comparison {
        scene: args.scene.display().to_string(),
        size: job.settings.crop().size().as_usizevec2().to_array(),
        budgets,
        runs,
        reference,
        tone: tone.unwrap_or_default(),
        verdict: Verdict::default(),
    };
    comparison.measure()?;
    comparison.judge(&mut renderer, &job.settings)?;
    files.write(&comparison, args.quiet)?;
    for fault in &comparison.verdict.faults {
        printing::warning(format_args!("{}\n  help: {}", fault.text(), fault.help()));
    }
    if let Some(reason) = &comparison.verdict.unchecked {
        printing::note(format_args!(
            "the reference was not checked for missing light: {reason}"
        ));
    }
    if is_interrupted() {
        Err(CliError::Interrupted(comparison.interruption()))
    } else {
        Ok(ExitCode::SUCCESS)
    }
}

/// Writes the sheet with the light of each bounce, instead of a comparison.
fn sheet_of_bounces(args: &LabArgs) -> Result<ExitCode, CliError> {
    let mut named = Outputs::default();
    let output = named.prepare("-o", &output_path(args, ".png"))?;
    named.refuse_inputs([&*args.scene])?;
    let budgets = Budget::of(&args.spp, &[]);
    bounces::write_sheet(
        Job::to_compare(&render_args(args, &budgets))?,
        &output,
        &named,
        args.quiet,
    )?;
    Ok(ExitCode::SUCCESS)
}

/// Path of an output: the common prefix of all outputs, then `ending`. Dots in the prefix are kept.
fn output_path(args: &LabArgs, ending: &str) -> PathBuf {
    let mut name = match &args.output {
        Some(prefix) => prefix.clone().into_os_string(),
        None => {
            let stem = args.scene.file_stem().unwrap_or_default();
            format!("{}-lab", Path::new(stem).display()).into()
        }
    };
    name.push(ending);
    name.into()
}

impl LabFiles {
    fn prepare(args: &LabArgs, named: &mut Outputs) -> Result<Self, CliError> {
        let mut output = |ending: &str| named.prepare("-o", &output_path(args, ending));
        Ok(Self {
            sheet: output(".png")?,
            csv: output(".csv")?,
            markdown: output(".md")?,
            curves_csv: output("-curves.csv")?,
            curves: output("-curves.svg")?,
            page: args
                .html
                .as_deref()
                .map(|path| named.prepare("--html", path))
                .transpose()?,
        })
    }

    /// Writes all files, and prints the table.
    fn write(&self, comparison: &Comparison, quiet: bool) -> Result<(), CliError> {
        let (panels, columns) = comparison.panels();
        write_contact_sheet(&self.sheet, &panels, columns)?;
        let table = comparison.table();
        let texts = [
            (&self.csv, comparison.csv()),
            (&self.markdown, comparison.markdown()),
            (&self.curves_csv, comparison.curves_csv()),
            (&self.curves, curves::svg(comparison, SvgTarget::File)),
        ];
        for (output, text) in &texts {
            output.write(|w| w.write_all(text.as_bytes()))?;
        }
        if let Some(output) = &self.page {
            output.write(|w| page::write(w, comparison))?;
        }
        if !quiet {
            out!("{table}");
            let outputs = [&self.sheet]
                .into_iter()
                .chain(texts.iter().map(|(output, _)| *output))
                .chain(&self.page);
            let names: Vec<String> = outputs.map(|output| output.path().display().to_string()).collect();
            errln!("-> {}", names.join(", "));
        }
        Ok(())
    }
}

/// Arguments of a render of the scene. Each contender changes some settings of this render.
fn render_args(args: &LabArgs, budgets: &[Budget]) -> RenderArgs {
    let samples = budgets.iter().rev().find_map(|budget| match budget {
        Budget::Samples(samples) => Some(*samples),
        Budget::Seconds(_) => None,
    });
    RenderArgs {
        scene: args.scene.clone(),
        sampling: Flags(SamplingOptions {
            samples,
            seed: args.seed,
            backend: args.backend,
            // The picture is not used, so it is not denoised.
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
        camera: args.camera.clone(),
        load: args.load.clone(),
        ..RenderArgs::default()
    }
}

/// Returns an error if the snapshots of `contenders` estimators exceed the memory.
fn check_memory(session: &Session, job: &Job, contenders: usize, budgets: &[Budget]) -> Result<(), CliError> {
    let pictures = contenders as u64 * Budget::snapshots(budgets) + 1;
    let bytes = pictures * job.settings.crop().area() * size_of::<[f32; 3]>() as u64;
    let limit = MemoryLimit::of(job.scene.load.max_memory);
    match MemoryLimit::refusal(limit, session.memory() + bytes, bytes) {
        None => Ok(()),
        Some(refusal) => Err(CliError::Failed(format!(
            "the pictures of all estimators take about {}: {refusal}\n  help: use a smaller --size, or compare fewer --methods",
            in_words(bytes)
        ))),
    }
}

/// `error` with the name of `contender` before its text, if the contender is a method with
/// settings.
fn named_error(contender: &Contender, error: CliError) -> CliError {
    match error {
        CliError::Usage(words) if contender.name.contains(':') => {
            CliError::Usage(format!("{}: {words}", contender.name))
        }
        other => other,
    }
}

/// Error if no estimator can make the reference.
fn no_reference(contenders: &[Contender]) -> CliError {
    let names: Vec<&str> = contenders.iter().map(|contender| contender.name.as_str()).collect();
    CliError::Usage(format!(
        "--methods {}: none of these finds all light of this scene without bias, so none can render the reference\n  \
         help: give --reference FILE, or add a method such as bdpt or path",
        names.join(",")
    ))
}

impl Comparison {
    /// Compares all pictures with the reference, if there is one.
    fn measure(&mut self) -> Result<(), CliError> {
        let Some(reference) = &self.reference else {
            return Ok(());
        };
        for snapshot in self.runs.iter_mut().flat_map(|(_, run)| &mut run.snapshots) {
            let errors = Errors::new(&snapshot.image, &reference.image);
            let errors = errors.map_err(|e| CliError::Failed(format!("--reference: {e}")))?;
            snapshot.rel_mse = Some(errors.rel_mse);
            snapshot.block_rel_mse = Some(errors.block_rel_mse[1]);
        }
        Ok(())
    }

    /// Judges the reference, if there is one.
    fn judge(&mut self, renderer: &mut ContenderRenderer, base: &Settings) -> Result<(), CliError> {
        if let Some(reference) = self.reference.as_ref().filter(|_| !is_interrupted()) {
            let last = || self.rendered().filter_map(|(_, run)| run.snapshots.last());
            let samples = last().map(|snapshot| snapshot.samples).max().unwrap_or(1);
            let smallest = last()
                .filter_map(|snapshot: &Snapshot| snapshot.rel_mse)
                .min_by(f64::total_cmp);
            self.verdict = Verdict::new(renderer, base, reference, (samples, smallest))?;
        }
        Ok(())
    }

    /// Text that names the results that are missing after an interrupt.
    fn interruption(&self) -> String {
        let is_missing = |(contender, run): &&(Contender, ContenderRun)| {
            contender.refused.is_none() && (run.is_interrupted || run.snapshots.is_empty())
        };
        let during = match self.runs.iter().find(is_missing) {
            Some((contender, _)) => format!("interrupted during `{}`", contender.name),
            None => "interrupted during the reference".into(),
        };
        let errors = match self.reference {
            Some(_) => "the estimators that were complete are written",
            None => "the files have no errors against a reference",
        };
        format!("{during}: {errors}")
    }
}
