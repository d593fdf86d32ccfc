use super::{FileError, SceneFile, find, join_names};
use toml::Spanned;

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
