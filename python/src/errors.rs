//! Python exceptions for errors of the library. Their texts are the same as on the command line.

use embrasure::io::FileErrorKind;
use pyo3::create_exception;
use pyo3::exceptions::{PyException, PyTypeError};
use pyo3::prelude::*;

create_exception!(embrasure, Error, PyException, "An error of Embrasure.");
create_exception!(
    embrasure,
    SettingError,
    Error,
    "A setting, or a key of the scene, is invalid."
);
create_exception!(
    embrasure,
    FileError,
    Error,
    "A file cannot be read or written, or is invalid: the path `file`, and `line`, `column` and `help` if known."
);

/// Error of pickling an object of the class `name`, which cannot be pickled because its memory
/// belongs to the process.
pub fn no_pickle(name: &str, help: &str) -> PyErr {
    PyTypeError::new_err(format!("cannot pickle a {name}: {help}"))
}

/// Prefix of errors about keys that override keys of a scene file. The prefix is removed, because
/// Python has no flags.
const SET: &str = "--set ";

/// Exception for an error of a session.
pub fn of_session(py: Python, error: embrasure::Error) -> PyErr {
    match error {
        embrasure::Error::Setting(invalid) => SettingError::new_err(invalid.to_string()),
        embrasure::Error::Refused(words) => SettingError::new_err(without_flag(&words)),
        embrasure::Error::File(error) => of_file(py, &error),
        error => Error::new_err(error.to_string()),
    }
}

/// Exception for an error of a file.
pub fn of_file(py: Python, error: &embrasure::FileError) -> PyErr {
    if error.kind == FileErrorKind::Flag {
        let help = error.help.as_ref().map(|help| format!("\n  help: {help}"));
        return SettingError::new_err(without_flag(&error.message) + &help.unwrap_or_default());
    }
    let raised = FileError::new_err(error.to_string());
    let value = raised.value(py);
    let position = error.position;
    let set = || {
        value.setattr("file", error.file.display().to_string())?;
        value.setattr("line", position.map(|position| position.line))?;
        value.setattr("column", position.and_then(|position| position.column))?;
        value.setattr("help", error.help.clone())
    };
    match set() {
        Ok(()) => raised,
        Err(other) => other,
    }
}

fn without_flag(words: &str) -> String {
    words.strip_prefix(SET).unwrap_or(words).to_string()
}
