use super::args::MergeArgs;
use super::error::CliError;
use super::outputs::{Outputs, face_error};
use super::printing;
use crate::camera::cube_faces;
use crate::files::Output;
use crate::film::Rect;
use crate::io::FileError;
use crate::session::{PictureParts, Settings, all_threads, thread_pool};
use std::path::PathBuf;
use std::process::ExitCode;

/// Joins parts of a picture, and writes the same picture as a single render.
pub(super) fn merge(args: &MergeArgs) -> Result<ExitCode, CliError> {
    // Read the headers first, so that incompatible parts are rejected early.
    let parts = PictureParts::describe(&args.parts)?;
    let finish = args.finish(parts.finish());
    let settings = Settings {
        tone: finish.tone,
        denoiser: finish.denoiser,
        denoise_radius: finish.denoise_radius,
        threads: args.threads.unwrap_or_else(all_threads),
        ..Settings::default()
    };
    settings.check()?;
    let mut outputs = Outputs::default();
    let images = outputs.prepare_images(&args.output, finish.tone, &args.exr.format()?)?;
    let size = parts.resolution();
    let is_cube = cube_faces(size).is_some_and(|(side, _)| parts.view_size().to_array() == [side; 2]);
    if images.has_faces() && !is_cube {
        let help = "give a name without the placeholder, or merge parts of `render --projection cubemap`";
        return Err(face_error("the parts belong to no cube map", help));
    }
    if images.has_faces() && parts.crop() != Rect::full(size) {
        let help = "merge all parts, or write one file";
        return Err(face_error("the parts are not the whole picture", help));
    }
    let checkpoint = args.checkpoint.as_deref();
    let checkpoint = checkpoint
        .map(|path| outputs.prepare("--checkpoint", path))
        .transpose()?;
    outputs.refuse_inputs(args.parts.iter().map(PathBuf::as_path))?;
    let _lock = checkpoint.as_ref().map(Output::lock).transpose()?;
    let pool = thread_pool(settings.threads)?;
    // A picture needs all samples, unless `--allow-gaps` is given. A checkpoint alone may be
    // incomplete.
    let mut joined = pool.install(|| parts.join(args.output.is_empty(), args.allow_gaps))?;
    let failures: Vec<FileError> = pool.install(|| {
        let unkept = checkpoint.and_then(|output| joined.state.keep(&output, &joined.metadata).err());
        let unwritten = if images.is_empty() {
            Vec::new()
        } else {
            let (image, denoised) = joined.develop(&finish);
            if let Err(error) = denoised {
                printing::warning(format!("the pictures are not denoised: {error}"));
            }
            let mut failures = joined.write(&image, images.whole());
            failures.extend(images.write_faces(&image, &joined.metadata));
            failures
        };
        unkept.into_iter().chain(unwritten).collect()
    });
    if !failures.is_empty() {
        return Err(CliError::of_failures(&failures));
    }
    if !args.quiet {
        let (samples, size) = (parts.samples(), parts.crop().size());
        errln!(
            "{}, samples {}..{} of {}x{} pixels, {:.1} s of rendering{}{}",
            printing::count(parts.count() as u64, "part"),
            samples.start,
            samples.end,
            size.x,
            size.y,
            joined.state.seconds,
            if joined.metadata.complete { "" } else { ", with gaps" },
            match &joined.metadata.denoiser {
                Some(denoiser) => format!(", denoised by {denoiser}"),
                None => String::new(),
            }
        );
    }
    Ok(ExitCode::SUCCESS)
}
