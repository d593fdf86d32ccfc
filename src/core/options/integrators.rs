//! Integrators and their parameters.
//!
//! The macro `integrators!` has an entry for each integrator. It generates the values of
//! [`IntegratorKind`], a struct of the parameters with their defaults, the text that files store,
//! and the warnings about unused flags.

use super::integrator_parameters::{Clamp, IntegratorOptions, PathReuse, Scrambling, values};
use super::{Named, OptionGroup, Value};
use crate::integrator::{Directions, Survival};
use std::any::Any;

/// Text of a parameter's value for files. The text is `auto` if the integrator chooses the value.
trait ParameterText {
    fn described(&self) -> String;
}

impl<T: Value> ParameterText for T {
    fn described(&self) -> String {
        self.text()
    }
}

impl<T: Value> ParameterText for Option<T> {
    fn described(&self) -> String {
        self.map_or("auto".into(), |value| value.text())
    }
}

/// Defines the integrators. The entry of an integrator has its name and the keys of the parameters
/// that it reads. A value after `=` is the default of this integrator. This value may use
/// parameters that stand before it in the list.
macro_rules! integrators {
    ($($(#[doc = $doc:literal])+ $kind:ident($settings:ident) = $name:literal {
        $($key:ident $(= $value:expr)?),* $(,)?
    })+) => {
        /// Kinds of integrators.
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        #[non_exhaustive]
        pub enum IntegratorKind {
            $($(#[doc = $doc])+ $kind),+
        }

        impl Named for IntegratorKind {
            const NAMES: &'static [(&'static str, Self)] = &[$(($name, Self::$kind)),+];
        }

        impl IntegratorKind {
            /// Keys of the parameters that the integrator reads. Other parameters have no effect on
            /// it.
            pub fn parameters(self) -> &'static [&'static str] {
                match self {
                    $(Self::$kind => &[$(stringify!($key)),*]),+
                }
            }

            /// Description of the integrator in one line.
            pub fn help(self) -> &'static str {
                match self {
                    $(Self::$kind => concat!($($doc, "\n"),+).trim()),+
                }
            }
        }

        $(#[doc = concat!("Parameters of `", $name, "`.")]
        #[derive(Clone, Copy, Debug, PartialEq)]
        pub struct $settings {
            $(#[doc = concat!("[`IntegratorOptions::", stringify!($key), "`]")]
            pub $key: integrators!(@type $key $(, $value)?),)*
        }

        impl $settings {
            /// Parameters with the values of `options`. Unset options get their defaults.
            pub fn new(options: &IntegratorOptions) -> Self {
                $(let $key = integrators!(@value options, $key $(, $value)?);)*
                Self { $($key),* }
            }
        })+

        /// An integrator with the values of its parameters.
        #[derive(Clone, Copy, Debug, PartialEq)]
        pub enum ChosenIntegrator {
            $($(#[doc = $doc])+ $kind($settings)),+
        }

        impl ChosenIntegrator {
            /// The integrator that `options` select, with its parameters. Unset options get their
            /// defaults.
            pub fn new(options: &IntegratorOptions) -> Self {
                match options.integrator() {
                    $(IntegratorKind::$kind => Self::$kind($settings::new(options))),+
                }
            }

            /// Kind of the integrator.
            pub fn kind(&self) -> IntegratorKind {
                match self {
                    $(Self::$kind(_) => IntegratorKind::$kind),+
                }
            }

            /// Value of the parameter `key`; `None` if the integrator does not read this parameter,
            /// or if the type of the parameter is not `T`.
            pub fn value<T: Copy + 'static>(&self, key: &str) -> Option<T> {
                self.any_value(key)?.downcast_ref().copied()
            }

            // Value of the parameter `key`, of any type. This function is separate from `value`, so
            // that it is compiled only once and not for each type.
            fn any_value(&self, key: &str) -> Option<&dyn Any> {
                match self {
                    $(Self::$kind(settings) => {
                        $(if key == stringify!($key) {
                            return Some(&settings.$key);
                        })*
                        let _ = settings;
                        None
                    }),+
                }
            }

            /// Value of the parameter `key` as text; `None` if the integrator does not read this
            /// parameter.
            fn text(&self, key: &str) -> Option<String> {
                match self {
                    $(Self::$kind(settings) => {
                        $(if key == stringify!($key) {
                            return Some(settings.$key.described());
                        })*
                        let _ = settings;
                        None
                    }),+
                }
            }

            /// Keys of the parameters that the integrator reads, with their values as text.
            pub fn values(&self) -> Vec<(&'static str, String)> {
                match self {
                    $(Self::$kind(settings) => {
                        let $settings { $($key),* } = settings;
                        vec![$((stringify!($key), $key.described())),*]
                    }),+
                }
            }
        }
    };
    (@type $key:ident, $value:expr) => { values::$key };
    (@type $key:ident) => { values::resolved::$key };
    (@value $options:ident, $key:ident, $value:expr) => { $options.$key.unwrap_or($value) };
    (@value $options:ident, $key:ident) => { $options.$key() };
}

integrators! {
    /// Path tracing with next-event estimation; pixels may share their paths
    Path(PathSettings) = "path" {
        directions, direction_points, direction_perturbation, direction_scrambling, direct, mis, light_selection, lamp_samples, triangle_sampling, max_depth, roulette_depth, roulette = Survival::Threshold(0.5), clamp_indirect,
        reuse, light_samples = if reuse == PathReuse::Pixels { 3 } else { 1 },
    }
    /// Path tracing that meets lights by chance alone
    Naive(NaiveSettings) = "naive" {
        directions = Directions::Uniform, direction_points, direction_perturbation, direction_scrambling,
        emission_coin, emission_probability, absorption, max_depth, roulette_depth, roulette,
    }
    /// Path tracing with one sample of direct plus indirect light at each vertex
    OneSample(OneSampleSettings) = "one-sample" { light_selection, lamp_samples, triangle_sampling, direct_probability, max_depth }
    /// Path tracing whose next vertices are uniform over the area of all surfaces
    Area(AreaSettings) = "area" { light_selection, lamp_samples, triangle_sampling, max_depth }
    /// Whitted's ray tracing: mirrors, glass and direct light
    Whitted(WhittedSettings) = "whitted" { light_selection, lamp_samples, triangle_sampling, max_depth }
    /// Distributed ray tracing, which branches at every vertex
    Distributed(DistributedSettings) = "distributed" {
        directions, direction_points, direction_perturbation, direction_scrambling, direct, mis, light_selection, lamp_samples, triangle_sampling, max_depth, tree_depth, branching,
    }
    /// Light that is scattered once at most
    Direct(DirectSettings) = "direct" { directions, direction_points, direction_perturbation, direction_scrambling, direct, mis, light_selection, lamp_samples, triangle_sampling, light_samples }
    /// Ambient occlusion
    AmbientOcclusion(AmbientOcclusionSettings) = "ao" { ao_distance }
    /// A property of the first surface as a colour: normals, texture coordinates, wireframe, cost
    /// and others
    Debug(DebugSettings) = "debug" { debug_view }
    /// Light tracing: paths from lights alone; mirrors and glass seen directly stay black
    Light(LightSettings) = "light" { light_selection, lamp_samples, triangle_sampling, max_depth, roulette_depth, roulette }
    /// Bidirectional path tracing
    Bidirectional(BidirectionalSettings) = "bdpt" {
        mis, light_selection, lamp_samples, triangle_sampling, max_depth, roulette_depth, roulette,
    }
    /// Multiplexed Metropolis light transport in primary sample space
    PrimarySpace(PrimarySpaceSettings) = "pssmlt" {
        mis, light_selection, lamp_samples, triangle_sampling, max_depth, light_samples,
        metropolis_direct, metropolis_target, chains, bootstrap, large_step_probability, mutation_size,
    }
    /// Stochastic progressive photon mapping; biased, and the bias shrinks with samples
    ProgressivePhotons(ProgressivePhotonSettings) = "sppm" {
        directions, direction_points, direction_perturbation, direction_scrambling, direct, mis, light_selection, lamp_samples, triangle_sampling, max_depth, roulette_depth, roulette,
        photons, photon_radius, photon_alpha,
    }
    /// Photon mapping with final gathering; biased, 10 to 20 times as long a sample
    PhotonMap(PhotonMapSettings) = "photon-map" {
        directions, direction_points, direction_perturbation, direction_scrambling, direct, mis, light_selection, lamp_samples, triangle_sampling, max_depth, roulette_depth, roulette,
        photons = 1 << 18, photon_radius, photon_count, gather_rays,
    }
    /// Vertex connection and merging: bdpt with sppm; biased, and the bias shrinks
    VertexMerging(VertexMergingSettings) = "vcm" {
        mis, light_selection, lamp_samples, triangle_sampling, max_depth, roulette_depth, roulette, photons, photon_radius, photon_alpha,
    }
    /// Metropolis light transport in path space
    PathSpace(PathSpaceSettings) = "mlt" {
        light_selection, lamp_samples, triangle_sampling, max_depth, roulette_depth, light_samples,
        metropolis_direct, metropolis_target, chains, bootstrap,
    }
    /// Irradiance caching of diffuse indirect light; biased
    IrradianceCache(IrradianceCacheSettings) = "irradiance-cache" {
        directions, direction_points, direction_perturbation, direction_scrambling, direct, mis, light_selection, lamp_samples, triangle_sampling, max_depth, roulette_depth, roulette,
        light_samples = 2, cache_error, cache_rays,
    }
}

impl DistributedSettings {
    /// Maximum number of scattering events: the smaller of `max_depth` and `tree_depth`. Scene
    /// files often set a `max_depth` for paths, which is too large for a tree of rays.
    pub fn depth(&self) -> u32 {
        self.max_depth
            .limit()
            .map_or(self.tree_depth, |max| max.min(self.tree_depth))
    }
}

impl Default for ChosenIntegrator {
    fn default() -> Self {
        Self::new(&IntegratorOptions::default())
    }
}

impl ChosenIntegrator {
    /// Name of the integrator, which users type.
    pub fn name(&self) -> &'static str {
        super::name_of(IntegratorKind::NAMES, self.kind())
    }

    /// The parameter that biases the mean image, as `key=value`; `None` if no parameter does.
    pub fn bias(&self) -> Option<String> {
        let clamp: Option<Clamp> = self.value("clamp_indirect");
        if let Some(clamp) = clamp.filter(|clamp| clamp.0.is_some()) {
            return Some(format!("clamp_indirect={}", clamp.text()));
        }
        self.repeats_directions().then(|| "direction_scrambling=off".into())
    }

    /// Returns true if the integrator uses the same directions in all pixels.
    pub fn repeats_directions(&self) -> bool {
        let is_perturbed = matches!(
            self.value("directions"),
            Some(Directions::PerturbedQmc | Directions::PerturbedQmcUniform)
        );
        is_perturbed && self.value("direction_scrambling") == Some(Scrambling::Off)
    }

    /// Integrator and parameters as `key=value` pairs, which files store. Together with the scene,
    /// the image options and the random numbers, they determine the pixels.
    pub fn describe(&self) -> String {
        let mut text = format!("integrator={}", self.name());
        for (key, value) in self.values() {
            text += &format!(" {key}={value}");
        }
        text
    }
}

impl IntegratorOptions {
    /// Names of integrators that have a special default of the parameter `key`, with these
    /// defaults.
    pub fn other_defaults(key: &str) -> Vec<(&'static str, String)> {
        let parameter = Self::PARAMETERS.iter().find(|parameter| parameter.key == key);
        let usual = parameter.map(|parameter| parameter.default()).unwrap_or_default();
        let of_kind = |&(name, kind): &(&'static str, IntegratorKind)| {
            let options = Self {
                integrator: Some(kind),
                ..Self::default()
            };
            let value = ChosenIntegrator::new(&options).text(key)?;
            (value != usual && value != "auto").then_some((name, value))
        };
        IntegratorKind::NAMES.iter().filter_map(of_kind).collect()
    }
}
