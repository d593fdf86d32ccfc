use super::error::CliError;
use crate::description::SceneFile;
use crate::film::Aov;
use crate::options::Method;

/// The further channels that `--aov` wants. `all` leaves out groups of lights where there are none, and strategies, which are hundreds of channels. A
/// channel that cannot be had is an error later.
pub(super) fn aovs(wanted: &[String], scene: &SceneFile, method: &Method) -> Result<Vec<Aov>, CliError> {
    let is_known = |name: &str| name == "all" || Aov::NAMES.iter().any(|(known, _)| *known == name);
    if let Some(unknown) = wanted.iter().find(|name| !is_known(name)) {
        let known: Vec<&str> = Aov::NAMES.iter().map(|(name, _)| *name).collect();
        return Err(CliError::Usage(format!(
            "--aov {unknown}: no such channels\n  help: use some of {}, or all",
            known.join(", ")
        )));
    }
    let is_of_all = |aov: Aov| match aov {
        Aov::Lights => scene.has_light_groups() && method.gathers_light(),
        Aov::Strategies => false,
        _ => true,
    };
    let is_named = |name: &str| wanted.iter().any(|w| w == name);
    let known = Aov::NAMES.iter();
    let chosen = known.filter(|(name, aov)| is_named(name) || (is_named("all") && is_of_all(*aov)));
    Ok(chosen.map(|&(_, aov)| aov).collect())
}
