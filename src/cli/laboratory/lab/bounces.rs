//! The sheet of `embrasure lab --bounces`: the picture, and the separate light of each bounce.

use crate::cli::error::CliError;
use crate::cli::job::Job;
use crate::cli::outputs::Outputs;
use crate::cli::printing::count;
use crate::cli::progress::{InterruptGuard, Progress};
use crate::cli::warnings::ShownWarnings;
use crate::color::Spectrum;
use crate::files::Output;
use crate::film::{Image, RgbImage};
use crate::io::{Panel, write_contact_sheet};
use crate::light_paths::PathPart;
use crate::render::{Observer, Outcome};
use crate::session::Session;
use std::path::PathBuf;

/// Number of pictures in a row of the sheet.
const COLUMNS: usize = 4;

/// Renders `job` with separate bounces, and writes the sheet to `output`. `named` has all outputs,
/// including `output`.
pub(super) fn write_sheet(mut job: Job, output: &Output, named: &Outputs, quiet: bool) -> Result<(), CliError> {
    let bounces = PathPart::parse("bounces").map_err(|error| CliError::Failed(error.to_string()))?;
    job.settings.light_paths = bounces;
    job.settings.noise = None;
    let session = Session::load(&job.scene, job.settings, &())?;
    named.refuse_inputs(session.files().iter().map(PathBuf::as_path))?;
    ShownWarnings::Summary.show(session.warnings(), &job.scene_path);
    let renderer = session.renderer()?;
    let mut state = renderer.start();

    let _interrupts = InterruptGuard::begin();
    let settings = session.settings();
    let progress = Progress::new(settings.crop().area() * u64::from(settings.spp), quiet);
    let outcome = renderer.render(&mut state, &progress);
    let is_stopped = outcome == Outcome::Stopped || progress.should_stop();
    progress.finish();
    if is_stopped {
        return Err(CliError::Interrupted("interrupted; nothing is written".into()));
    }

    let image = renderer.develop(&state);
    let samples = count(settings.spp.into(), "sample");
    let mut panels = vec![Panel {
        label: vec!["picture: sum of all".into(), samples],
        image: RgbImage::from(&image),
    }];
    let whole = mean(&panels[0].image);
    for part in &settings.light_paths {
        let image = layer(&image, part.layer());
        let share = if whole > 0.0 { 100.0 * mean(&image) / whole } else { 0.0 };
        panels.push(Panel {
            label: vec![title(part.layer()), format!("{share:.1} % of the light")],
            image,
        });
    }
    write_contact_sheet(output, &panels, COLUMNS)?;
    if !quiet {
        errln!("-> {}", output.path().display());
    }
    Ok(())
}

/// Title of the picture of `layer`, such as `2 bounces`.
fn title(layer: &str) -> String {
    match layer.strip_prefix("bounce.") {
        Some("0") => "0 bounces: emission".into(),
        Some("1") => "1 bounce: direct light".into(),
        Some("rest") => "more bounces".into(),
        Some(count) => format!("{count} bounces"),
        None => layer.into(),
    }
}

/// The layer of `image` as a picture.
fn layer(image: &Image, name: &str) -> RgbImage {
    let channel = |c: &str| image.channel(&format!("{name}.{c}"));
    let channels = ["R", "G", "B"].map(|c| channel(c).map_or(&[][..], |channel| &channel.values));
    let size = image.crop.size();
    let value = |i: usize| channels.map(|values| values.get(i).copied().unwrap_or(0.0));
    RgbImage {
        width: size.x as usize,
        height: size.y as usize,
        pixels: (0..image.crop.area() as usize).map(value).collect(),
    }
}

/// Mean luminance of the image.
fn mean(image: &RgbImage) -> f64 {
    let luminance = |rgb: &[f32; 3]| f64::from(Spectrum::from(*rgb).luminance());
    image.pixels.iter().map(luminance).sum::<f64>() / image.pixels.len().max(1) as f64
}
