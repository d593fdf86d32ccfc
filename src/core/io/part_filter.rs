//! Selection of the parts of OBJ files by their names.

use crate::geometry::PartNames;
use crate::math::{Glob, Vec3};
use std::borrow::Cow;

/// Patterns of the parts that are shown or hidden, and rules that change parts. A pattern matches a
/// part if it matches any name of the part ([`PartNames::fits`]).
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PartFilter {
    /// Patterns of parts that are hidden.
    pub hide: Vec<Glob>,
    /// Patterns of parts that are shown. If there are none, all parts are shown.
    pub only: Vec<Glob>,
    /// Rules of a scene file, in their order.
    pub rules: Vec<PartRule>,
}

/// A rule for the parts that match a pattern.
#[derive(Clone, Debug, PartialEq)]
pub struct PartRule {
    /// Pattern of the parts.
    pub glob: Glob,
    /// True if the parts are shown, false if they are hidden. With `None`, earlier rules decide.
    pub visible: Option<bool>,
    /// True if the rule replaces the material of the parts, which then have separate meshes.
    pub has_material: bool,
    /// Movement of the parts.
    pub movement: PartMovement,
}

/// Keys that move parts. Scale is applied first, then rotation, then translation. Scale and
/// rotation are about the centre of the bounding box.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PartMovement {
    /// Translation in units of the file.
    pub translate: Option<Vec3>,
    /// Rotation in degrees about the fixed x, y and z axes, in that order.
    pub rotate: Option<Vec3>,
    /// Scale factors along x, y and z.
    pub scale: Option<Vec3>,
}

impl PartMovement {
    /// Returns true if a rotation or a scale needs the centre of the parts.
    pub fn has_center(&self) -> bool {
        self.rotate.is_some() || self.scale.is_some()
    }

    /// Returns true if no key is set.
    pub fn is_empty(&self) -> bool {
        self.translate.is_none() && !self.has_center()
    }

    /// Copy of this movement, in which the keys that `other` sets are replaced by the keys of
    /// `other`.
    fn replaced_by(&self, other: &Self) -> Self {
        Self {
            translate: other.translate.or(self.translate),
            rotate: other.rotate.or(self.rotate),
            scale: other.scale.or(self.scale),
        }
    }
}

impl PartFilter {
    /// Returns true if all parts are shown unchanged.
    pub fn is_empty(&self) -> bool {
        self.hide.is_empty() && self.only.is_empty() && self.rules.is_empty()
    }

    /// All patterns: first `hide`, then `only`, then the rules.
    pub fn globs(&self) -> impl Iterator<Item = &Glob> {
        let of_rules = self.rules.iter().map(|rule| &rule.glob);
        self.hide.iter().chain(&self.only).chain(of_rules)
    }

    /// Returns true if the faces of `part` are shown. The last matching rule that sets `visible`
    /// decides. If it shows the part, `hide` and `only` can still hide the part.
    pub fn shows(&self, names: &PartNames, part: u32) -> bool {
        let fits = |globs: &[Glob]| globs.iter().any(|glob| names.fits(part, glob));
        let mut rules = self.rules.iter().rev();
        let rule = rules.find(|rule| rule.visible.is_some() && names.fits(part, &rule.glob));
        let is_visible = rule.and_then(|rule| rule.visible).unwrap_or(true);
        is_visible && !fits(&self.hide) && (self.only.is_empty() || fits(&self.only))
    }

    /// Indices of the rules that give `part` another material.
    pub fn material_rules(&self, names: &PartNames, part: u32) -> Vec<u32> {
        let rules = (0..).zip(&self.rules);
        let fitting = rules.filter(|(_, rule)| rule.has_material && names.fits(part, &rule.glob));
        fitting.map(|(index, _)| index).collect()
    }

    /// Returns true if a rule moves parts.
    pub fn moves(&self) -> bool {
        self.rules.iter().any(|rule| !rule.movement.is_empty())
    }

    /// Movement of `part`, and the name of the group of parts that rotate about a common centre.
    /// Each key of the movement has the value of the last matching rule that sets the key. The name
    /// is the name of the part that matches the last rule with a rotation or a scale.
    pub fn movement<'n>(&self, names: &'n PartNames, part: u32) -> (PartMovement, Cow<'n, str>) {
        let (mut movement, mut name) = (PartMovement::default(), Cow::default());
        for rule in self.rules.iter().filter(|rule| !rule.movement.is_empty()) {
            if let Some(matched) = names.matched_name(part, &rule.glob) {
                movement = movement.replaced_by(&rule.movement);
                if rule.movement.has_center() {
                    name = matched;
                }
            }
        }
        (movement, name)
    }
}
