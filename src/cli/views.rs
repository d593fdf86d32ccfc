//! `embrasure views`: a contact sheet of candidate cameras, each with the flags to paste.

use super::args::{CameraArgs, Flags, RenderArgs, ViewsArgs};
use super::error::CliError;
use super::job::Job;
use super::outputs::Outputs;
use super::printing;
use super::progress::{InterruptGuard, LoadingBar, Progress, TimedProgress, is_interrupted};
use super::warnings::ShownWarnings;
use crate::color::srgb;
use crate::film::{RgbImage, metered};
use crate::guess::CameraGuess;
use crate::io::{Mark, Panel, edge_of_plan, write_contact_sheet, write_sheet_with_plan};
use crate::options::{CameraOptions, IntegratorKind, IntegratorOptions, SamplingOptions};
use crate::render::Outcome;
use crate::session::Session;
use serde_json::json;
use std::path::PathBuf;
use std::process::ExitCode;

/// Number of pictures in a row of the sheet.
const COLUMNS: usize = 4;
/// Default number of samples per pixel.
const SAMPLES: u32 = 16;
/// Default edge length of a picture in pixels.
const SIZE: u32 = 240;

/// Renders small pictures of the candidates, and writes the sheet.
pub(super) fn views(args: &ViewsArgs) -> Result<ExitCode, CliError> {
    if args.quiet {
        printing::hide_notes();
    }
    let render = RenderArgs {
        scene: args.scene.clone(),
        camera: CameraArgs(CameraOptions {
            view: args.view,
            ..CameraOptions::default()
        }),
        sampling: Flags(SamplingOptions {
            samples: Some(args.spp.unwrap_or(SAMPLES)),
            backend: args.backend,
            ..SamplingOptions::default()
        }),
        size: Some(args.size.unwrap_or([SIZE; 2])),
        threads: args.threads,
        quiet: args.quiet,
        load: args.load.clone(),
        integrator: Flags(IntegratorOptions {
            integrator: Some(IntegratorKind::Path),
            ..IntegratorOptions::default()
        }),
        ..RenderArgs::default()
    };
    let job = Job::to_show(&render)?;
    let mut named = Outputs::default();
    let output = args.output.as_deref();
    let output = output.map(|path| named.prepare("-o", path)).transpose()?;
    named.refuse_inputs([&*args.scene])?;
    let loading = LoadingBar::new(job.quiet);
    let session = Session::load(&job.scene, job.settings.clone(), &loading);
    loading.finish();
    let mut session = session?;
    named.refuse_inputs(session.files().iter().map(PathBuf::as_path))?;
    ShownWarnings::Summary.show(session.warnings(), &job.scene_path);

    let candidates = session.candidate_cameras()?;
    let origin = session.settings().camera.origin;
    if args.json {
        let list: Vec<_> = candidates
            .iter()
            .map(|(flags, camera)| json!({ "flags": flags, "camera": camera.flags(origin), "words": camera.words }))
            .collect();
        outln!("{:#}", json!(list));
    } else {
        for (i, (flags, _)) in candidates.iter().enumerate() {
            outln!("{:2}  {flags}", i + 1);
        }
    }
    let Some(output) = output else {
        return Ok(ExitCode::SUCCESS);
    };

    let plan = plan(&session, &candidates)?;
    let _interrupts = InterruptGuard::begin();
    let settings = session.settings().clone();
    let samples = settings.crop().area() * u64::from(settings.spp);
    let progress = Progress::new(samples * candidates.len() as u64, args.quiet);
    let timed = TimedProgress {
        progress: &progress,
        end: None,
        pause: None,
    };
    let mut panels = Vec::with_capacity(candidates.len());
    for (i, (flags, camera)) in candidates.iter().enumerate() {
        session.look_through(camera)?;
        let renderer = session.renderer()?;
        let mut state = renderer.start();
        if renderer.render(&mut state, &timed) != Outcome::Complete {
            progress.finish();
            return Err(CliError::Interrupted("interrupted: no sheet is written".into()));
        }
        // Denoise as in `render`, but keep the noisy picture if denoising fails
        let mut metadata = renderer.metadata(&state, true);
        let denoised = renderer.denoise_unless(renderer.develop(&state), &mut metadata, &is_interrupted);
        let image = denoised.unwrap_or_else(|_| renderer.develop(&state));
        let tone = metered(settings.tone, &image);
        let shown = |rgb| tone.encode_u8(rgb).map(|code| srgb::decode(f32::from(code) / 255.0));
        panels.push(Panel {
            label: vec![format!("{}  {flags}", i + 1)],
            image: RgbImage {
                width: image.crop.size().x as usize,
                height: image.crop.size().y as usize,
                pixels: image.rgb().map(shown).collect(),
            },
        });
    }
    progress.finish();
    match plan {
        Some((plan, marks)) => write_sheet_with_plan(&output, (&plan, &marks), &panels, COLUMNS)?,
        None => write_contact_sheet(&output, &panels, COLUMNS)?,
    }
    if !args.quiet {
        errln!("-> {}", output.path().display());
    }
    ShownWarnings::Summary.note_doubt_about_up(candidates.first().map(|(_, camera)| camera));
    Ok(ExitCode::SUCCESS)
}

/// The plan of an interior with the numbered cameras that stand in it.
fn plan(session: &Session, candidates: &[(String, CameraGuess)]) -> Result<Option<(Panel, Vec<Mark>)>, CliError> {
    let cameras: Vec<CameraGuess> = candidates.iter().map(|(_, camera)| camera.clone()).collect();
    // Leave out the cameras outside the interior, because they would be far from the plan. They are
    // the last candidates.
    let is_named = |flags: &str| flags.starts_with("--view") || flags.starts_with("--orbit");
    let inside = candidates.iter().take_while(|(flags, _)| !is_named(flags)).count();
    let edge = edge_of_plan(session.settings().resolution.x as usize, COLUMNS);
    let Some((plan, edges)) = session.plan(&cameras[..inside], edge)? else {
        return Ok(None);
    };
    let marks = (1..).zip(&plan.cameras).map(|(number, camera)| Mark {
        number,
        at: camera.at.into(),
        direction: camera.direction.into(),
    });
    let cameras = match inside {
        1 => "camera 1".into(),
        _ => format!("cameras 1 to {inside}"),
    };
    let marks = marks.collect();
    let mut label = vec![
        format!("plan with {cameras}, cut 1.2 m above the floor"),
        format!("{edges}; --stand puts the camera at any place"),
    ];
    let signs = [
        plan.has_openings
            .then_some("blue: openings to the outside at this height"),
        plan.has_sun.then_some("yellow arrow: direction of the sunlight"),
    ];
    let signs: Vec<&str> = signs.into_iter().flatten().collect();
    if !signs.is_empty() {
        label.push(signs.join("; "));
    }
    let image = plan.image;
    Ok(Some((Panel { label, image }, marks)))
}
