//! Things that users name, and their names.

use super::{FileError, SceneFile};
use toml::Spanned;

/// What `name` names among those `known`.
pub(crate) fn find<T: Copy>(known: &[(&str, T)], name: &str) -> Option<T> {
    known.iter().find(|(k, _)| *k == name).map(|(_, value)| *value)
}

/// The name of `value` among those `known`.
pub(crate) fn name_of<T: PartialEq>(known: &[(&'static str, T)], value: T) -> &'static str {
    known.iter().find(|(_, v)| *v == value).map_or("", |(name, _)| name)
}

/// All names, with commas between them.
pub(crate) fn join_names<T>(known: &[(&str, T)]) -> String {
    let names: Vec<&str> = known.iter().map(|(name, _)| *name).collect();
    names.join(", ")
}

/// What a key of the scene file names, if it is there; `what` is its kind, for messages.
pub(crate) fn named<T: Copy>(
    file: &SceneFile,
    what: &str,
    key: &Option<Spanned<String>>,
    known: &[(&str, T)],
) -> Result<Option<T>, FileError> {
    let Some(name) = key else { return Ok(None) };
    match find(known, name.get_ref()) {
        Some(value) => Ok(Some(value)),
        None => {
            let error = file.error(name.span(), format!("unknown {what} `{}`", name.get_ref()));
            Err(error.help(format!("there is {}", join_names(known))))
        }
    }
}
