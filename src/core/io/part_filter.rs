//! Choice of the parts of OBJ files by their names.

use crate::math::Glob;

/// Patterns of the names of parts. A face is hidden if any name of its part fits `hide`, or if `only`
/// has patterns and no name fits one of them.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PartFilter {
    /// Parts that are left out.
    pub hide: Vec<Glob>,
    /// Parts that are kept, if there are any patterns.
    pub only: Vec<Glob>,
}

impl PartFilter {
    /// Returns true if all parts are shown.
    pub fn is_empty(&self) -> bool {
        self.hide.is_empty() && self.only.is_empty()
    }

    /// All patterns: those of `hide`, then those of `only`.
    pub fn globs(&self) -> impl Iterator<Item = &Glob> {
        self.hide.iter().chain(&self.only)
    }
}
