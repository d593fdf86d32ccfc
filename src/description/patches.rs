//! Patches of materials, in the order in which they apply: those of the scene file as it has them, then those of flags.

use super::glob::Glob;
use super::unknown_key::parser_error;
use super::{FileError, MaterialSection, SceneFile};
use std::borrow::Cow;
use std::ops::Range;

/// Keys that materials whose names match get in place of their own.
pub(super) struct Patch<'a> {
    pub glob: Glob,
    /// The glob or name, as it is written.
    pub written: &'a str,
    /// Its place.
    pub span: Range<usize>,
    pub section: Cow<'a, MaterialSection>,
}

impl SceneFile {
    /// All patches. What no patch can be is an error at its place.
    pub(super) fn patches(&self) -> Result<Vec<Patch<'_>>, FileError> {
        let mut patches = Vec::new();
        for (key, section) in self.material.iter().filter(|(_, section)| section.is_patch()) {
            patches.push(Patch {
                glob: Glob::exact(key.get_ref()),
                written: key.get_ref(),
                span: key.span(),
                section: Cow::Borrowed(section),
            });
        }
        for (key, section) in &self.patch.0 {
            self.check_patch(section)?;
            patches.push(Patch {
                glob: Glob::new(key.get_ref()),
                written: key.get_ref(),
                span: key.span(),
                section: Cow::Borrowed(section),
            });
        }
        patches.sort_by_key(|patch| patch.span.start);

        // Flags with one glob are one patch: `--material Gold.metallic=1 --material Gold.specular=0.5` in either order.
        let first = patches.len();
        for (written, line) in self.flag_patches() {
            let section: MaterialSection = toml::from_str(line).map_err(|error| {
                let (message, help) = parser_error(error.message());
                let place = error
                    .span()
                    .map_or(line.len() - 1, |span| span.start.min(line.len() - 1));
                self.error(place..place, message).help(help)
            })?;
            self.check_patch(&section)?;
            let glob = Glob::new(written);
            match patches[first..].iter_mut().find(|patch| patch.glob == glob) {
                Some(patch) => patch.section.to_mut().set_over(section),
                None => patches.push(Patch {
                    glob,
                    written,
                    span: line.len() - 1..line.len(),
                    section: Cow::Owned(section),
                }),
            }
        }
        Ok(patches)
    }

    /// An error where a patch of its own section has the key `patch`.
    fn check_patch(&self, section: &MaterialSection) -> Result<(), FileError> {
        match &section.patch {
            Some(key) => {
                let error = self.error(key.span(), "`patch` is a key of [material.NAME] alone");
                Err(error.help("leave it out: this is a patch already"))
            }
            None => Ok(()),
        }
    }
}
