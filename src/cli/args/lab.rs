//! Arguments of `embrasure lab`.

use super::camera::CameraArgs;
use super::flags::{NameParser, value_parser};
use super::load::LoadArgs;
use super::values::{parse_duration, parse_size};
use crate::io::LoadParameters;
use crate::options::{
    Backend, FilterOptions, Input, IntegratorKind, IntegratorOptions, MaxDepth, OptionGroup, Parameter,
    SamplingOptions, Value, nearest,
};
use crate::scene_file::SceneOptions;
use clap::builder::{PossibleValue, TypedValueParser};
use clap::error::{Error, ErrorKind};
use clap::{Arg, Command, Parser};
use std::ffi::OsStr;
use std::path::PathBuf;

/// Arguments of `lab`. Estimators are compared at equal samples with --spp, and at equal time with
/// --time.
#[derive(Debug, Parser)]
#[command(after_help = "\
Files:
  PREFIX.png              pictures; several values of --spp or --time give a row per estimator
  PREFIX.csv, PREFIX.md   relMSE, seconds, efficiency = 1 / (relMSE x seconds);
                          block_relmse is the relMSE of the means of 16x16 pixels
  PREFIX-curves.csv, .svg relMSE at 1, 4, 16, 64, ... samples
Without --reference, the last unbiased estimator that finds all light (path, naive, one-sample,
bdpt, pssmlt or mlt) renders the reference. This takes 64 times its time: with --time 10s about
11 minutes. A warning says if the reference has much noise, or lacks light that sppm finds.
An interrupt writes the estimators that are complete; it writes no errors if the reference is
incomplete.
Examples:
  embrasure lab scenes/cornell-box.toml --size 256x256 --html box.html
  embrasure lab scenes/cornell-box.toml --size 256x256 --methods sppm,vcm,bdpt --spp 1,4,16
  embrasure lab scenes/cornell-box.toml --size 256x256 --bounces
  embrasure lab scenes/veach-plates.toml --methods path:reuse=none,path:sampler=halton:reuse=none --time 1s,4s")]
pub(in crate::cli) struct LabArgs {
    /// A .toml scene file or a bare .obj
    pub scene: PathBuf,

    /// Integrators to compare, such as path,path:sampler=halton [default: eight steps, from naive
    /// to the settings of the scene]
    ///
    /// A method is NAME or NAME:KEY=VALUE:KEY=VALUE... Its settings are parameters of integrators,
    /// sampling and pixel filter. A filter changes the picture: relMSE then includes the difference
    /// between the filters of the estimator and of the reference.
    #[arg(long, value_name = "METHOD,...", value_delimiter = ',', value_parser = MethodParser, hide_possible_values = true)]
    pub methods: Vec<MethodFlag>,

    /// Write a sheet of the light of each bounce from 0 to 5, in place of a comparison
    #[arg(long, conflicts_with_all = ["methods", "time", "reference", "html"])]
    pub bounces: bool,

    /// Samples per pixel of every estimator, such as 64 or 1,10,100 [default: 64]
    ///
    /// Several values give a column each.
    #[arg(
        long,
        value_name = "N,...",
        value_delimiter = ',',
        value_parser = clap::value_parser!(u32).range(1..),
        conflicts_with = "time"
    )]
    pub spp: Vec<u32>,

    /// Time for every estimator, such as 10s, 2m or 1s,4s
    ///
    /// Several values give a column each.
    #[arg(long, value_name = "DUR,...", value_delimiter = ',', value_parser = parse_duration)]
    pub time: Vec<f64>,

    /// Reference EXR file [default: the last unbiased estimator at 64 times its samples]
    #[arg(long, value_name = "FILE")]
    pub reference: Option<PathBuf>,

    /// Name of the files without their extension [default: SCENE's stem + -lab]
    #[arg(short, long, value_name = "PREFIX")]
    pub output: Option<PathBuf>,

    /// Write one self-contained HTML page: pictures, error maps, curves and the table
    #[arg(long, value_name = "FILE")]
    pub html: Option<PathBuf>,

    /// Size of the image in pixels [default: the scene's]
    #[arg(long, value_name = "WxH", value_parser = parse_size)]
    pub size: Option<[u32; 2]>,

    /// Maximum number of scattering events; 0 shows emission only, none means 1024 [default: 16]
    #[arg(long, value_name = "N", value_parser = value_parser::<MaxDepth>)]
    pub max_depth: Option<MaxDepth>,

    /// Seed of the random numbers [default: 0]
    #[arg(long, value_name = "N")]
    pub seed: Option<u64>,

    /// Ray-tracing backend, of those built in
    #[arg(long, value_name = "NAME", value_parser = NameParser::<Backend>::new())]
    pub backend: Option<Backend>,

    /// Render and build threads [default: all]
    #[arg(long, value_name = "N")]
    pub threads: Option<usize>,

    /// No progress
    #[arg(short, long)]
    pub quiet: bool,

    #[command(flatten)]
    pub camera: CameraArgs,

    #[command(flatten)]
    pub load: LoadArgs,
}

/// An integrator of `--methods` with its settings.
#[derive(Clone, Debug, PartialEq)]
pub(in crate::cli) struct MethodFlag {
    /// Text of the method without blanks. It is the name of the method in the results.
    pub name: String,
    /// The integrator and its parameters.
    pub integrator: IntegratorOptions,
    /// Sampler, seed, backend and denoiser.
    pub sampling: SamplingOptions,
    /// Pixel filter.
    pub filter: FilterOptions,
}

/// Parser for integrators with settings. Shell completion offers the integrators.
#[derive(Clone)]
struct MethodParser;

impl TypedValueParser for MethodParser {
    type Value = MethodFlag;

    fn parse_ref(&self, _: &Command, _: Option<&Arg>, value: &OsStr) -> Result<MethodFlag, Error> {
        let text = value.to_string_lossy();
        parse_method(&text)
            .map_err(|words| Error::raw(ErrorKind::ValueValidation, format!("--methods {text}: {words}\n")))
    }

    fn possible_values(&self) -> Option<Box<dyn Iterator<Item = PossibleValue> + '_>> {
        Some(Box::new(IntegratorKind::names().into_iter().map(PossibleValue::new)))
    }
}

/// Parses an integrator with settings, such as `path` or `path:reuse=none:sampler=halton`. The keys
/// of the settings are those of `[render]` in scene files.
fn parse_method(text: &str) -> Result<MethodFlag, String> {
    let mut parts = text.split(':').map(str::trim);
    let kind = parts.next().unwrap_or_default();
    let known = IntegratorKind::names();
    let integrator = IntegratorKind::of_text(kind).ok_or_else(|| {
        let near = nearest(kind, known.iter().copied());
        let near = near.map_or(String::new(), |known| format!("did you mean {known}? "));
        format!(
            "unknown integrator `{kind}`\n  help: {near}choose among {}",
            known.join(", ")
        )
    })?;
    let mut method = MethodFlag {
        name: kind.into(),
        integrator: IntegratorOptions {
            integrator: Some(integrator),
            ..IntegratorOptions::default()
        },
        sampling: SamplingOptions::default(),
        filter: FilterOptions::default(),
    };
    for part in parts {
        let Some((key, value)) = part.split_once('=') else {
            return Err(format!(
                "`{part}`: expected KEY=VALUE\n  help: write {kind}:KEY=VALUE, such as {kind}:sampler=halton"
            ));
        };
        let (key, value) = (key.trim().replace('-', "_"), value.trim());
        method.set(&key, value)?;
        method.name += &format!(":{key}={value}");
    }
    Ok(method)
}

impl MethodFlag {
    /// Parameters that may differ between methods.
    pub fn parameters() -> impl Iterator<Item = &'static Parameter> {
        let groups = [
            IntegratorOptions::PARAMETERS,
            SamplingOptions::PARAMETERS,
            FilterOptions::PARAMETERS,
        ];
        let all = groups.into_iter().flatten();
        all.filter(|parameter| !["integrator", "samples"].contains(&parameter.key))
    }

    /// Sets a parameter that may differ between methods.
    fn set(&mut self, key: &str, value: &str) -> Result<(), String> {
        if let Some(refusal) = refusal_of_common(key) {
            return Err(refusal);
        }
        let input = Input::Flag(value);
        let set = self
            .integrator
            .set(key, input)
            .or_else(|| self.sampling.set(key, input))
            .or_else(|| self.filter.set(key, input));
        match set {
            Some(Ok(())) => Ok(()),
            Some(Err(invalid)) => Err(invalid.to_string()),
            None => {
                let known: Vec<&str> = Self::parameters().map(|parameter| parameter.key).collect();
                let near = nearest(key, known.iter().copied());
                let near = near.map_or(String::new(), |known| format!("did you mean {known}? "));
                Err(format!(
                    "unknown parameter `{key}`\n  help: {near}choose among {}",
                    known.join(", ")
                ))
            }
        }
    }
}

/// Error for a parameter that all methods have in common. It names the flag that sets the
/// parameter. `None` if methods may differ in the parameter, or if it is unknown.
fn refusal_of_common(key: &str) -> Option<String> {
    let is_of = |parameters: &[Parameter]| parameters.iter().any(|parameter| parameter.is_called(key));
    if is_of(LoadParameters::PARAMETERS) {
        return Some(format!(
            "`{key}` changes the scene, which all methods share\n  help: use --{} for all methods, and run `lab` once per value",
            key.replace('_', "-")
        ));
    }
    if key == "integrator" {
        return Some(
            "`integrator` is not a parameter of a method\n  help: begin the method with the name of the integrator, as in bdpt:max_depth=8"
                .into(),
        );
    }
    let instead = match key {
        "samples" | "spp" => "use --spp".into(),
        "quality" => "use --spp or --time".into(),
        "width" | "height" => "use --size".into(),
        _ if MethodFlag::parameters().any(|parameter| parameter.is_called(key)) => return None,
        _ => {
            let (section, _) = SceneOptions::GROUPS.iter().find(|(_, parameters)| is_of(parameters))?;
            format!("use --set {section}.{key}=VALUE")
        }
    };
    Some(format!("`{key}` is the same for all methods\n  help: {instead}"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::film::FilterKind;
    use crate::options::PathReuse;
    use crate::sampler::SamplerKind;

    #[test]
    fn methods_have_settings_of_their_own() {
        let method = parse_method(" path:reuse=none : sampler = halton:max-depth=none").unwrap();
        assert_eq!(method.name, "path:reuse=none:sampler=halton:max_depth=none");
        assert_eq!(method.integrator.integrator, Some(IntegratorKind::Path));
        assert_eq!(method.integrator.reuse, Some(PathReuse::None));
        assert_eq!(method.integrator.max_depth, Some(MaxDepth(None)));
        assert_eq!(method.sampling.sampler, Some(SamplerKind::Halton));
        assert_eq!(parse_method("vcm").unwrap().name, "vcm");
        let filtered = parse_method("path:filter=tent:filter-radius=2").unwrap();
        assert_eq!(filtered.filter.filter, Some(FilterKind::Tent));
        assert_eq!(filtered.filter.filter_radius, Some(2.0));
        for (text, expected) in [
            ("bdtp", "did you mean bdpt?"),
            ("path:smapler=sobol", "did you mean sampler?"),
            ("path:sampler=haltn", "did you mean halton?"),
            ("sppm:photon_alpha=2", "at most 1"),
            ("path:spp=4", "use --spp"),
            (
                "path:integrator=bdpt",
                "begin the method with the name of the integrator",
            ),
            ("path:quality=good", "use --spp or --time"),
            ("path:panes=refract", "use --panes for all methods"),
            ("path:texture-filter=mip", "use --texture-filter for all methods"),
            ("path:tone=agx", "use --set image.tone=VALUE"),
            ("path:width=4", "use --size"),
            ("path:filter=gaus", "did you mean gaussian?"),
            ("path:sobol", "path:KEY=VALUE"),
            ("path:", "expected KEY=VALUE"),
            ("", "choose among path"),
        ] {
            let error = parse_method(text).unwrap_err();
            assert!(error.contains(expected), "{text}: {error}");
        }
    }
}
