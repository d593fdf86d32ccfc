use crate::color::Spectrum;
use crate::light::{LightGroups, LightId};
use crate::scene::Scene;
use std::ops::{AddAssign, Mul};

/// Radiance that is gathered along a path: of all lights together ([`Spectrum`]), or also told apart by their groups ([`ByGroup`]).
///
/// Light transport is linear in the lights, and a path finds the light of each of them with the same factors: what the path tells of one group
/// is the estimate of a picture that this group alone lights.
pub trait Gathered:
    Copy + Default + Send + From<Spectrum> + AddAssign + Mul<Spectrum, Output = Self> + Mul<f32, Output = Self>
{
    /// What comes from the light `id` of `scene`.
    fn of_light(radiance: Spectrum, id: LightId, scene: &Scene) -> Self;

    /// What comes from all lights.
    fn sum(&self) -> Spectrum;

    /// What comes from the lights of each group, in the order of [`LightGroups::names`]; nothing where groups are not told apart.
    fn by_group(&self) -> &[Spectrum];
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
