use super::error::CliError;
use crate::film::Aov;
use crate::io::SceneFile;
use crate::session::Estimator;

/// The further channels that `--aov` wants. `all` leaves out groups of lights where there are none, and strategies where there are none or too many; whoever
/// names them hears of it later.
pub(super) fn aovs(wanted: &[String], scene: &SceneFile, estimator: &Estimator) -> Result<Vec<Aov>, CliError> {
    let is_known = |name: &str| name == "all" || Aov::NAMES.iter().any(|(known, _)| *known == name);
    if let Some(unknown) = wanted.iter().find(|name| !is_known(name)) {
        let known: Vec<&str> = Aov::NAMES.iter().map(|(name, _)| *name).collect();
        return Err(CliError::Usage(format!(
            "--aov {unknown}: no such channels\n  help: use some of {}, or all",
            known.join(", ")
        )));
    }
    // What `all` leaves out where it cannot be had
    let is_there = |aov: Aov| match aov {
        Aov::Lights => scene.has_light_groups() && estimator.gathers_light(),
        Aov::Strategies => estimator.tells_strategies(),
        _ => true,
    };
    let is_named = |name: &str| wanted.iter().any(|w| w == name);
    let known = Aov::NAMES.iter();
    let chosen = known.filter(|(name, aov)| is_named(name) || (is_named("all") && is_there(*aov)));
    Ok(chosen.map(|&(_, aov)| aov).collect())
}
