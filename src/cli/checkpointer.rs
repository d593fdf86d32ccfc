use super::args::RenderArgs;
use super::error::CliError;
use crate::files::{Output, OutputLock};
use crate::io::{Checkpoint, FileError, Metadata, read_checkpoint};
use crate::session::{RenderState, Renderer};

/// Default time in seconds between checkpoints.
const USUAL_INTERVAL: f64 = 60.0;

/// Writes and reads checkpoints: `--checkpoint` and `--resume`.
pub(super) struct Checkpointer {
    output: Output,
    /// Lock of the file against other processes.
    _lock: OutputLock,
    /// Checkpoint of an earlier run.
    found: Option<Checkpoint>,
    /// Time in seconds between two checkpoints.
    pub interval: f64,
}

impl Checkpointer {
    /// Returns a checkpointer that writes to `output`; `None` without `output`. An existing
    /// checkpoint is an error, unless the render resumes from it.
    pub fn new(args: &RenderArgs, output: Option<Output>) -> Result<Option<Self>, CliError> {
        let Some(output) = output else {
            return Ok(None);
        };
        // The lock prevents other processes from writing the file.
        let lock = output.lock()?;
        let path = output.path();
        // A file system that fails to respond must not look like a missing file.
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

    /// State of the checkpoint to resume from, if any.
    pub fn restore(&mut self, renderer: &Renderer) -> Result<Option<RenderState>, CliError> {
        let Some(found) = self.found.take() else {
            return Ok(None);
        };
        Ok(Some(renderer.resume(found)?))
    }

    /// Writes the complete `state` to the checkpoint file.
    pub fn keep(&self, state: &RenderState, metadata: &Metadata) -> Result<(), FileError> {
        state.keep(&self.output, metadata)
    }
}
