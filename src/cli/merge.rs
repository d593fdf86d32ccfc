use super::args::MergeArgs;
use super::error::CliError;
use super::outputs::Outputs;
use super::words;
use crate::io::{FileError, Output};
use crate::session::{Parts, Settings, all_threads, thread_pool};
use std::path::PathBuf;
use std::process::ExitCode;

/// Joins parts of a picture, and writes it.
pub(super) fn merge(args: &MergeArgs) -> Result<ExitCode, CliError> {
    let settings = Settings {
        tone: args.tone.0.tone_settings(),
        threads: args.threads.unwrap_or_else(all_threads),
        ..Settings::default()
    };
    settings.check()?;
    let mut outputs = Outputs::default();
    let images = outputs.prepare_images(&args.output, settings.tone, &args.exr.format()?)?;
    let checkpoint = args.checkpoint.as_deref();
    let checkpoint = checkpoint
        .map(|path| outputs.prepare("--checkpoint", path))
        .transpose()?;
    outputs.spare(args.parts.iter().map(PathBuf::as_path))?;
    let _lock = checkpoint.as_ref().map(Output::lock).transpose()?;
    // Headers first: what does not fit together is refused before anything large is read.
    let parts = Parts::describe(&args.parts)?;
    let pool = thread_pool(settings.threads)?;
    // A picture takes all samples; sums that are only kept may be a part of them.
    let joined = pool.install(|| parts.join(args.output.is_empty(), args.allow_gaps))?;
    let failures: Vec<FileError> = pool.install(|| {
        let unkept = checkpoint.and_then(|output| joined.state.keep(&output, &joined.metadata).err());
        unkept.into_iter().chain(joined.write(&images)).collect()
    });
    if !failures.is_empty() {
        return Err(CliError::of_failures(&failures));
    }
    if !args.quiet {
        let (samples, size) = (parts.samples(), parts.crop().size());
        errln!(
            "{}, samples {}..{} of {}x{} pixels, {:.1} s of rendering{}",
            words::count(parts.count() as u64, "part"),
            samples.start,
            samples.end,
            size.x,
            size.y,
            joined.state.seconds,
            if joined.metadata.complete { "" } else { ", with gaps" }
        );
    }
    Ok(ExitCode::SUCCESS)
}
