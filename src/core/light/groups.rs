//! Light groups: named groups of lights whose light is summed apart (`--aov lights`).

use super::LightId;
use crate::math::encode_fields;

/// A group of lights, whose light is distinguished from that of others.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LightGroupId(pub u8);

/// Names of groups, and the group of each light. Empty without light groups.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct LightGroups {
    names: Vec<String>,
    /// By [`LightId`].
    of_lights: Vec<u8>,
}

encode_fields!(LightGroups { names, of_lights });

impl LightGroups {
    /// Groups at most, with that of all other lights.
    pub const MOST: usize = 16;
    /// Name of the group of lights that are in none.
    pub const DEFAULT: &str = "default";

    /// Groups of these names, [`LightGroups::MOST`] less one at most and none of them [`LightGroups::DEFAULT`], that have no lights yet.
    pub fn new(names: Vec<String>) -> Self {
        Self {
            names,
            of_lights: Vec::new(),
        }
    }

    /// The `count` lights that come next are in `group`, or in none.
    pub fn push(&mut self, group: Option<LightGroupId>, count: usize) {
        if self.names.is_empty() || count == 0 {
            return;
        }
        let group = group.map_or_else(|| self.default_group(), |group| group.0);
        self.of_lights.resize(self.of_lights.len() + count, group);
    }

    /// The last one, which is there as soon as a light is in it.
    fn default_group(&mut self) -> u8 {
        if self.names.last().is_some_and(|last| last != Self::DEFAULT) {
            self.names.push(Self::DEFAULT.into());
        }
        self.names.len() as u8 - 1
    }

    /// Each group's name.
    pub fn names(&self) -> &[String] {
        &self.names
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.names.is_empty()
    }

    /// The group of a light, in the order of [`LightGroups::names`].
    #[inline(always)]
    pub fn of(&self, light: LightId) -> usize {
        self.of_lights.get(light.0 as usize).map_or(0, |&group| group as usize)
    }

    /// Bytes of its arrays.
    pub fn bytes(&self) -> usize {
        self.of_lights.len() + self.names.iter().map(String::len).sum::<usize>()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_in_no_group_is_in_the_last() {
        let mut groups = LightGroups::new(vec!["sky".into(), "lamps".into()]);
        groups.push(None, 0);
        groups.push(Some(LightGroupId(1)), 2);
        assert_eq!(groups.names(), ["sky", "lamps"]);
        groups.push(None, 1);
        groups.push(Some(LightGroupId(0)), 1);
        groups.push(None, 1);
        assert_eq!(groups.names(), ["sky", "lamps", "default"]);
        assert_eq!([0, 1, 2, 3, 4].map(|id| groups.of(LightId(id))), [1, 1, 2, 0, 2]);
    }

    #[test]
    fn without_names_nothing_is_kept() {
        let mut groups = LightGroups::default();
        groups.push(None, 1 << 20);
        assert!(groups.is_empty() && groups.bytes() == 0);
        assert_eq!(groups.of(LightId(7)), 0);
    }
}
