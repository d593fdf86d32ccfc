//! Denoising of a finished picture, on threads that the caller need not wait for.

use super::Renderer;
use crate::denoise::DenoiseError;
use crate::files::guarded;
use crate::film::Image;
use crate::io::Metadata;
use crate::session::{Settings, thread_pool};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::thread;
use std::time::Duration;

impl Renderer<'_> {
    /// Denoises `image` if the settings have a denoiser, and writes the denoiser into `metadata`.
    /// The picture before denoising is kept in a separate layer.
    ///
    /// # Errors
    ///
    /// Errors of the denoiser; the image is then unchanged.
    pub fn denoise(&self, image: &mut Image, metadata: &mut Metadata) -> Result<(), DenoiseError> {
        if let Some(denoiser) = self.session.settings().denoiser {
            let by = denoiser.version()?;
            let radius = self.session.settings().denoise_radius;
            self.session.install(|| denoiser.apply_with(image, radius))?;
            metadata.denoiser = Some(by);
        }
        Ok(())
    }

    /// Like [`Renderer::denoise`], but on separate threads. If `is_cancelled` returns true before
    /// the end, the function returns and does not wait for the threads.
    ///
    /// # Errors
    ///
    /// The denoiser fails or panics, or `is_cancelled` returned true. The image is then lost:
    /// develop it again.
    pub fn denoise_unless(
        &self,
        image: Image,
        metadata: &mut Metadata,
        is_cancelled: &dyn Fn() -> bool,
    ) -> Result<Image, Unfinished> {
        let (image, by) = denoise(self.session.settings(), image, is_cancelled)?;
        metadata.denoiser = by.or(metadata.denoiser.take());
        Ok(image)
    }
}

/// Returns `image` denoised according to `settings`, and the name of the denoiser, if the settings
/// have one. The denoiser runs on separate threads. If `is_cancelled` returns true before the end,
/// the function returns and does not wait for these threads.
///
/// # Errors
///
/// The denoiser fails or panics, or `is_cancelled` returned true.
pub(crate) fn denoise(
    settings: &Settings,
    mut image: Image,
    is_cancelled: &dyn Fn() -> bool,
) -> Result<(Image, Option<String>), Unfinished> {
    /// Time between two calls of `is_cancelled`.
    const POLL_INTERVAL: Duration = Duration::from_millis(20);
    let Some(denoiser) = settings.denoiser else {
        return Ok((image, None));
    };
    let (threads, radius) = (settings.threads, settings.denoise_radius);
    let (sender, receiver) = channel();
    thread::spawn(move || {
        let done = guarded(|| {
            let by = denoiser.version()?;
            let pool = thread_pool(threads).map_err(|error| DenoiseError::Failed(error.to_string()))?;
            pool.install(|| denoiser.apply_with(&mut image, radius))?;
            Ok((image, Some(by)))
        });
        let _ = sender.send(done.unwrap_or_else(|panic| Err(DenoiseError::Failed(panic))));
    });
    loop {
        match receiver.recv_timeout(POLL_INTERVAL) {
            Ok(done) => return done.map_err(Unfinished::Failed),
            Err(RecvTimeoutError::Timeout) if !is_cancelled() => {}
            Err(_) => return Err(Unfinished::Cancelled),
        }
    }
}

/// Reason why there is no denoised image.
#[derive(Debug)]
#[non_exhaustive]
pub enum Unfinished {
    /// The denoiser failed.
    Failed(DenoiseError),
    /// `is_cancelled` returned true before the end.
    Cancelled,
}
