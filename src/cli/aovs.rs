use super::error::CliError;
use crate::film::Aov;
use crate::io::{SceneFile, name_of};
use crate::session::Estimator;

/// The further channels that `--aov` wants. Where there are no groups of lights, `all` is all others; whoever names them hears of it later.
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
    let is_named = wanted.iter().any(|w| w == name_of(Aov::NAMES, Aov::Lights));
    let is_wanted = |(name, _): &&(&str, Aov)| wanted.iter().any(|w| w == name || w == "all");
    let known = Aov::NAMES.iter().filter(is_wanted).map(|&(_, aov)| aov);
    Ok(known
        .filter(|&aov| aov != Aov::Lights || has_lights || is_named)
        .collect())
}
