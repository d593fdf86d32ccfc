//! Errors and warnings for settings that are incompatible with an integrator or with the lights of
//! a scene.

use super::{Error, InvalidSetting};
use crate::camera::Camera;
use crate::integrator::{Background, DirectLight, strategies};
use crate::light::Light;
use crate::light_paths::PathPart;
use crate::light_sampling::{LightSelection, SelectionMode};
use crate::options::{ChosenIntegrator, IntegratorKind, MaxDepth, Named, Value, VertexMergingSettings};
use crate::scene::Scene;

/// Maximum number of rays to the last vertices of one sample of `distributed`. Such a sample takes
/// seconds.
const MAX_BRANCHES: f64 = 1e7;
/// Maximum `--max-depth` if the light of each bidirectional strategy is written to channels.
const MAX_STRATEGIES_DEPTH: u32 = 6;
/// Number of light samples per vertex above which sampling one chosen lamp is surely better than
/// sampling all lamps.
const MANY_SAMPLES: u32 = 32;
/// Maximum number of light paths that `vcm` stores for merging. A path takes some 1.5 kB.
const MAX_MERGED_PHOTONS: u32 = 1 << 24;

/// Returns true if the integrator can show a background that differs from the lights, such as a
/// transparent background.
fn shows_background(kind: IntegratorKind) -> bool {
    match kind {
        IntegratorKind::Path
        | IntegratorKind::Naive
        | IntegratorKind::OneSample
        | IntegratorKind::Area
        | IntegratorKind::Whitted
        | IntegratorKind::Distributed
        | IntegratorKind::Direct
        | IntegratorKind::AmbientOcclusion
        | IntegratorKind::Debug
        | IntegratorKind::ProgressivePhotons
        | IntegratorKind::PhotonMap
        | IntegratorKind::IrradianceCache => true,
        IntegratorKind::Light
        | IntegratorKind::Bidirectional
        | IntegratorKind::PrimarySpace
        | IntegratorKind::VertexMerging
        | IntegratorKind::PathSpace => false,
    }
}

/// Returns true if the integrator supports a shadow-catching ground. `ao` and `debug` show the
/// ground as an ordinary surface. Integrators with photons or records of irradiance do not support
/// the ground, because photons and records do not reach far beyond the scene.
fn catches_shadows(kind: IntegratorKind) -> bool {
    use IntegratorKind::{IrradianceCache, PhotonMap, ProgressivePhotons};
    shows_background(kind) && !matches!(kind, IrradianceCache | PhotonMap | ProgressivePhotons)
}

/// Returns true if the integrator separates classes of light paths.
fn separates_paths(kind: IntegratorKind) -> bool {
    use IntegratorKind::{Bidirectional, Direct, Naive, Path};
    matches!(kind, Path | Naive | Direct | Bidirectional)
}

/// Returns true if all paths start at the camera, sample by sample. Such a path has one wavelength
/// if glass disperses light.
fn starts_at_camera(kind: IntegratorKind) -> bool {
    use IntegratorKind::{AmbientOcclusion, Area, Debug, Direct, Distributed, Naive, OneSample, Path, Whitted};
    matches!(
        kind,
        AmbientOcclusion | Area | Debug | Direct | Distributed | Naive | OneSample | Path | Whitted
    )
}

/// Names of the integrators for which `is` returns true.
fn names_of(is: fn(IntegratorKind) -> bool) -> String {
    let names = IntegratorKind::NAMES.iter().filter(|(_, kind)| is(*kind));
    names.map(|(name, _)| *name).collect::<Vec<_>>().join(", ")
}

impl ChosenIntegrator {
    /// Returns an error if the integrator would store too many photons, or trace too many rays per
    /// sample.
    pub fn check(&self) -> Result<(), Error> {
        match self {
            Self::VertexMerging(VertexMergingSettings { photons: Some(n), .. }) if *n > MAX_MERGED_PHOTONS => {
                let help = format!("use at most {MAX_MERGED_PHOTONS} with vcm, whose iterations add up");
                Err(InvalidSetting::new("photons", n, help).into())
            }
            _ => self.check_branches(),
        }
    }

    /// Rejects branching trees with more than 10⁷ rays to their last vertices (`MAX_BRANCHES`).
    pub fn check_branches(&self) -> Result<(), Error> {
        let Self::Distributed(settings) = self else {
            return Ok(());
        };
        let (branching, depth) = (settings.branching, settings.depth());
        let rays = f64::from(branching).powf(depth.into());
        if rays <= MAX_BRANCHES {
            return Ok(());
        }
        Err(Error::Refused(format!(
            "--integrator distributed with --branching {branching} and a depth of {depth} traces {rays:.1e} rays for one sample\n  \
             help: lower --branching, --tree-depth or --max-depth: the maximum of branching ^ depth is {MAX_BRANCHES:.0}"
        )))
    }

    /// Checks if the integrator can find the lights of the scene. An integrator that does not
    /// sample lights misses lights of a single point or direction, because no ray hits them.
    /// Returns an error if the scene has no other lights, or if `area` would miss a sphere or disk
    /// light. Returns a warning if only part of the light is missing.
    pub fn check_lights(&self, scene: &Scene) -> Result<Option<String>, Error> {
        let is_round = |light: &Light| matches!(light, Light::Area(light) if light.round().is_some());
        if self.kind() == IntegratorKind::Area && scene.lights().iter().any(is_round) {
            let words = "--integrator area samples only triangles, and misses sphere and disk lights";
            return Err(Error::Refused(format!("{words}\n  help: use --integrator path")));
        }
        let samples_lights = self.kind() != IntegratorKind::Naive && self.direct() != Some(DirectLight::None);
        let shining = || scene.lights().iter().filter(|l| l.power(1.0) > 0.0);
        let Some(light) = shining().find(|l| l.is_delta()).filter(|_| !samples_lights) else {
            return Ok(None);
        };
        let words = format!(
            "no ray can hit a {} light, and {} does not sample lights",
            light.kind(),
            if self.kind() == IntegratorKind::Naive {
                "--integrator naive"
            } else {
                "--direct none"
            }
        );
        if shining().all(|l| l.is_delta()) {
            let help = "use --integrator path with --direct light or mis, or give the scene a light with a size";
            return Err(Error::Refused(format!(
                "{words}: the picture would be black\n  help: {help}"
            )));
        }
        Ok(Some(format!("{words}: its light is missing from the picture")))
    }

    /// Returns an error if the integrator cannot show `background`. An integrator whose samples add
    /// light to other pixels shows only the lights as background. In such an integrator, a camera
    /// ray that leaves the scene is only one of several strategies that find the same light.
    pub fn check_background(&self, background: Background) -> Result<(), InvalidSetting> {
        if background == Background::Light || shows_background(self.kind()) {
            return Ok(());
        }
        let value = format!(
            "{} is not possible, since --integrator {} shows only the background `light`",
            background.text(),
            self.name()
        );
        let help = format!(
            "use --background light, or one of the integrators {}",
            names_of(shows_background)
        );
        Err(InvalidSetting::new("background", value, help))
    }

    /// Returns true if the integrator can show a background that differs from the lights, such as a
    /// transparent background.
    pub fn shows_backgrounds(&self) -> bool {
        shows_background(self.kind())
    }

    /// Returns true if the integrator supports a shadow-catching ground.
    pub fn catches_shadows(&self) -> bool {
        self.check_catching().is_ok()
    }

    /// Returns an error if the integrator does not support a shadow-catching ground.
    pub fn check_catching(&self) -> Result<(), Error> {
        if !catches_shadows(self.kind()) {
            let words = format!("--integrator {} cannot show a ground that catches shadows", self.name());
            let names = names_of(catches_shadows);
            return Err(Error::Refused(format!(
                "{words}\n  help: use --no-ground, or one of the integrators {names}"
            )));
        }
        let is_flat = self.max_depth().is_some_and(|depth| depth.limit() == Some(0));
        if is_flat {
            let words = "--max-depth 0 shows emission alone: a ground would be black";
            return Err(Error::Refused(format!(
                "{words}\n  help: use --no-ground, or a --max-depth of 1 or more"
            )));
        }
        Ok(())
    }

    /// Returns an error if the integrator cannot show the ground of `scene`, or does not find all
    /// light that the ground needs.
    pub fn check_ground(&self, scene: &Scene) -> Result<(), Error> {
        if scene.ground().is_none() {
            return Ok(());
        }
        self.check_catching()?;
        match self.check_lights(scene)? {
            Some(words) => Err(Error::Refused(format!(
                "{words}, and the ground would be dark\n  help: use --no-ground, or --integrator path with --direct light or mis"
            ))),
            None => Ok(()),
        }
    }

    /// Returns a warning if the scene moves and the integrator prepares data that do not depend on
    /// time.
    pub fn check_motion(&self, scene: &Scene, camera: &Camera) -> Option<String> {
        let [open, close] = camera.shutter();
        let words = match self.kind() {
            IntegratorKind::IrradianceCache => {
                "the scene moves while the shutter is open: the irradiance cache stays empty, and path tracing computes all light"
            }
            IntegratorKind::PhotonMap => {
                "the scene moves while the shutter is open: photons of similar times are used together, which blurs shadows and caustics further"
            }
            _ => return None,
        };
        (scene.is_moving() && open < close).then(|| words.into())
    }

    /// Returns an error if glass disperses light and the paths of the integrator have no
    /// wavelength.
    pub fn check_dispersion(&self, scene: &Scene) -> Result<(), Error> {
        if !scene.is_dispersive() || starts_at_camera(self.kind()) {
            return Ok(());
        }
        let words = format!(
            "--integrator {} does not disperse light, and a material has an `abbe` number",
            self.name()
        );
        let names = names_of(starts_at_camera);
        Err(Error::Refused(format!(
            "{words}\n  help: use one of {names}, or leave `abbe` out"
        )))
    }

    /// Returns a warning if the integrator samples all lamps at each vertex and there are many
    /// lamps.
    pub fn check_lamps(&self, selection: &LightSelection) -> Option<String> {
        self.value::<SelectionMode>("light_selection")?;
        let lamps = selection.all()?;
        let (rays, count) = (lamps.samples(), lamps.len());
        (rays > MANY_SAMPLES).then(|| {
            format!(
                "--light-selection all traces {rays} shadow rays at each vertex of a path, for {count} lamps; --light-selection place traces one ray, to a lamp that is important at the vertex"
            )
        })
    }

    /// Returns true if the integrator is unbiased and omits no paths, so that its image can be a
    /// reference. Lights of a single point or direction are checked separately
    /// ([`ChosenIntegrator::check_lights`]).
    pub fn finds_all_light(&self) -> bool {
        match self.kind() {
            IntegratorKind::Path | IntegratorKind::Naive => self.bias().is_none(),
            IntegratorKind::OneSample
            | IntegratorKind::Bidirectional
            | IntegratorKind::PrimarySpace
            | IntegratorKind::PathSpace => true,
            // `light` misses light that the camera sees in mirrors and through glass.
            IntegratorKind::Light
            // The variance of `area` has no bound.
            | IntegratorKind::Area
            // All other integrators omit long paths, or are biased.
            | IntegratorKind::Distributed
            | IntegratorKind::Direct
            | IntegratorKind::Whitted
            | IntegratorKind::AmbientOcclusion
            | IntegratorKind::Debug
            | IntegratorKind::ProgressivePhotons
            | IntegratorKind::PhotonMap
            | IntegratorKind::VertexMerging
            | IntegratorKind::IrradianceCache => false,
        }
    }

    /// Returns true if the integrator separates light paths.
    pub fn separates_paths(&self) -> bool {
        separates_paths(self.kind())
    }

    /// Returns an error if the integrator cannot separate light paths.
    pub fn check_light_paths(&self, parts: &[PathPart]) -> Result<(), InvalidSetting> {
        if self.separates_paths() {
            return Ok(());
        }
        let names: Vec<&str> = parts.iter().map(PathPart::layer).collect();
        let value = format!(
            "{} is not possible, since --integrator {} cannot separate light paths",
            names.join(","),
            self.name()
        );
        let help = format!("use one of {}", names_of(separates_paths));
        Err(InvalidSetting::new("aov", value, help))
    }

    /// Checks the channels of strategies. Returns an error if the integrator has no strategies, or
    /// too many.
    pub fn check_strategies(&self) -> Result<(), InvalidSetting> {
        let wrong = |value: &str, help: &str| Err(InvalidSetting::new("aov", format!("strategies {value}"), help));
        if self.kind() != IntegratorKind::Bidirectional {
            let value = format!("is not possible, since --integrator {} has no strategies", self.name());
            return wrong(&value, "use --integrator bdpt");
        }
        let value = match self.max_depth().and_then(|MaxDepth(depth)| depth) {
            Some(depth) if depth <= MAX_STRATEGIES_DEPTH => return Ok(()),
            Some(depth) => format!("has too many channels with a --max-depth of {depth}"),
            None => "has channels without limit if there is no --max-depth".into(),
        };
        let help = format!(
            "use a --max-depth of at most {MAX_STRATEGIES_DEPTH}: that is {} ways to make a path, of 6 channels each",
            strategies(MAX_STRATEGIES_DEPTH).count()
        );
        wrong(&value, &help)
    }
}
