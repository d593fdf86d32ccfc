//! Refusals and warnings of settings that do not go together with an integrator or with a scene's lights.

use crate::camera::Camera;
use crate::integrator::{DirectLight, strategies};
use crate::options::{DistributedSettings, IntegratorKind, MaxDepth, Method, VertexMergingSettings};
use crate::scene::Scene;
use crate::session::{Error, InvalidSetting};

/// Rays to the last vertices of one branching sample at most: seconds.
const MAX_BRANCHES: f64 = 1e7;
/// Scattering events at most where the strategies of all lengths are told apart.
const MAX_STRATEGIES_DEPTH: u32 = 6;
/// Photon paths at most where they are kept whole, to merge with: some 1.5 kB each.
const MAX_MERGED_PHOTONS: u32 = 1 << 24;

impl Method {
    /// An error where the values of a method do not go together.
    pub(crate) fn check(&self) -> Result<(), Error> {
        match self {
            Self::VertexMerging(VertexMergingSettings { photons: Some(n), .. }) if *n > MAX_MERGED_PHOTONS => {
                let help = format!("{MAX_MERGED_PHOTONS} at most with vcm, whose iterations add up");
                Err(InvalidSetting::new("photons", n, help).into())
            }
            _ => self.check_branches(),
        }
    }

    /// Refuses branching trees with more than [`MAX_BRANCHES`] rays to their last vertices.
    pub(crate) fn check_branches(&self) -> Result<(), Error> {
        let Self::Distributed(DistributedSettings {
            branching, max_depth, ..
        }) = self
        else {
            return Ok(());
        };
        let Some(rays) = max_depth.limit().map(|depth| f64::from(*branching).powf(depth as f64)) else {
            return Ok(());
        };
        if rays <= MAX_BRANCHES {
            return Ok(());
        }
        Err(Error::Refused(format!(
            "--integrator distributed with --branching {branching} and --max-depth {max_depth} traces {rays:.1e} rays for one sample\n  \
             help: lower --branching or --max-depth: branching ^ depth of {MAX_BRANCHES:.0} at most"
        )))
    }

    /// Says so where the scene's lights cannot be found: light that comes from single points or directions is never met by
    /// chance. An error where that is all the light there is, else a warning.
    pub(crate) fn check_lights(&self, scene: &Scene) -> Result<Option<String>, Error> {
        let samples_lights = self.kind() != IntegratorKind::Naive && self.direct() != Some(DirectLight::None);
        let shining = || scene.lights().iter().filter(|l| l.power(1.0) > 0.0);
        let Some(light) = shining().find(|l| l.is_delta()).filter(|_| !samples_lights) else {
            return Ok(None);
        };
        let words = format!(
            "a {} light cannot be met by following rays, and {} samples no lights",
            light.kind(),
            if self.kind() == IntegratorKind::Naive {
                "--integrator naive"
            } else {
                "--direct none"
            }
        );
        if shining().all(|l| l.is_delta()) {
            let help = "use --integrator path with --direct light or mis, or give the scene a light that has a size";
            return Err(Error::Refused(format!(
                "{words}: the picture would be black\n  help: {help}"
            )));
        }
        Ok(Some(format!("{words}: its light is missing from the picture")))
    }

    /// Says so where what is made once, before all samples, knows nothing of time.
    pub(crate) fn check_motion(&self, scene: &Scene, camera: &Camera) -> Option<String> {
        let [open, close] = camera.shutter();
        let words = match self.kind() {
            IntegratorKind::IrradianceCache => {
                "the scene moves while the shutter is open: the irradiance cache stays empty, and the picture is that of paths alone"
            }
            IntegratorKind::PhotonMap => {
                "the scene moves while the shutter is open: photons of all times light it at each, which blurs shadows and caustics more than they move"
            }
            _ => return None,
        };
        (scene.is_moving() && open < close).then(|| words.into())
    }

    /// Whether its mean is that of all light, so that others may be judged by it: it is not biased, and leaves no paths out. Light of single points and
    /// directions is another matter ([`Method::check_lights`]).
    pub(crate) fn finds_all_light(&self) -> bool {
        match self.kind() {
            IntegratorKind::Path => self.bias().is_none(),
            IntegratorKind::Naive
            | IntegratorKind::Bidirectional
            | IntegratorKind::PrimarySpace
            | IntegratorKind::PathSpace => true,
            // What mirrors and glass show is missing.
            IntegratorKind::Light
            // Paths are shorter.
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

    /// Refuses to tell strategies apart where there are none, or too many.
    pub(in crate::session) fn check_strategies(&self) -> Result<(), InvalidSetting> {
        let wrong = |value: &str, help: &str| Err(InvalidSetting::new("aov", format!("strategies: {value}"), help));
        if self.kind() != IntegratorKind::Bidirectional {
            let value = format!("--integrator {} has none", self.name());
            return wrong(&value, "use --integrator bdpt");
        }
        let value = match self.max_depth().and_then(|MaxDepth(depth)| depth) {
            Some(depth) if depth <= MAX_STRATEGIES_DEPTH => return Ok(()),
            Some(depth) => format!("there are too many with a --max-depth of {depth}"),
            None => "they have no end without a --max-depth".into(),
        };
        let help = format!(
            "use a --max-depth of {MAX_STRATEGIES_DEPTH} at most: that is {} ways to make a path, of 6 channels each",
            strategies(MAX_STRATEGIES_DEPTH).count()
        );
        wrong(&value, &help)
    }
}
