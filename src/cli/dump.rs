//! `--dump-scene`: writes a scene file that renders the same picture as this command. The file is
//! written after the scene is loaded, before the first sample.
//!
//! The file has camera, image, render options, objects, lights, materials and patches, if scene
//! files have keys for them. Flags for a single run are not written: `--crop`, `--samples`,
//! `--noise`, `--time-limit`, `--aov`, `--threads` and the outputs.

use super::error::CliError;
use super::job::Job;
use crate::files::Output;
use crate::io::DEFAULT_LIGHT;
use crate::options::{BackgroundOptions, SizeOptions, ToneOptions};
use crate::scene_file::{LightSection, SceneOptions};
use crate::session::Session;

/// Writes the scene of `job` as rendered by `session`.
pub(super) fn write_scene(output: &Output, job: &Job, session: &Session) -> Result<(), CliError> {
    let size = session.settings().resolution;
    let tone = job.options.tone;
    let scene = session.lit_file().unwrap_or(&job.scene);
    let options = SceneOptions {
        size: SizeOptions {
            width: Some(size.x),
            height: Some(size.y),
        },
        background: BackgroundOptions {
            background: Some(session.settings().background),
        },
        tone: ToneOptions {
            exposure: tone.exposure.map(|_| session.settings().tone.exposure),
            ..tone
        },
        load: scene.load.parameters,
        ..job.options
    };
    let mut file = scene.with(&options, session.camera_description())?;
    if session.warnings().iter().any(|warning| warning.kind == DEFAULT_LIGHT) {
        file.light.push(LightSection::default_light());
    }
    let text = format!(
        "# Written by embrasure {} --dump-scene.\n{}",
        env!("CARGO_PKG_VERSION"),
        file.to_toml(output.path())?
    );
    output.write(|writer| std::io::Write::write_all(writer, text.as_bytes()))?;
    Ok(())
}
