use super::args::RenderArgs;
use super::error::CliError;
use crate::files::{Output, OutputLock};
use crate::io::{Checkpoint, FileError, Metadata, read_checkpoint};
use crate::session::{RenderState, Renderer};

/// Default of the seconds between checkpoints.
const USUAL_INTERVAL: f64 = 60.0;

/// Writes checkpoints and reads them: `--checkpoint` and `--resume`.
pub(super) struct Checkpointer {
    output: Output,
    /// Lock of the file against other runs.
    _lock: OutputLock,
    /// The checkpoint of an earlier run.
    found: Option<Checkpoint>,
    /// Seconds between two checkpoints.
    pub interval: f64,
}

impl Checkpointer {
    /// Checkpointer that writes to `output`, if the arguments name one. What is there already is not overwritten, unless the render goes on from it.
    pub fn new(args: &RenderArgs, output: Option<Output>) -> Result<Option<Self>, CliError> {
        let Some(output) = output else {
            return Ok(None);
        };
        // No thread writes it from here on.
        let lock = output.lock()?;
        let path = output.path();
        // A file system that fails to answer must not pass for one without the file.
        let is_there = path.try_exists().map_err(|error| {
            FileError::system(path, "cannot look for this checkpoint", &error).help("check the disk or the network")
        })?;
        if is_there && !args.resume {
            return Err(CliError::Usage(format!(
                "--checkpoint {} already exists\n  help: add --resume to continue from it, or delete it to start again",
                path.display()
            )));
        }
        Ok(Some(Self {
            found: is_there.then(|| read_checkpoint(path)).transpose()?,
            _lock: lock,
            interval: args.checkpoint_interval.unwrap_or(USUAL_INTERVAL),
            output,
        }))
    }

    /// What the render goes on from, if anything is there.
    pub fn restore(&mut self, renderer: &Renderer) -> Result<Option<RenderState>, CliError> {
        let Some(found) = self.found.take() else {
            return Ok(None);
        };
        Ok(Some(renderer.resume(found)?))
    }

    /// Writes all that is known.
    pub fn keep(&self, state: &RenderState, metadata: &Metadata) -> Result<(), FileError> {
        state.keep(&self.output, metadata)
    }
}
