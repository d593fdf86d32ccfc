use super::{
    Estimator, IntegratorKind, LEAST_CACHE_RAYS, MOST_BRANCHES, MOST_CACHE_RAYS, MOST_GATHER_RAYS, MOST_LIGHT_SAMPLES,
    MOST_MERGED_PHOTONS, MOST_PHOTON_COUNT, MOST_PHOTONS, MOST_SCATTERINGS, MOST_STRATEGIES_DEPTH,
};
use crate::camera::Camera;
use crate::description::MaxDepth;
use crate::integrator::{Metropolis, strategies};
use crate::scene::Scene;
use crate::session::settings::ABOVE_0;
use crate::session::{Error, InvalidSetting};
use std::fmt::Display;

impl Estimator {
    /// The first value that cannot be, whatever the others are.
    pub(in crate::session) fn wrong_value(&self) -> Option<InvalidSetting> {
        if let Some(n) = self.light_samples.filter(|&n| n > MOST_LIGHT_SAMPLES) {
            let help = format!("{MOST_LIGHT_SAMPLES} at most; more samples a pixel are more of everything");
            return Some(InvalidSetting::new("light-samples", n, help));
        }
        if let Some(depth) = self
            .max_depth
            .and_then(|depth| depth.0)
            .filter(|&n| n > MOST_SCATTERINGS)
        {
            let help = format!("{MOST_SCATTERINGS} at most, which is also the end of `none`");
            return Some(InvalidSetting::new("max-depth", depth, help));
        }
        // NaN is none of them.
        if !(self.cache_error > 0.0 && self.cache_error <= 1.0) {
            let help = "use a share above 0, 1 at most: smaller ones are more exact";
            return Some(InvalidSetting::new("cache-error", self.cache_error, help));
        }
        if !(LEAST_CACHE_RAYS..=MOST_CACHE_RAYS).contains(&self.cache_rays) {
            let help = format!("use a number from {LEAST_CACHE_RAYS} to {MOST_CACHE_RAYS}");
            return Some(InvalidSetting::new("cache-rays", self.cache_rays, help));
        }
        let is_length = |d: f32| d > 0.0 && d.is_finite();
        let above_0 = |setting, value: &dyn Display| Some(InvalidSetting::new(setting, value, ABOVE_0));
        let most = match self.kind {
            IntegratorKind::VertexMerging => MOST_MERGED_PHOTONS,
            _ => MOST_PHOTONS,
        };
        if let Some(n) = self.photons.filter(|&n| n > most) {
            let help = format!("{most} at most with {}; frames of sppm and vcm add up", self.name());
            return Some(InvalidSetting::new("photons", n, help));
        }
        if !(self.photon_alpha > 0.0 && self.photon_alpha <= 1.0) {
            let help = "use a share above 0, at which radii shrink fastest, up to 1, at which they stay";
            return Some(InvalidSetting::new("photon-alpha", self.photon_alpha, help));
        }
        if !(2..=MOST_PHOTON_COUNT).contains(&self.photon_count) {
            let help = format!("use 2 to {MOST_PHOTON_COUNT} photons");
            return Some(InvalidSetting::new("photon-count", self.photon_count, help));
        }
        if !(1..=MOST_GATHER_RAYS).contains(&self.gather_rays) {
            let help = format!("use 1 to {MOST_GATHER_RAYS} rays; more samples a pixel are more of everything");
            return Some(InvalidSetting::new("gather-rays", self.gather_rays, help));
        }
        match (self.photons, self.photon_radius) {
            (Some(0), _) => return above_0("photons", &0),
            (_, Some(r)) if !is_length(r) => return above_0("photon-radius", &r),
            _ => {}
        }
        match (self.light_samples, self.branching, self.ao_distance) {
            (Some(0), ..) => above_0("light-samples", &0),
            (_, 0, _) => above_0("branching", &0),
            (_, _, Some(d)) if !is_length(d) => above_0("ao-distance", &d),
            _ => self.wrong_chains(),
        }
    }

    /// The first value of Markov chains that cannot be.
    fn wrong_chains(&self) -> Option<InvalidSetting> {
        let Metropolis {
            chains,
            bootstrap,
            large_step_probability: large,
            mutation_size: size,
            ..
        } = self.metropolis;
        match (chains, bootstrap) {
            (Some(0), _) => Some(InvalidSetting::new("chains", 0, ABOVE_0)),
            (_, Some(0)) => Some(InvalidSetting::new("bootstrap", 0, ABOVE_0)),
            // NaN is in no range.
            _ if !(0.0..=1.0).contains(&large) => Some(InvalidSetting::new(
                "large-step-probability",
                large,
                "use a share from 0 to 1",
            )),
            _ if !(size > 0.0 && size <= 0.5) => {
                let help = "above 0, and 0.5 at most, which is as far as a number in [0, 1) can go either way";
                Some(InvalidSetting::new("mutation-size", size, help))
            }
            _ => None,
        }
    }

    /// Refuses branching trees with more than [`MOST_BRANCHES`] rays to their last vertices.
    pub(crate) fn check_branches(&self) -> Result<(), Error> {
        let Some(depth) = self
            .most_scatterings()
            .filter(|_| self.kind == IntegratorKind::Distributed)
        else {
            return Ok(());
        };
        let rays = (self.branching as f64).powf(depth as f64);
        if rays <= MOST_BRANCHES {
            return Ok(());
        }
        let (branching, depth) = (self.branching, MaxDepth(self.max_depth()));
        Err(Error::Refused(format!(
            "--integrator distributed with --branching {branching} and --max-depth {depth} traces {rays:.1e} rays for one sample\n  \
             help: lower --branching or --max-depth: branching ^ depth of {MOST_BRANCHES:.0} at most"
        )))
    }

    /// Says so where the scene's lights cannot be found: light that comes from single points or directions is never met by
    /// chance. An error where that is all the light there is, else a warning.
    pub(crate) fn check_lights(&self, scene: &Scene) -> Result<Option<String>, Error> {
        let samples_lights = match self.kind {
            IntegratorKind::Naive => false,
            IntegratorKind::Path
            | IntegratorKind::Direct
            | IntegratorKind::Distributed
            | IntegratorKind::PhotonMap
            | IntegratorKind::ProgressivePhotons
            | IntegratorKind::IrradianceCache => self.strategy.samples_lights(),
            IntegratorKind::Light
            | IntegratorKind::Bidirectional
            | IntegratorKind::PrimarySpace
            | IntegratorKind::VertexMerging
            | IntegratorKind::PathSpace
            | IntegratorKind::Whitted
            | IntegratorKind::AmbientOcclusion
            | IntegratorKind::Debug => true,
        };
        let shining = || scene.lights().iter().filter(|l| l.power(1.0) > 0.0);
        let Some(light) = shining().find(|l| l.is_delta()).filter(|_| !samples_lights) else {
            return Ok(None);
        };
        let words = format!(
            "a {} light cannot be met by following rays, and {} samples no lights",
            light.kind(),
            if self.kind == IntegratorKind::Naive {
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
        let words = match self.kind {
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
    /// directions is another matter ([`Estimator::check_lights`]).
    pub(crate) fn finds_all_light(&self) -> bool {
        match self.kind {
            IntegratorKind::Path
            | IntegratorKind::Naive
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
        if self.kind != IntegratorKind::Bidirectional {
            let value = format!("--integrator {} has none", self.name());
            return wrong(&value, "use --integrator bdpt");
        }
        let value = match self.max_depth() {
            Some(depth) if depth <= MOST_STRATEGIES_DEPTH => return Ok(()),
            Some(depth) => format!("there are too many with a --max-depth of {depth}"),
            None => "they have no end without a --max-depth".into(),
        };
        let help = format!(
            "use a --max-depth of {MOST_STRATEGIES_DEPTH} at most: that is {} ways to make a path, of 6 channels each",
            strategies(MOST_STRATEGIES_DEPTH).count()
        );
        wrong(&value, &help)
    }
}
