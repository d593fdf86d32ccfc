//! The contenders are the estimators to compare: the methods of `--methods`, or the ladder if this
//! flag is missing. Each rung of the ladder adds one idea to the rung below.

use super::lessons::{self, Lesson};
use crate::cli::args::MethodFlag;
use crate::integrator::{DirectLight, Directions, Heuristic};
use crate::options::{ChosenIntegrator, IntegratorKind, IntegratorOptions, OptionGroup, PathReuse, SamplingOptions};
use crate::session::{Session, Settings};

/// An estimator with all its settings.
pub(super) struct Contender {
    pub name: String,
    /// Explanation of the change, and its paper.
    pub lesson: Lesson,
    /// Settings of the render, including the contender's settings.
    pub settings: Settings,
    /// Reason why the estimator is not rendered.
    pub refused: Option<String>,
}

impl Contender {
    pub fn new(name: impl Into<String>, lesson: Lesson, settings: Settings) -> Self {
        Self {
            name: name.into(),
            lesson,
            settings,
            refused: None,
        }
    }

    /// Integrator of the contender, with its parameters.
    pub fn chosen_integrator(&self) -> ChosenIntegrator {
        self.settings.chosen_integrator()
    }

    /// First line of the reason why the estimator is not rendered.
    pub fn refusal(&self) -> Option<&str> {
        self.refused.as_deref()?.lines().next()
    }

    /// The estimator without a denoiser, and with the seed of the contender plus `shift`, so that
    /// its errors are independent.
    pub fn with_seed(&self, shift: u64) -> Self {
        Self {
            name: self.name.clone(),
            lesson: self.lesson.clone(),
            settings: Settings {
                seed: self.settings.seed.wrapping_add(shift),
                denoiser: None,
                denoise_radius: None,
                ..self.settings.clone()
            },
            refused: None,
        }
    }

    /// Returns true if the estimator is unbiased and finds all light, so that it can make the
    /// reference. The denoiser of the estimator is ignored, because a reference is never denoised.
    pub fn finds_all_light(&self) -> bool {
        self.refused.is_none() && self.chosen_integrator().finds_all_light()
    }

    /// Sets `refused` if the estimator cannot render the scene of `session`.
    pub fn judge(&mut self, session: &Session) {
        let integrator = self.chosen_integrator();
        // Methods that find lights only by random rays miss point lights, and lights from a single
        // direction.
        let lights = match integrator.check_lights(session.scene()) {
            Ok(missing) => missing,
            Err(error) => Some(error.to_string()),
        };
        let shown = || {
            integrator
                .check_ground(session.scene())
                .and_then(|()| integrator.check_dispersion(session.scene()))
                .err()
                .map(|error| error.to_string())
        };
        self.refused = lights.or_else(shown);
    }

    /// Returns true if the scene that was built for `other` is valid for this contender: both need
    /// the same triangle sampling and the same backend.
    pub fn shares_scene(&self, other: &Settings) -> bool {
        let made_for = |settings: &Settings| (settings.chosen_integrator().triangle_sampling(), settings.backend);
        made_for(&self.settings) == made_for(other)
    }
}

/// The rungs of the ladder, from the lowest up. Each adds one idea to the rung below. The last rung
/// is `best`.
pub(super) fn ladder(best: &Settings) -> Vec<Contender> {
    let options = &best.integrator;
    let alone = IntegratorOptions {
        reuse: Some(PathReuse::None),
        ..*options
    };
    let endless = Some(u32::MAX);
    let step = |directions, direct, mis, roulette_depth| IntegratorOptions {
        directions: Some(directions),
        direct: Some(direct),
        mis: Some(mis),
        roulette_depth,
        ..alone
    };
    let naive = IntegratorOptions {
        integrator: Some(IntegratorKind::Naive),
        roulette_depth: endless,
        ..*options
    };
    let (power, roulette) = (Heuristic::Power, options.roulette_depth);
    let steps = [
        naive,
        step(Directions::Uniform, DirectLight::None, power, endless),
        step(Directions::Cosine, DirectLight::None, power, endless),
        step(Directions::Cosine, DirectLight::None, power, roulette),
        step(Directions::Cosine, DirectLight::Light, power, roulette),
        step(Directions::Cosine, DirectLight::Mis, Heuristic::Balance, roulette),
        alone,
        *options,
    ];
    let rungs = lessons::rungs().zip(steps);
    let contender = |((name, lesson), integrator)| {
        let settings = Settings {
            integrator,
            ..best.clone()
        };
        Contender::new(name, lesson, settings)
    };
    rungs.map(contender).collect()
}

/// The integrators of `--methods`. The settings of a method override the settings of the scene.
pub(super) fn methods(base: &Settings, flags: &[MethodFlag]) -> Vec<Contender> {
    let contender = |flag: &MethodFlag| {
        let SamplingOptions {
            seed,
            sampler,
            backend,
            denoise,
            denoise_radius,
            ..
        } = flag.sampling;
        let settings = Settings {
            integrator: flag.integrator.or(base.integrator),
            filter: flag.filter.filter.unwrap_or(base.filter),
            filter_radius: filter_radius(flag, base),
            seed: seed.unwrap_or(base.seed),
            sampler: sampler.unwrap_or(base.sampler),
            backend: backend.unwrap_or(base.backend),
            denoiser: denoise.map_or(base.denoiser, |denoise| denoise.denoiser()),
            denoise_radius: denoise_radius.or(base.denoise_radius),
            ..base.clone()
        };
        Contender::new(&flag.name, lessons::of_method(flag, &settings), settings)
    };
    flags.iter().map(contender).collect()
}

/// Radius of the pixel filter. It is the radius of `flag`, else the radius of the scene if `flag`
/// names no filter, else `None`.
fn filter_radius(flag: &MethodFlag, base: &Settings) -> Option<f32> {
    let of_scene = base.filter_radius.filter(|_| flag.filter.filter.is_none());
    flag.filter.filter_radius.or(of_scene)
}

/// Keys of `flag` that its integrator does not use.
pub(super) fn idle_keys(flag: &MethodFlag) -> Vec<&'static str> {
    let read = flag.integrator.integrator().parameters();
    let given = flag.integrator.given().into_iter();
    given
        .filter(|key| *key != "integrator" && !read.contains(key))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_ladder_ends_with_the_settings_of_the_scene() {
        let best = Settings::default();
        let rungs = ladder(&best);
        assert_eq!(rungs.len(), 8);
        assert_eq!(rungs[7].chosen_integrator(), best.chosen_integrator());
        // Each rung differs from the rung below.
        for pair in rungs.windows(2) {
            assert_ne!(
                pair[0].chosen_integrator(),
                pair[1].chosen_integrator(),
                "{}",
                pair[1].name
            );
        }
        assert!(rungs.iter().all(|rung| rung.shares_scene(&best)));
    }
}
