//! Radiance that an integrator gathers: one spectrum, or a spectrum with shares of light groups beside it, or also of classes of paths (`by_path`).
//!
//! `--aov lights` splits a picture by groups of lights. The type that integrators gather belongs to their sink: [`Spectrum`], or [`ByGroup`], which
//! takes all factors along the path as the spectrum does. Each light that is sampled, met or escaped to says which light it is, and the scene knows
//! its group (`light/groups.rs`); shared vertices of `path/reuse` hold their light by group too.
//!
//! The integrators are compiled for each type, so that the one without groups has no cost. The sum is kept beside the shares, since adding the
//! shares would round otherwise: `R G B` keep their bits. docs/benchmarks.md, "Overheads", has the cost of groups.

use crate::bsdf::ScatteringEvent;
use crate::color::Spectrum;
use crate::film::LightPaths;
use crate::light::{LightGroups, LightId};
use crate::scene::Scene;
use std::ops::{AddAssign, Mul};

/// Radiance that is gathered along a path: of all lights together ([`Spectrum`]), also distinguished by their groups ([`ByGroup`]), or
/// by the classes of paths too ([`ByPath`](super::ByPath)).
///
/// Light transport is linear in the lights, and a path finds the light of each of them with the same factors: what the path tells of one group
/// is the estimate of a picture that this group alone lights.
pub trait Gathered:
    Copy + Default + Send + From<Spectrum> + AddAssign + Mul<Spectrum, Output = Self> + Mul<f32, Output = Self>
{
    /// Whether the class of a path is told, which depends on its scattering events. Only then are they computed.
    const TELLS_PATHS: bool = false;

    /// What comes from the light `id` of `scene`.
    fn of_light(radiance: Spectrum, id: LightId, scene: &Scene) -> Self;

    /// What comes from all lights.
    fn sum(&self) -> Spectrum;

    /// What comes from the lights of each group, in the order of [`LightGroups::names`]; nothing without groups.
    fn by_group(&self) -> &[Spectrum];

    /// What comes by each class of paths; nothing without classes.
    #[inline(always)]
    fn by_class(&self) -> &[Spectrum] {
        &[]
    }

    /// This light in the classes in which `paths` has it after `event`: that of a surface that scatters it towards the camera. Factors are another
    /// matter.
    #[inline(always)]
    fn scattered(self, _event: impl FnOnce() -> ScatteringEvent, _paths: Option<&LightPaths>) -> Self {
        self
    }

    /// Adds `light` times `factor`, [`Gathered::scattered`] by `event`.
    #[inline(always)]
    fn add_scattered(
        &mut self,
        light: &Self,
        factor: Spectrum,
        _event: impl FnOnce() -> ScatteringEvent,
        _paths: Option<&LightPaths>,
    ) {
        *self += *light * factor;
    }

    /// This light in the classes that `other` has.
    #[inline(always)]
    fn with_classes_of(self, _other: Self) -> Self {
        self
    }
}

impl Gathered for Spectrum {
    #[inline(always)]
    fn of_light(radiance: Spectrum, _: LightId, _: &Scene) -> Self {
        radiance
    }

    #[inline(always)]
    fn sum(&self) -> Spectrum {
        *self
    }

    #[inline(always)]
    fn by_group(&self) -> &[Spectrum] {
        &[]
    }
}

/// Radiance with the share that each group of lights has in it.
///
/// The sum is kept beside them: it has the bits that it would have without groups, which adding up the shares would not give.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ByGroup {
    sum: Spectrum,
    groups: [Spectrum; LightGroups::MOST],
}

impl Gathered for ByGroup {
    fn of_light(radiance: Spectrum, id: LightId, scene: &Scene) -> Self {
        let mut gathered = Self::from(radiance);
        if let Some(group) = gathered.groups.get_mut(scene.light_groups().of(id)) {
            *group = radiance;
        }
        gathered
    }

    fn sum(&self) -> Spectrum {
        self.sum
    }

    fn by_group(&self) -> &[Spectrum] {
        &self.groups
    }
}

impl From<Spectrum> for ByGroup {
    /// What comes from no light.
    fn from(sum: Spectrum) -> Self {
        Self {
            sum,
            groups: Default::default(),
        }
    }
}

impl AddAssign for ByGroup {
    fn add_assign(&mut self, other: Self) {
        self.sum += other.sum;
        for (group, other) in self.groups.iter_mut().zip(other.groups) {
            *group += other;
        }
    }
}

impl Mul<Spectrum> for ByGroup {
    type Output = Self;
    fn mul(self, factor: Spectrum) -> Self {
        Self {
            sum: self.sum * factor,
            groups: self.groups.map(|group| group * factor),
        }
    }
}

impl Mul<f32> for ByGroup {
    type Output = Self;
    fn mul(self, factor: f32) -> Self {
        self * Spectrum::splat(factor)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Vec3;
    use crate::scene::SceneBuilder;

    #[test]
    fn shares_take_the_factors_of_the_sum() {
        let mut b = SceneBuilder::new();
        for name in [Some("a"), None] {
            let group = name.map(|name| b.light_group(name).unwrap());
            b.begin_light_group(group);
            b.add_point_light(Vec3::ZERO, Spectrum::ONE).unwrap();
        }
        let (scene, _) = b.build().unwrap();
        let mut both = ByGroup::of_light(Spectrum::rgb(1.0, 2.0, 3.0), LightId(0), &scene);
        both += ByGroup::of_light(Spectrum::splat(4.0), LightId(1), &scene) * Spectrum::rgb(1.0, 0.5, 0.0);
        let both = both * 2.0;
        assert_eq!(both.sum(), Spectrum::rgb(10.0, 8.0, 6.0));
        let expected = [Spectrum::rgb(2.0, 4.0, 6.0), Spectrum::rgb(8.0, 4.0, 0.0)];
        assert_eq!(both.by_group()[..2], expected);
        assert!(both.by_group()[2..].iter().all(|group| group.is_black()));
    }
}
