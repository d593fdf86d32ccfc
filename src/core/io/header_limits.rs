//! Limits on headers of pictures: memory is allocated for the pixels before they are read.

use super::FileError;
use ::exr::prelude as exr;
use std::path::Path;

/// Pixels that an image may have.
const MAX_PIXELS: u64 = 1 << 28;
/// Bytes of samples, and so pixels too, that a byte of a file may hold. Deflate, the tightest code in use, makes one byte of 1032 at most (zlib's manual).
const MAX_BYTES_PER_BYTE: u64 = 1032;

/// An error where a layer, or a block of it, is larger than an EXR file of `file_bytes` can have: the exr crate (1.74) takes as much memory
/// as a block's length says, before it reads the block, if its pixels could be as many.
pub(super) fn check_exr(path: &Path, file_bytes: u64, meta: &exr::MetaData) -> Result<(), FileError> {
    for header in &meta.headers {
        let (width, height) = (header.layer_size.width(), header.layer_size.height());
        check_size(path, file_bytes, width, height)?;
        // All channels together, of which there may be thousands
        let bytes = (width as u64 * height as u64).saturating_mul(header.channels.bytes_per_pixel as u64);
        if bytes > file_bytes.saturating_mul(MAX_BYTES_PER_BYTE) {
            let count = header.channels.list.len();
            let message = format!(
                "the header says {width}x{height} pixels of {count} channels, which {file_bytes} bytes cannot hold"
            );
            return Err(FileError::new(path, message).help("the file may be damaged"));
        }
        let block = header.max_block_pixel_size();
        check_size(path, file_bytes, block.width(), block.height())?;
    }
    Ok(())
}

/// An error where the header of `path` names more pixels than an image, or a file of so many bytes, can have.
pub(super) fn check_size(path: &Path, bytes: u64, width: usize, height: usize) -> Result<(), FileError> {
    let max = MAX_PIXELS.min(bytes.saturating_mul(MAX_BYTES_PER_BYTE));
    if (width as u64)
        .checked_mul(height as u64)
        .is_some_and(|pixels| pixels <= max)
    {
        return Ok(());
    }
    let message = format!("the header says {width}x{height} pixels; at most {max} can be read from {bytes} bytes");
    Err(FileError::new(path, message).help("the file may be damaged; else scale the image down"))
}
