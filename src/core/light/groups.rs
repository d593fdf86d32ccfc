//! Light groups: named groups of lights whose light is summed separately (`--aov lights`).

use super::LightId;
use crate::math::encode_fields;

/// Index of a light group.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LightGroupId(pub u8);

/// Names of the light groups, and the group of each light. Both lists are empty if the scene
/// defines no groups.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct LightGroups {
    names: Vec<String>,
    /// Group of each light, by [`LightId`].
    of_lights: Vec<u8>,
}

encode_fields!(LightGroups { names, of_lights });

impl LightGroups {
    /// Maximum number of groups, including the group of all other lights.
    pub const MAX_GROUPS: usize = 16;
    /// Name of the group of lights without a group.
    pub const DEFAULT: &str = "default";

    /// Groups named `names`, without lights. At most [`LightGroups::MAX_GROUPS`] − 1 names are
    /// allowed, and [`LightGroups::DEFAULT`] is not allowed.
    pub fn new(names: Vec<String>) -> Self {
        Self {
            names,
            of_lights: Vec::new(),
        }
    }

    /// Assigns the next `count` lights to `group`, or to the default group if `group` is `None`.
    pub fn push(&mut self, group: Option<LightGroupId>, count: usize) {
        if self.names.is_empty() || count == 0 {
            return;
        }
        let group = group.map_or_else(|| self.default_group(), |group| group.0);
        self.of_lights.resize(self.of_lights.len() + count, group);
    }

    /// Returns the index of the default group, which is the last group. The first call adds it.
    fn default_group(&mut self) -> u8 {
        if self.names.last().is_some_and(|last| last != Self::DEFAULT) {
            self.names.push(Self::DEFAULT.into());
        }
        self.names.len() as u8 - 1
    }

    /// Names of the groups.
    pub fn names(&self) -> &[String] {
        &self.names
    }

    /// Returns true if there are no groups.
    pub fn is_empty(&self) -> bool {
        self.names.is_empty()
    }

    /// Index of the group of `light` in [`LightGroups::names`].
    #[inline(always)]
    pub fn of(&self, light: LightId) -> usize {
        self.of_lights.get(light.0 as usize).map_or(0, |&group| group as usize)
    }

    /// Bytes of the arrays.
    pub fn bytes(&self) -> usize {
        self.of_lights.len() + self.names.iter().map(String::len).sum::<usize>()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ungrouped_lights_are_in_the_default_group() {
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
    fn groups_without_names_store_no_lights() {
        let mut groups = LightGroups::default();
        groups.push(None, 1 << 20);
        assert!(groups.is_empty() && groups.bytes() == 0);
        assert_eq!(groups.of(LightId(7)), 0);
    }
}
