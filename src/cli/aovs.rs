use super::error::CliError;
use crate::film::Aov;
use crate::io::SceneFile;
use crate::session::{Estimator, name_of};

/// The further channels that `--aov` wants, in the order in which they are listed. Where there are no groups of lights, `all` is all others.
pub(super) fn aovs(wanted: &[String], scene: &SceneFile, estimator: &Estimator) -> Result<Vec<Aov>, CliError> {
    let is_known = |name: &str| name == "all" || Aov::NAMES.iter().any(|(known, _)| *known == name);
    if let Some(unknown) = wanted.iter().find(|name| !is_known(name)) {
        let known: Vec<&str> = Aov::NAMES.iter().map(|(name, _)| *name).collect();
        return Err(CliError::Usage(format!(
            "--aov {unknown}: no such channels\n  help: use some of {}, or all",
            known.join(", ")
        )));
    }
    let has_lights = scene.has_light_groups() && estimator.gathers_light();
    if !has_lights && wanted.iter().any(|w| w == name_of(Aov::NAMES, Aov::Lights)) {
        let reason = match estimator.gathers_light() {
            true => {
                "this scene has no light groups\n  help: give a [[light]] a `group`, or add a [[light_group]]".into()
            }
            false => format!(
                "--integrator {} gathers no light\n  help: use path, naive, whitted, distributed or direct",
                estimator.name()
            ),
        };
        return Err(CliError::Usage(format!("--aov lights: {reason}")));
    }
    let is_wanted = |(name, _): &&(&str, Aov)| wanted.iter().any(|w| w == name || w == "all");
    let known = Aov::NAMES.iter().filter(is_wanted).map(|&(_, aov)| aov);
    Ok(known.filter(|&aov| aov != Aov::Lights || has_lights).collect())
}
