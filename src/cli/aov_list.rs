use super::error::CliError;
use crate::film::Aov;
use crate::light_paths::{LightPathError, PathPart};
use crate::options::ChosenIntegrator;
use crate::scene_file::SceneFile;

/// Additional channels of `--aov`.
#[derive(Default)]
pub(super) struct AovList {
    pub aovs: Vec<Aov>,
    pub light_paths: Vec<PathPart>,
}

/// Returns the additional channels of `--aov`. The name `all` leaves out light groups and points
/// (photons or irradiance records) if the render has none. The name `all` never includes lines,
/// strategies and light paths: lines take many more rays, and strategies and light paths may be
/// hundreds of channels. A later check reports channels that are unavailable.
pub(super) fn aovs(wanted: &[String], scene: &SceneFile, integrator: &ChosenIntegrator) -> Result<AovList, CliError> {
    let wanted: Vec<&str> = wanted.iter().flat_map(|list| names(list)).collect();
    let mut light_paths = Vec::new();
    for name in wanted.iter().filter(|name| PathPart::is_name(name)) {
        let parts = PathPart::parse(name).and_then(|parts| PathPart::add(&mut light_paths, parts));
        parts.map_err(|LightPathError { message, help }| {
            CliError::Usage(format!("--aov {name}: {message}\n  help: {help}"))
        })?;
    }
    // Sort, so that the order of the channels does not depend on the order of the flags
    light_paths.sort_by_cached_key(PathPart::describe);

    let is_known = |name: &str| name == "all" || Aov::NAMES.iter().any(|(known, _)| *known == name);
    if let Some(unknown) = wanted.iter().find(|name| !is_known(name) && !PathPart::is_name(name)) {
        let known = Aov::NAMES.iter().map(|(name, _)| *name).chain(PathPart::names());
        let list = || format!("choose from {}, or use all", known.collect::<Vec<_>>().join(", "));
        let help = match unknown.to_lowercase().as_str() {
            "z" | "depth" => "depth is always in EXR files, as Z".into(),
            "n" | "normal" | "normals" => "normals are always in EXR files, as N.X N.Y N.Z".into(),
            "albedo" => "albedo is always in EXR files, as albedo.R albedo.G albedo.B".into(),
            "position" => "use --aov P for positions".into(),
            "mask" | "masks" | "matte" | "mattes" | "crypto" => {
                "use cryptomatte, and then `embrasure develop FILE.exr --matte NAME -o mask.png`".into()
            }
            _ => list(),
        };
        return Err(CliError::Usage(format!(
            "--aov {unknown}: unknown channels\n  help: {help}"
        )));
    }
    let is_of_all = |aov: Aov| match aov {
        Aov::Lights => scene.has_light_groups() && integrator.gathers_light(),
        Aov::Points => integrator.has_points(),
        Aov::Lines | Aov::Strategies => false,
        _ => true,
    };
    let is_named = |name: &str| wanted.contains(&name);
    let known = Aov::NAMES.iter();
    let chosen = known.filter(|(name, aov)| is_named(name) || (is_named("all") && is_of_all(*aov)));
    Ok(AovList {
        aovs: chosen.map(|&(_, aov)| aov).collect(),
        light_paths,
    })
}

/// Splits `list` into names. A comma within brackets is a part of a name, because light path
/// expressions have commas, as in `{1,3}`.
fn names(list: &str) -> Vec<&str> {
    let mut depth = 0i32;
    list.split(|c| {
        match c {
            '(' | '[' | '{' => depth += 1,
            ')' | ']' | '}' => depth -= 1,
            _ => {}
        }
        c == ',' && depth <= 0
    })
    .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn commas_of_expressions_stay() {
        assert_eq!(names("P,lpe:a=CD{1,3}L,direct"), ["P", "lpe:a=CD{1,3}L", "direct"]);
        assert_eq!(names("lpe:a=C(D,G)L)x,uv"), ["lpe:a=C(D,G)L)x", "uv"]);
        assert_eq!(names(""), [""]);
    }
}
