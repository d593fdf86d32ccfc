//! Patches of materials, in the order in which they apply: those of the scene file as it has them, then those of flags.

use super::presets::Preset;
use super::section::Section;
use super::unknown_key::parser_error;
use super::{FileError, MaterialSection, SceneFile};
use crate::math::Glob;
use std::borrow::Cow;
use std::collections::HashMap;
use std::ops::Range;
use toml::Spanned;

/// Keys that materials whose names match get in place of their own.
pub(super) struct Patch<'a> {
    pub glob: Glob,
    /// The glob or name, as it is written.
    pub written: &'a str,
    /// Place of the patch in the file.
    pub span: Range<usize>,
    pub section: Cow<'a, MaterialSection>,
}

/// The glob that matches `name` alone.
#[cfg(feature = "view")]
pub(crate) fn glob_of_name(name: &str) -> String {
    Glob::exact(name).text(0)
}

/// Patches, and which of them have met a material.
#[derive(Default)]
pub(super) struct PatchList<'a> {
    patches: Vec<(Patch<'a>, bool)>,
    /// Those of a single name: a scene may have very many.
    by_name: HashMap<String, Vec<usize>>,
    /// The others.
    by_glob: Vec<usize>,
}

impl<'a> PatchList<'a> {
    /// A list in which each patch applies after those before it.
    pub fn new(patches: Vec<Patch<'a>>) -> Self {
        let mut list = Self::default();
        for (index, patch) in patches.into_iter().enumerate() {
            match patch.glob.is_exact() {
                true => list.by_name.entry(patch.glob.literal()).or_default().push(index),
                false => list.by_glob.push(index),
            }
            list.patches.push((patch, false));
        }
        list
    }

    /// The patches of the material `name`, which have met one now.
    pub fn of_material(&mut self, name: &str) -> Vec<&Patch<'a>> {
        let matches = |&index: &usize| self.patches[index].0.glob.matches(name);
        let mut indices: Vec<usize> = self.by_glob.iter().copied().filter(matches).collect();
        indices.extend(self.by_name.get(name).into_iter().flatten());
        indices.sort_unstable();
        for &index in &indices {
            self.patches[index].1 = true;
        }
        indices.into_iter().map(|index| &self.patches[index].0).collect()
    }

    /// Patches that match no material.
    pub fn unused(&self) -> impl Iterator<Item = &Patch<'a>> {
        self.patches
            .iter()
            .filter(|(_, is_used)| !is_used)
            .map(|(patch, _)| patch)
    }
}

/// The glob and the patch `KEY=VALUE` of `GLOB.KEY=VALUE` or `GLOB=PRESET`. The last dot before the
/// `=` ends the glob if a key follows. The glob may stand between quotes.
fn parts(written: &str) -> Option<(&str, Cow<'_, str>)> {
    let (name, value) = written.split_once('=')?;
    let key = name.rsplit_once('.').filter(|(_, key)| {
        // Names of materials may have dots.
        MaterialSection::KEYS.iter().any(|known| known.key == key.trim()) || Preset::of_name(value.trim()).is_none()
    });
    let (glob, patch) = match key {
        Some((glob, _)) => (glob, Cow::Borrowed(&written[glob.len() + 1..])),
        None => {
            let preset = value.trim().trim_matches(['"', '\'']);
            (name, Cow::Owned(format!("preset={}", toml::Value::from(preset))))
        }
    };
    let glob = glob.trim();
    let quoted = |quote| glob.strip_prefix(quote).and_then(|glob| glob.strip_suffix(quote));
    Some((quoted('"').or(quoted('\'')).unwrap_or(glob), patch))
}

impl SceneFile {
    /// Adds patches of materials after those of the file, each as `GLOB.KEY=VALUE` or
    /// `GLOB=PRESET`: a glob of names, a key of `[material.NAME]` and a value of TOML or a plain
    /// string.
    ///
    /// # Errors
    ///
    /// A text that is no patch. Keys and values are checked when the scene is loaded.
    pub fn patch_materials(&mut self, written: &[String]) -> Result<(), FileError> {
        for written in written {
            let bytes = self.source.bytes();
            let added = parts(written)
                .ok_or(())
                .and_then(|(glob, patch)| self.source.overrides.add_patch_of(glob, &patch, written, bytes));
            // A picture that a flag does not change is a surprise.
            let added = added.map(|()| self.source.overrides.require_match());
            added.map_err(|()| {
                let error = self.whole(format!("--material {written}: expected NAME.KEY=VALUE or NAME=PRESET"));
                let help = "NAME is a material or a pattern, as in 'Floor*.roughness=0.2' or ring=gold";
                error.of_flag().help(help)
            })?;
        }
        Ok(())
    }

    /// Adds a patch of the material `name`, whatever characters that has: `value` of TOML, or a plain string, for a key of `[material.NAME]`.
    ///
    /// # Errors
    ///
    /// A key that is none. Keys and values are checked when the scene is loaded.
    #[cfg(feature = "view")]
    pub(crate) fn patch_material(&mut self, name: &str, key: &str, value: &str) -> Result<(), FileError> {
        let (bytes, patch) = (self.source.bytes(), format!("{key}={value}"));
        let written = format!("{name}.{patch}");
        let added = self
            .source
            .overrides
            .add_patch_of(&glob_of_name(name), &patch, &written, bytes);
        added.map_err(|()| {
            self.whole(format!("--material {written}: expected NAME.KEY=VALUE"))
                .of_flag()
        })
    }

    /// The section that replaces materials of this name, and its key.
    pub(super) fn replacement(&self, name: &str) -> Option<(&Spanned<String>, &MaterialSection)> {
        let section = self.material.get_key_value(name);
        section.filter(|(_, section)| !section.is_patch())
    }

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
        for (written, line) in self.source.overrides.patches() {
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
                let error = self.error(key.span(), "`patch` belongs in [material.NAME] only");
                Err(error.help("remove it: this section is already a patch"))
            }
            None => Ok(()),
        }
    }
}
