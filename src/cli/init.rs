//! `embrasure init`: a commented scene file for a bare OBJ.

use super::args::{InitArgs, RenderArgs};
use super::error::CliError;
use super::job::{Job, SceneKind, kind_of, read_scene};
use super::outputs::Outputs;
use super::printing;
use super::warnings::ShownWarnings;
use crate::io::{DEFAULT_LIGHT, FileError};
use crate::scene::SceneBuilder;
use crate::scene_file::{LEVELS, inspect_scene};
use crate::session::Session;
use std::io::Write;
use std::path::PathBuf;
use std::process::ExitCode;

/// Writes a scene file that renders the same picture as the OBJ. The file has all values, so that
/// users can edit them.
pub(super) fn init(args: &InitArgs) -> Result<ExitCode, CliError> {
    if let SceneKind::Toml = kind_of(&args.scene)? {
        let error = FileError::new(&args.scene, "this is already a scene file");
        let help = "give an .obj file; `embrasure render SCENE --dump-scene FILE.toml` writes a new scene file";
        return Err(error.help(help).into());
    }
    let file = read_scene(&args.scene, &args.load)?;
    let path = match &args.output {
        Some(path) => path.clone(),
        None => PathBuf::from(args.scene.file_stem().unwrap_or_default()).with_extension("toml"),
    };
    // A file system that fails to respond must not look like a missing file.
    if path.try_exists().unwrap_or(true) && !args.force {
        return Err(CliError::Usage(format!(
            "{} already exists\n  help: give another name with -o, or replace it with --force",
            path.display()
        )));
    }
    let mut outputs = Outputs::default();
    let output = outputs.prepare("-o", &path)?;

    let inspection = inspect_scene(&file, SceneBuilder::new());
    outputs.refuse_inputs(inspection.files.iter().map(PathBuf::as_path))?;
    if let Some(error) = inspection.findings.first_error() {
        return Err(error.clone().into());
    }
    // Leave out messages about defaults that the new scene file contains: light, and numbers of
    // subdivision steps.
    let mut warnings = inspection.findings.warnings();
    warnings.retain(|warning| ![DEFAULT_LIGHT, LEVELS].contains(&warning.kind));
    ShownWarnings::Summary.show(&warnings, &args.scene);
    let render = RenderArgs {
        scene: args.scene.clone(),
        camera: args.camera.clone(),
        ..RenderArgs::default()
    };
    let job = Job::to_show_scene(&render, file)?;
    let session = Session::load(&job.scene, job.settings.clone(), &())?;
    // The scene file also gets the options for reading files, which flags may have set.
    let scene = session.lit_file().unwrap_or(&job.scene);
    let mut options = job.options;
    options.background.background = Some(session.settings().background);
    options.tone.exposure = Some(session.settings().tone.exposure);
    options.load = scene.load.parameters;
    let text = scene.template(&options, session.camera_description(), &inspection, &path)?;
    output.write(|writer| writer.write_all(text.as_bytes()))?;
    outln!(
        "{}: {}; edit it, then `embrasure render {0}`",
        path.display(),
        printing::count(inspection.materials.len() as u64, "material")
    );
    Ok(ExitCode::SUCCESS)
}
