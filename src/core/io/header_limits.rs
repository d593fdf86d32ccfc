//! Limits on the sizes in headers of pictures. They are needed because memory for the pixels is
//! allocated before the pixels are read, so a damaged header could request any amount.

use super::FileError;
use ::exr::prelude as exr;
use std::path::Path;

/// Maximum number of pixels of an image.
const MAX_PIXELS: u64 = 1 << 28;
/// Maximum number of bytes of samples per byte of a file. It also limits the number of pixels,
/// because each pixel has at least one byte. Deflate has the highest compression of all codings in
/// use: at most 1032 bytes to one byte (manual of zlib).
const MAX_BYTES_PER_BYTE: u64 = 1032;

/// Returns an error if a layer, or a block of a layer, is too large for an EXR file of `file_bytes`
/// bytes. The exr crate (1.74) allocates the memory of a block before it reads the block. The file
/// states the length, and the crate only checks that it is possible for the number of pixels of the
/// block.
pub(super) fn check_exr(path: &Path, file_bytes: u64, meta: &exr::MetaData) -> Result<(), FileError> {
    for header in &meta.headers {
        let (width, height) = (header.layer_size.width(), header.layer_size.height());
        check_size(path, file_bytes, width, height)?;
        // Limit the sum over all channels, because there may be thousands of channels
        let bytes = (width as u64 * height as u64).saturating_mul(header.channels.bytes_per_pixel as u64);
        if bytes > file_bytes.saturating_mul(MAX_BYTES_PER_BYTE) {
            let count = header.channels.list.len();
            let message = format!(
                "the header says {width}x{height} pixels of {count} channels, which a file of {file_bytes} bytes cannot hold"
            );
            return Err(FileError::new(path, message).help("the file may be damaged"));
        }
        let block = header.max_block_pixel_size();
        check_size(path, file_bytes, block.width(), block.height())?;
    }
    Ok(())
}

/// Returns an error if the header of `path` states more than [`MAX_PIXELS`] pixels, or more than a
/// file of `bytes` bytes can hold.
pub(super) fn check_size(path: &Path, bytes: u64, width: usize, height: usize) -> Result<(), FileError> {
    let max = MAX_PIXELS.min(bytes.saturating_mul(MAX_BYTES_PER_BYTE));
    if (width as u64)
        .checked_mul(height as u64)
        .is_some_and(|pixels| pixels <= max)
    {
        return Ok(());
    }
    let message =
        format!("the header says {width}x{height} pixels; at most {max} can be read from a file of {bytes} bytes");
    Err(FileError::new(path, message).help("the file may be damaged; else scale the image down"))
}
