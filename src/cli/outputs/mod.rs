//! The files that a command writes. None may be another output or a file that the command reads (`files/identity.rs`).
//!
//! `images` gives images their formats, and those of a render their names; `default_names` has the names where there is no `-o`.

mod default_names;
mod images;

pub(super) use images::{Images, images_of_render, show};

use super::error::CliError;
use super::words;
use crate::files::{FileId, Output};
use std::path::Path;

/// Files to write, by the flags that name them.
#[derive(Default)]
pub(super) struct Outputs {
    files: Vec<(&'static str, String, FileId)>,
    /// Files of whose other names the user was warned.
    warned: Vec<FileId>,
}

impl Outputs {
    /// Checks that the file `path`, which `flag` names, can be written, and takes it in. Warns of other names of it.
    ///
    /// # Errors
    ///
    /// The file cannot be written, or it is the same file as another output.
    pub fn prepare(&mut self, flag: &'static str, path: &Path) -> Result<Output, CliError> {
        let output = Output::prepare(path)?;
        self.add(flag, &output)?;
        self.warn_of_other_names(flag, &output);
        Ok(output)
    }

    /// Warns once of other names of a file that will be replaced.
    fn warn_of_other_names(&mut self, flag: &str, output: &Output) {
        let Some(id) = output
            .id()
            .filter(|id| output.other_names() > 0 && !self.warned.contains(id))
        else {
            return;
        };
        self.warned.push(id);
        let name = output.path().display();
        words::warning(format_args!(
            "{flag} {name}: other names of this file (hard links) keep its old contents"
        ));
    }

    /// Takes in `output`, which `flag` names.
    ///
    /// # Errors
    ///
    /// Another output is the same file.
    pub fn add(&mut self, flag: &'static str, output: &Output) -> Result<(), CliError> {
        let (name, Some(id)) = (output.path().display().to_string(), output.id()) else {
            return Ok(());
        };
        if let Some((other_flag, other, _)) = self.files.iter().find(|(.., other)| *other == id) {
            return Err(CliError::Usage(format!(
                "{flag} {name} is the same file as {other_flag} {other}\n  help: give each output a name of its own"
            )));
        }
        self.files.push((flag, name, id));
        Ok(())
    }

    /// Forgets the outputs that `flag` names.
    pub fn forget(&mut self, flag: &str) {
        self.files.retain(|(other, ..)| *other != flag);
    }

    /// Refuses outputs that are among the files `read`, by whatever name.
    pub fn spare<'a>(&self, read: impl IntoIterator<Item = &'a Path>) -> Result<(), CliError> {
        for path in read {
            let id = FileId::of(path);
            if let Some((flag, name, _)) = self.files.iter().find(|(.., output)| Some(output) == id.as_ref()) {
                return Err(CliError::Usage(format!(
                    "{flag} {name} would overwrite {}, which this command reads\n  help: give the output another name",
                    path.display()
                )));
            }
        }
        Ok(())
    }
}
