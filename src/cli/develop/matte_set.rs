//! A file with a mask for each part, object or material: `-o 'masks/{part}.png'`.

use super::matte::{WHY_EMPTY, no_match, quoted, write_mask};
use crate::cli::args::DevelopArgs;
use crate::cli::error::CliError;
use crate::cli::outputs::Outputs;
use crate::cli::printing;
use crate::color::Tone;
use crate::files::create_folder;
use crate::io::{ExrFormat, FileError, Layers, Mattes};
use crate::math::Glob;
use std::collections::HashSet;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

/// Placeholders in file names, each with the end of the layer that has its names.
pub(super) const PLACEHOLDERS: [(&str, &str); 3] = [
    ("part", "CryptoPart"),
    ("object", "CryptoObject"),
    ("material", "CryptoMaterial"),
];

/// Maximum number of characters of a name in a file name.
const MAX_LETTERS: usize = 100;

/// Kind of the names for which a mask is written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Kind {
    /// Placeholder without braces, such as `part`.
    name: &'static str,
    /// End of the name of the layer, such as `CryptoPart`.
    layer: &'static str,
}

impl Kind {
    /// Kind of the placeholder in all file names of `-o`; `None` without placeholders.
    ///
    /// # Errors
    ///
    /// The file names have different placeholders, or other flags do not apply to masks.
    pub fn of(args: &DevelopArgs) -> Result<Option<Self>, CliError> {
        let of_path = |path: &PathBuf| {
            let text = path.to_string_lossy();
            let has = |(name, _): &&(&str, &str)| text.contains(&format!("{{{name}}}"));
            let found = PLACEHOLDERS.iter().find(has);
            found.map(|&(name, layer)| Self { name, layer })
        };
        let mut kinds = args.output.iter().map(of_path);
        let first = kinds.next().flatten();
        if kinds.any(|kind| kind != first) {
            return Err(CliError::Usage(
                "-o: only some names have {part}, or they have different placeholders\n  \
                 help: write masks and other pictures by separate commands"
                    .into(),
            ));
        }
        let Some(kind) = first else { return Ok(None) };
        let is_refused = args.channel.is_some()
            || args.denoise.is_some()
            || args.lines.is_some()
            || args.tone.0.exposure.is_some()
            || args.tone.0.tone.is_some();
        if is_refused {
            return Err(CliError::Usage(format!(
                "-o with {{{}}} writes masks, which have no --channel, --denoise, --lines, --exposure or --tone\n  \
                 help: leave these flags out",
                kind.name
            )));
        }
        Ok(Some(kind))
    }

    /// The layer with the names of this kind.
    fn mattes(self, layers: &Layers) -> Option<&Mattes> {
        layers.mattes.iter().find(|mattes| mattes.layer.ends_with(self.layer))
    }

    /// The path `path` with `text` in place of the placeholder.
    fn path(self, path: &Path, text: &str) -> PathBuf {
        path.to_string_lossy()
            .replace(&format!("{{{}}}", self.name), text)
            .into()
    }
}

/// Writes a mask for each name of `kind` that matches `--matte`. Names without a visible pixel get
/// no file, and are reported.
pub(super) fn write(
    args: &DevelopArgs,
    layers: &Layers,
    kind: Kind,
    outputs: &mut Outputs,
    exr: &ExrFormat,
) -> Result<ExitCode, CliError> {
    let pattern = args.matte.as_deref().unwrap_or("*");
    let Some(mattes) = kind.mattes(layers) else {
        return Err(no_layer(args, layers, kind).into());
    };
    let glob = Glob::new(pattern);
    let mut matching = mattes.names.iter().filter(|(name, _)| glob.matches(name)).peekable();
    if matching.peek().is_none() {
        return Err(no_match(args, layers, pattern).into());
    }
    // The layer of parts also has the names of objects, for faces without a part.
    let objects = layers.mattes.iter().filter(|other| {
        let is_of_objects = other.layer.ends_with("CryptoObject");
        kind.name == "part" && is_of_objects
    });
    let objects: HashSet<&String> = objects.flat_map(|other| &other.names).map(|(name, _)| name).collect();
    let visible = layers.visible_ids(mattes);
    let (mut used, mut empty, mut written) = (HashSet::new(), Vec::new(), Vec::new());
    for entry in matching {
        let (name, id) = entry;
        if !visible.contains(&id.to_bits()) {
            if !objects.contains(name) {
                empty.push(name.clone());
            }
            continue;
        }
        let Some(mask) = layers.mask_of(mattes, entry) else {
            return Err(no_match(args, layers, name).into());
        };
        let text = unused(file_name(name), &mut used);
        let paths: Vec<PathBuf> = args.output.iter().map(|path| kind.path(path, &text)).collect();
        paths.iter().try_for_each(|path| make_folder(path))?;
        let files = outputs.prepare_images(&paths, Tone::default(), exr)?;
        outputs.refuse_inputs([&*args.input])?;
        write_mask(args, layers, (mask, name), &files, exr)?;
        written.extend(paths.first().cloned());
    }
    if !args.quiet {
        let count = printing::count(written.len() as u64, "mask");
        let place = match written.as_slice() {
            [] => String::new(),
            [only] => format!(" -> {}", only.display()),
            [first, .., last] => format!(" -> {} … {}", first.display(), last.display()),
        };
        errln!("{count} of {}s{place}", kind.name);
    }
    if !empty.is_empty() {
        let count = printing::count(empty.len() as u64, kind.name);
        printing::warning(format_args!(
            "no mask is written for {count} that no pixel shows: {}\n  help: {WHY_EMPTY}",
            quoted(&empty)
        ));
    }
    Ok(ExitCode::SUCCESS)
}

/// Error for a file that lacks the names of `kind`.
fn no_layer(args: &DevelopArgs, layers: &Layers, kind: Kind) -> FileError {
    if layers.mattes.is_empty() {
        return no_match(args, layers, "*");
    }
    let others = PLACEHOLDERS.map(|(name, layer)| Kind { name, layer });
    let there = others.into_iter().filter(|other| other.mattes(layers).is_some());
    let there: Vec<String> = there.map(|other| format!("{{{}}}", other.name)).collect();
    FileError::new(&args.input, format!("has no mattes of {}s", kind.name)).help(format!("use {}", there.join(" or ")))
}

/// Creates the folder of `path`, if it does not exist.
fn make_folder(path: &Path) -> Result<(), FileError> {
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty());
    folder.map_or(Ok(()), create_folder)
}

/// `name` as a part of a file name: separators of folders and other special characters become `_`.
fn file_name(name: &str) -> String {
    let is_plain = |c: char| c.is_alphanumeric() || " -_.+()[]#@,=".contains(c);
    let plain = name.chars().map(|c| if is_plain(c) { c } else { '_' });
    let text: String = plain.take(MAX_LETTERS).collect();
    match text.trim().strip_prefix('.') {
        Some(rest) => format!("_{rest}"),
        None if text.trim().is_empty() => "_".into(),
        None => text.trim().into(),
    }
}

/// `text`, with a number behind it if `used` has the text already. Upper and lower case count as
/// equal, as in the file systems of some machines.
fn unused(text: String, used: &mut HashSet<String>) -> String {
    let mut candidate = text.clone();
    let mut number = 2;
    while !used.insert(candidate.to_lowercase()) {
        candidate = format!("{text}-{number}");
        number += 1;
    }
    candidate
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_become_file_names() {
        let names = ["Cube.015_Cube.023", "a/b:c", "..", "", "été 1"].map(file_name);
        assert_eq!(names, ["Cube.015_Cube.023", "a_b_c", "_.", "_", "été 1"]);
        let mut used = HashSet::new();
        let names = ["a_b", "A_b", "a_b", "c"].map(|name| unused(name.into(), &mut used));
        assert_eq!(names, ["a_b", "A_b-2", "a_b-3", "c"]);
    }
}
