//! Parameters that a page can set, from their definitions ([`crate::options`]).

use crate::options::{
    BackgroundOptions, Denoising, FilterOptions, Input, IntegratorKind, IntegratorOptions, Named, OptionGroup,
    Parameter, SamplingOptions, SizeOptions, Value as _,
};
use crate::scene_file::SceneOptions;
use crate::session::Settings;
use serde_json::{Value, json};

/// Key of the noise level at which the render stops. The tables of parameters do not have this key.
pub(super) const NOISE: &str = "noise";

/// Keys of parameters that are fixed for a run of the program.
const FIXED: &[&str] = &["backend"];

/// All parameters with titles, help and values, and the parameters that each integrator uses.
pub(super) fn tables() -> Value {
    let table = |title: &str, parameters: &[Parameter]| {
        let free = parameters.iter().filter(|p| !FIXED.contains(&p.key));
        json!({ "title": title, "parameters": free.map(entry).collect::<Vec<_>>() })
    };
    let integrators = IntegratorKind::NAMES
        .iter()
        .map(|(name, kind)| json!({ "name": name, "help": kind.help(), "reads": kind.parameters() }));
    json!({
        "groups": [
            table("Samples", SamplingOptions::PARAMETERS),
            table("Light transport", IntegratorOptions::PARAMETERS),
            table("Picture", SizeOptions::PARAMETERS),
            table("Pixel filter", FilterOptions::PARAMETERS),
            table("Background", BackgroundOptions::PARAMETERS),
        ],
        "integrators": integrators.collect::<Vec<_>>(),
    })
}

fn entry(parameter: &Parameter) -> Value {
    json!({
        "key": parameter.key,
        "flag": parameter.flag(),
        "help": parameter.help(),
        "default": parameter.default(),
        "names": parameter.names(),
        "range": parameter.range(),
        "schema": parameter.schema(),
    })
}

/// Values, as text for flags, of all parameters that are set or that the integrator uses.
pub(super) fn values(options: &SceneOptions, settings: &Settings) -> Value {
    let mut values = json!({});
    let entries = [
        options.sampling.entries(),
        options.integrator.entries(),
        options.filter.entries(),
        options.background.entries(),
    ];
    for entry in entries.into_iter().flatten() {
        values[entry.key] = json!(entry.text);
    }
    for (key, text) in settings.chosen_integrator().values() {
        values[key] = json!(text);
    }
    values["integrator"] = json!(settings.chosen_integrator().name());
    values["sampler"] = json!(settings.sampler_name());
    values["samples"] = json!(settings.spp.to_string());
    values["denoise"] = json!(settings.denoiser.map_or(Denoising::Off, Denoising::By).text());
    values["seed"] = json!(settings.seed.to_string());
    values["width"] = json!(settings.resolution.x.to_string());
    values["height"] = json!(settings.resolution.y.to_string());
    values["background"] = json!(settings.background.text());
    values[NOISE] = json!(settings.noise.map_or(String::new(), |level| level.to_string()));
    values
}

/// `group` with the parameter `key` set to `value`, or unset if `value` is `None`. Returns `None`
/// if the group does not have the parameter.
fn with<G: OptionGroup + Copy>(group: G, key: &str, value: Option<&str>) -> Option<Result<G, String>> {
    if !G::PARAMETERS.iter().any(|p| p.key == key) || FIXED.contains(&key) {
        return None;
    }
    // Copy all other parameters
    let mut changed = G::default();
    for entry in group.entries().iter().filter(|entry| entry.key != key) {
        if let Some(Err(invalid)) = changed.set(entry.key, Input::Flag(&entry.text)) {
            return Some(Err(invalid.to_string()));
        }
    }
    let set = value.and_then(|value| changed.set(key, Input::Flag(value)));
    Some(match set {
        Some(Err(invalid)) => Err(invalid.to_string()),
        _ => Ok(changed),
    })
}

/// Sets the parameter `key` in `options` and `settings` to `value`, as a flag would. `None` sets
/// the default.
///
/// # Errors
///
/// An unknown parameter or an invalid value. Nothing is changed in this case.
pub(super) fn set(
    (options, settings): (&mut SceneOptions, &mut Settings),
    key: &str,
    value: Option<&str>,
) -> Result<(), String> {
    if key == NOISE {
        settings.noise = match value.map(str::trim).filter(|value| !value.is_empty()) {
            None => None,
            Some(value) => Some(
                value
                    .parse::<f64>()
                    .ok()
                    .filter(|level| *level > 0.0 && level.is_finite())
                    .ok_or_else(|| format!("noise = {value}\n  help: use a number above 0, such as 0.02"))?,
            ),
        };
        return Ok(());
    }
    if let Some(changed) = with(options.sampling, key, value) {
        options.sampling = changed?;
        let sampling = &options.sampling;
        match key {
            "samples" => settings.spp = sampling.samples(),
            "seed" => settings.seed = sampling.seed(),
            "sampler" => settings.sampler = sampling.sampler(),
            "denoise" => settings.denoiser = sampling.denoise().denoiser(),
            _ => settings.denoise_radius = sampling.denoise_radius(),
        }
    } else if let Some(changed) = with(options.integrator, key, value) {
        options.integrator = changed?;
        settings.integrator = options.integrator;
    } else if let Some(changed) = with(options.size, key, value) {
        // The other side (width or height) keeps its current value, which may differ from the file.
        options.size = changed?;
        match key {
            "width" => settings.resolution.x = options.size.width(),
            _ => settings.resolution.y = options.size.height(),
        }
    } else if let Some(changed) = with(options.filter, key, value) {
        options.filter = changed?;
        settings.filter = options.filter.filter();
        settings.filter_radius = options.filter.filter_radius();
    } else if let Some(changed) = with(options.background, key, value) {
        options.background = changed?;
        settings.background = options.background.background();
    } else {
        return Err(format!("the viewer has no parameter {key}"));
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A page can set each parameter of the tables to its default value, and unset the parameter
    /// again.
    #[test]
    fn all_parameters_can_be_set() {
        let tables = tables();
        let mut count = 0;
        for group in tables["groups"].as_array().unwrap() {
            for parameter in group["parameters"].as_array().unwrap() {
                let key = parameter["key"].as_str().unwrap();
                let (mut options, mut settings) = (SceneOptions::default(), Settings::default());
                let names = parameter["names"].as_array().unwrap();
                let default = parameter["default"].as_str().unwrap();
                let value = names.last().map_or(default, |name| name.as_str().unwrap());
                if !value.contains(' ') && !value.is_empty() {
                    let set = set((&mut options, &mut settings), key, Some(value));
                    assert_eq!(set, Ok(()), "{key} = {value}");
                    count += 1;
                }
                assert_eq!(set((&mut options, &mut settings), key, None), Ok(()), "{key}");
            }
        }
        assert!(count > 20, "{count}");
    }

    #[test]
    fn values_are_set_one_by_one() {
        let (mut options, mut settings) = (SceneOptions::default(), Settings::default());
        let mut set = |key: &str, value: Option<&str>| {
            let set = set((&mut options, &mut settings), key, value);
            (set, values(&options, &settings))
        };
        let (set_depth, said) = set("max_depth", Some("3"));
        assert_eq!((set_depth, said["max_depth"].as_str()), (Ok(()), Some("3")));
        let (set_kind, said) = set("integrator", Some("naive"));
        assert_eq!((set_kind, said["integrator"].as_str()), (Ok(()), Some("naive")));
        assert_eq!(said["max_depth"], "3");
        let (default, said) = set("max_depth", None);
        assert_eq!((default, said["max_depth"].as_str()), (Ok(()), Some("16")));
        let (wrong, said) = set("samples", Some("0"));
        assert!(wrong.unwrap_err().contains("samples = 0"));
        assert_eq!(said["samples"], "64");
        assert!(set("backend", Some("brute")).0.is_err());
        assert!(set("noise", Some("-1")).0.is_err());
        assert_eq!(set("noise", Some("0.02")).1["noise"], "0.02");
    }
}
