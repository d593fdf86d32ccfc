//! Files that a command writes. Two outputs must not be the same file, and no output may be a file
//! that the command reads (`files/identity.rs`).
//!
//! `images` has the formats of images and the names of rendered images. `default_names` makes the
//! names if there is no `-o`. `faces` divides cube maps into six files.

mod default_names;
mod faces;
mod images;

pub(super) use faces::face;
pub(super) use images::{Images, face_error, images_of_render};

use super::error::CliError;
use super::printing;
use crate::files::{FileId, Output};
use std::path::Path;

/// Output files with the flags that name them.
#[derive(Default)]
pub(super) struct Outputs {
    files: Vec<(&'static str, String, FileId)>,
    /// Files whose hard links were already named in a warning.
    warned: Vec<FileId>,
}

impl Outputs {
    /// Checks that the file `path` of `flag` can be written, and adds it to the outputs. Warns if
    /// the file has other names (hard links).
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

    /// Warns once if a file that will be replaced has other names (hard links).
    fn warn_of_other_names(&mut self, flag: &str, output: &Output) {
        let Some(id) = output
            .id()
            .filter(|id| output.other_names() > 0 && !self.warned.contains(id))
        else {
            return;
        };
        self.warned.push(id);
        let name = output.path().display();
        printing::warning(format_args!(
            "{flag} {name}: other names of this file (hard links) keep its old contents"
        ));
    }

    /// Adds `output` of `flag` to the outputs.
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

    /// Removes the outputs of `flag`.
    pub fn remove(&mut self, flag: &str) {
        self.files.retain(|(other, ..)| *other != flag);
    }

    /// Returns an error if an output is among the files `read`, under any name.
    pub fn refuse_inputs<'a>(&self, read: impl IntoIterator<Item = &'a Path>) -> Result<(), CliError> {
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
