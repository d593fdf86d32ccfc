//! `embrasure paths`: the paths that light a pixel, with their densities, weights and
//! contributions.
//!
//! `recording` traces samples and records their events. `builder` makes vertices and contributions
//! from the events (`trace`). `json`, `obj` and `svg` write the traces. `render --pixel --json`
//! prints the same numbers.

mod builder;
mod json;
mod obj;
mod recording;
mod svg;
mod trace;

use super::args::{PathsArgs, RenderArgs};
use super::error::CliError;
use super::job::Job;
use super::outputs::Outputs;
use super::printing;
use super::progress::LoadingBar;
use super::warnings::ShownWarnings;
use crate::color::Spectrum;
use crate::files::Output;
use crate::film::Rect;
use crate::math::{UVec2, list};
use crate::sampler::SampleKey;
use crate::session::{Renderer, Session};
use recording::record;
use serde_json::{Value, json};
use std::io::Write;
use std::path::PathBuf;
use std::process::ExitCode;
use trace::{Technique, Trace};

/// Records the paths of a pixel and writes them.
pub(super) fn paths(args: &PathsArgs) -> Result<ExitCode, CliError> {
    let mut outputs = Outputs::default();
    let files = args.output.iter().map(|path| outputs.prepare("-o", path));
    let files: Vec<Output> = files.collect::<Result<_, _>>()?;
    outputs.refuse_inputs([&*args.scene])?;
    let job = Job::to_show(&render_args(args))?;
    let loading = LoadingBar::new(args.quiet);
    let session = Session::load(&job.scene, job.settings.clone(), &loading);
    loading.finish();
    let session = session?;
    session.check_one_view("pixel", &format!("{},{}", args.pixel[0], args.pixel[1]))?;
    outputs.refuse_inputs(session.files().iter().map(PathBuf::as_path))?;
    ShownWarnings::Summary.show(session.warnings(), &job.scene_path);
    let renderer = session.renderer()?;
    let [first, end] = args.samples.unwrap_or([args.sample, args.sample.saturating_add(1)]);
    let traces = traces(&renderer, args.pixel, first..end)?;

    if args.json {
        outln!("{:#}", facts(&renderer, args.pixel, &traces));
    } else {
        print_text(&renderer, args, &traces);
    }
    for output in files {
        let extension = output.path().extension().map(|e| e.to_string_lossy().to_lowercase());
        let text = match extension.as_deref() {
            Some("json") => format!("{:#}\n", facts(&renderer, args.pixel, &traces)),
            Some("obj") => obj::text(&traces),
            _ => svg::text(&session, args.pixel, &traces),
        };
        output.write(|writer| writer.write_all(text.as_bytes()))?;
    }
    Ok(ExitCode::SUCCESS)
}

/// Arguments of the equivalent render.
fn render_args(args: &PathsArgs) -> RenderArgs {
    RenderArgs {
        scene: args.scene.clone(),
        sampling: args.sampling,
        filter: args.filter,
        size: args.size,
        threads: args.threads,
        quiet: args.quiet,
        integrator: args.integrator,
        camera: args.camera.clone(),
        load: args.load.clone(),
        ..RenderArgs::default()
    }
}

/// Traces of `samples`, with only the light that reaches the pixel.
pub(super) fn traces(
    renderer: &Renderer,
    [x, y]: [u32; 2],
    samples: std::ops::Range<u32>,
) -> Result<Vec<(u32, Vec<Trace>)>, CliError> {
    key([x, y], samples.start, renderer.session().settings().crop())?;
    renderer.prepare();
    Ok(samples
        .map(|sample| (sample, record(renderer, UVec2::new(x, y), sample)))
        .collect())
}

/// Sample key of `--pixel` and `--sample`.
pub(super) fn key([x, y]: [u32; 2], sample: u32, crop: Rect) -> Result<SampleKey, CliError> {
    if crop.contains(UVec2::new(x, y)) {
        return Ok(SampleKey::new(x, y, sample));
    }
    Err(CliError::Usage(format!(
        "--pixel {x},{y} is outside the image\n  help: columns {} to {}, rows {} to {}",
        crop.min.x,
        crop.max.x - 1,
        crop.min.y,
        crop.max.y - 1
    )))
}

/// Light of a sample: the sum of its traces.
pub(super) fn light_of(traces: &[Trace]) -> Spectrum {
    traces.iter().fold(Spectrum::ZERO, |sum, trace| sum + trace.sum())
}

/// All recorded samples of `pixel` as JSON.
pub(super) fn facts(renderer: &Renderer, pixel: [u32; 2], samples: &[(u32, Vec<Trace>)]) -> Value {
    let session = renderer.session();
    let sample = |(index, traces): &(u32, Vec<Trace>)| {
        json!({
            "sample": index,
            "radiance": json::color(light_of(traces)),
            "traces": traces.iter().map(|trace| json::trace(session, trace)).collect::<Vec<_>>(),
        })
    };
    json!({
        "version": env!("CARGO_PKG_VERSION"),
        "scene_hash": session.scene_hash(),
        "integrator": session.settings().chosen_integrator().name(),
        "settings": session.settings().describe(),
        "pixel": pixel,
        "samples": samples.iter().map(sample).collect::<Vec<_>>(),
    })
}

fn print_text(renderer: &Renderer, args: &PathsArgs, samples: &[(u32, Vec<Trace>)]) {
    let integrator = renderer.session().settings().chosen_integrator();
    outln!("pixel {},{}: {}", args.pixel[0], args.pixel[1], integrator.describe());
    for (sample, traces) in samples {
        let light = light_of(traces);
        let count = |of: fn(&Trace) -> usize| traces.iter().map(of).sum::<usize>() as u64;
        outln!(
            "sample {sample}: {}, {}, {}; radiance {}",
            printing::count(traces.len() as u64, "path"),
            match count(|trace| trace.vertices.len()) {
                1 => "1 vertex".into(),
                n => format!("{n} vertices"),
            },
            printing::count(count(|trace| trace.contributions.len()), "contribution"),
            list(&light.to_array())
        );
        let mut largest: Vec<_> = traces.iter().flat_map(|trace| &trace.contributions).collect();
        largest.sort_by(|a, b| b.radiance.luminance().total_cmp(&a.radiance.luminance()));
        for contribution in largest.iter().take(MAX_SHOWN) {
            let how = match contribution.technique {
                Technique::Connection(s, t, weight, _) => format!("connection s = {s}, t = {t}, MIS weight {weight}"),
                Technique::Shared([x, y], _) => format!("shared path of pixel {x},{y}"),
                other => other.name().into(),
            };
            outln!("  {} by {how}", list(&contribution.radiance.to_array()));
        }
        if largest.len() > MAX_SHOWN {
            outln!("  and {} smaller", largest.len() - MAX_SHOWN);
        }
    }
}

/// Maximum number of printed contributions of a sample.
const MAX_SHOWN: usize = 8;
