//! Auxiliary channels (arbitrary output variables) that `--aov` adds to an EXR.
//!
//! A new channel of the first surface takes these steps:
//!
//! 1. a variant of [`Aov`], its name in [`Aov::NAMES`], and its channels in `Aov::channels`;
//! 2. a field of [`Features`](super::Features), added in `FeatureBlock::add`, with
//!    [`FeatureSums::SUMS`] raised by the number of its components;
//! 3. a name of each component in `FEATURES` of `film/state.rs`, for checkpoints;
//! 4. its value in `World::features_of` (`integrator/first_surface.rs`), or in the integrator,
//!    where it records the first surface.

use super::{Channel, Coverage, FeatureSums, Film};

/// Channels that `--aov` can request.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Aov {
    /// `P`: position in world space.
    Position,
    /// `uv`: texture coordinates.
    Uv,
    /// `motion`: motion on the film while the shutter is open, in pixels, y upwards.
    Motion,
    /// `points`: photons or irradiance records between which a method interpolates.
    Points,
    /// `id`: object, part and material that cover most of the pixel, counted from 1.
    Ids,
    /// Mattes of objects, parts and materials (Friedman and Jones, Cryptomatte).
    Cryptomatte,
    /// `light_NAME`: the picture with the light of one light group only.
    Lights,
    /// `strategy_sS_tT`, `unweighted_sS_tT`: contribution of each strategy of a bidirectional
    /// method, with and without its MIS weight.
    Strategies,
}

impl Aov {
    /// Names for `--aov`.
    pub const NAMES: &[(&str, Self)] = &[
        ("P", Self::Position),
        ("uv", Self::Uv),
        ("motion", Self::Motion),
        ("points", Self::Points),
        ("id", Self::Ids),
        ("cryptomatte", Self::Cryptomatte),
        ("lights", Self::Lights),
        ("strategies", Self::Strategies),
    ];

    /// Returns true if the channels describe the first surface along camera rays.
    pub fn is_of_surface(self) -> bool {
        !matches!(self, Self::Lights | Self::Strategies)
    }

    /// Returns true if the channels name parts of objects.
    pub fn names_parts(self) -> bool {
        matches!(self, Self::Ids | Self::Cryptomatte)
    }

    /// Number of channels. 0 for light groups and strategies: their number depends on scene and
    /// method.
    pub(super) fn channel_count(self) -> usize {
        match self {
            // Three kinds (objects, parts and materials), each with six ranks of two channels
            Self::Cryptomatte => 36,
            _ => self.channels().len(),
        }
    }

    /// Channels of the first surface, each with the function that develops it.
    fn channels(self) -> &'static [FeatureDeveloper] {
        fn max(coverage: &Coverage) -> f32 {
            coverage.by_rank().first().map_or(0.0, |&(id, _)| id as f32 + 1.0)
        }
        match self {
            Self::Position => &[("P.X", |f| f.mean(0)), ("P.Y", |f| f.mean(1)), ("P.Z", |f| f.mean(2))],
            Self::Uv => &[("uv.U", |f| f.mean(3)), ("uv.V", |f| f.mean(4))],
            Self::Motion => &[("motion.X", |f| f.mean(5)), ("motion.Y", |f| f.mean(6))],
            Self::Points => &[
                ("points.dots", |f| f.mean(7)),
                ("points.radius", |f| f.mean(8)),
                ("points.count", |f| f.mean(9)),
                ("points.caustics", |f| f.mean(10)),
                ("points.gradient", |f| f.mean(11)),
            ],
            Self::Ids => &[
                ("id.object", |f| max(&f.objects)),
                ("id.part", |f| max(&f.parts)),
                ("id.material", |f| max(&f.materials)),
            ],
            Self::Cryptomatte | Self::Lights | Self::Strategies => &[],
        }
    }
}

/// Name of a channel, and the function that computes its value from a pixel's features.
type FeatureDeveloper = (&'static str, fn(&FeatureSums) -> f32);

/// Channels of the first surface, developed from the film's sums.
pub(super) fn develop_features(film: &Film, aovs: &[Aov]) -> Vec<Channel> {
    let developers = aovs.iter().flat_map(|aov| aov.channels());
    let values =
        |develop: fn(&FeatureSums) -> f32| film.crop().pixels().map(move |p| film.features(p).map_or(0.0, develop));
    let channels = developers.map(|&(name, develop)| Channel {
        name: name.into(),
        values: values(develop).collect(),
    });
    channels.collect()
}
