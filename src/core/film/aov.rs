//! Auxiliary channels (arbitrary output variables) that `--aov` adds to an EXR.
//!
//! A new channel of the first surface needs:
//!
//! 1. a variant of [`Aov`], and its name in [`Aov::NAMES`];
//! 2. a field of [`Features`](super::Features), with a line of `SUMS` (`film/features.rs`) for each
//!    component, called `NAME.COMPONENT`;
//! 3. its value, which `World::features_of` (`integrator/first_surface.rs`) or the integrator sets
//!    when the first surface is recorded.

use super::features::SUMS;
use super::image::develop_channels;
use super::{Channel, Coverage, FeatureSums, Film};
use std::borrow::Cow;

/// Name of the channel of lines.
pub const LINES: &str = "lines";

/// Style of lines.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LineStyle {
    /// Width in pixels.
    pub width: f32,
    /// Crease angle in degrees. An edge is drawn if the angle between the normals of its faces is
    /// at least this large.
    pub angle: f32,
}

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
    /// `lines`: edges of objects, parts and materials, creases and silhouettes, as in a drawing.
    Lines,
    /// `points`: photons or irradiance records from which a method interpolates light.
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
        ("lines", Self::Lines),
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

    /// Returns true if the channels contain ids of objects, parts and materials.
    pub fn names_parts(self) -> bool {
        matches!(self, Self::Ids | Self::Cryptomatte)
    }

    /// Number of channels. 0 for light groups and strategies, because their number depends on scene
    /// and method.
    pub(super) fn channel_count(self) -> usize {
        match self {
            // Three kinds (objects, parts and materials), each with six ranks of two channels
            Self::Cryptomatte => 36,
            Self::Lines => 1,
            _ => self.means().count() + self.ids().len(),
        }
    }

    /// Name for `--aov`.
    fn name(self) -> &'static str {
        let mut names = Self::NAMES.iter();
        names.find(|(_, aov)| *aov == self).map_or("", |(name, _)| name)
    }

    /// Names of the channels that are means over the samples that hit a surface. They consist of
    /// the name for `--aov`, a dot and a component.
    fn means(self) -> impl Iterator<Item = &'static str> {
        let name = self.name();
        let channels = SUMS.iter().map(|(channel, _)| *channel);
        channels.filter(move |channel| channel.split_once('.').is_some_and(|(of, _)| of == name))
    }

    /// Channels whose value is the id that covers most of the pixel.
    fn ids(self) -> &'static [IdChannel] {
        match self {
            Self::Ids => &[
                ("id.object", |f| &f.objects),
                ("id.part", |f| &f.parts),
                ("id.material", |f| &f.materials),
            ],
            _ => &[],
        }
    }
}

/// Name of a channel of ids, and a function that returns the coverage of a pixel. The value of the
/// channel is the id with the most samples in this coverage.
type IdChannel = (&'static str, fn(&FeatureSums) -> &Coverage);

/// Channels of the first surface that `aovs` request, computed from the sums of the film.
pub(super) fn develop_features(film: &Film, aovs: &[Aov]) -> Vec<Channel> {
    let names = aovs.iter().flat_map(|aov| {
        let lines = (*aov == Aov::Lines).then_some(LINES);
        aov.means().chain(lines).chain(aov.ids().iter().map(|(name, _)| *name))
    });
    develop_channels(film, names.map(Cow::from), |sums, i, values| {
        let Some(features) = sums.features().get(i) else { return };
        for aov in aovs {
            values.extend(aov.means().map(|name| features.mean(name)));
            if *aov == Aov::Lines {
                values.push(features.lines() as f32 / sums.pixel(i).samples().max(1) as f32);
            }
            values.extend(aov.ids().iter().map(|(_, of)| largest(of(features))));
        }
    })
}

/// Id with the most samples, counted from 1; 0 if no sample hit a surface.
fn largest(coverage: &Coverage) -> f32 {
    coverage.by_rank().first().map_or(0.0, |&(id, _)| id as f32 + 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_sum_is_a_channel_of_one_aov() {
        let channels: Vec<_> = Aov::NAMES.iter().flat_map(|(_, aov)| aov.means()).collect();
        let sums: Vec<_> = SUMS.iter().map(|(name, _)| *name).collect();
        assert_eq!(channels, sums);
        assert_eq!(Aov::Position.means().collect::<Vec<_>>(), ["P.X", "P.Y", "P.Z"]);
        assert_eq!(Aov::Ids.means().next(), None);
    }
}
