//! Selection of the parts of OBJ files by their names.

use crate::geometry::PartNames;
use crate::math::Glob;

/// Parts that are shown, and parts that differ from the rest of their file. Patterns match any name
/// of a part ([`PartNames::fits`]).
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PartFilter {
    /// Parts that are hidden.
    pub hide: Vec<Glob>,
    /// Parts that are shown. If there are no patterns, all parts are shown.
    pub only: Vec<Glob>,
    /// Rules of a scene file, in their order.
    pub rules: Vec<PartRule>,
}

/// A rule for the parts that match a pattern.
#[derive(Clone, Debug, PartialEq)]
pub struct PartRule {
    /// Pattern of the parts.
    pub glob: Glob,
    /// True if the parts are shown, false if they are hidden. `None`: earlier rules decide.
    pub visible: Option<bool>,
    /// True if the rule replaces the material of the parts, which then have separate meshes.
    pub has_material: bool,
}

impl PartFilter {
    /// Returns true if all parts are shown as they are in the file.
    pub fn is_empty(&self) -> bool {
        self.hide.is_empty() && self.only.is_empty() && self.rules.is_empty()
    }

    /// All patterns: first `hide`, then `only`, then the rules.
    pub fn globs(&self) -> impl Iterator<Item = &Glob> {
        let of_rules = self.rules.iter().map(|rule| &rule.glob);
        self.hide.iter().chain(&self.only).chain(of_rules)
    }

    /// Returns true if the faces of `part` are shown. The last matching rule with `visible`
    /// decides. `hide` and `only` can then hide the part.
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
}
