//! [Open Image Denoise 2](https://www.openimagedenoise.org) on the CPU, for still pictures with
//! guides.
//!
//! The `oidn` crate links the library and binds it. The safe filter of that crate (2.4.1) always
//! has a colour image, so that guides cannot be filtered separately. The filter misspells the
//! parameter `cleanAux`, which the library then ignores. It accepts no number of threads and no
//! memory limit. This crate makes the same few calls with these four additions.

#![allow(unsafe_code)] // This crate calls a C library. Each call has a SAFETY comment.

use oidn::sys::*;
use std::ffi::CStr;
use std::fmt;
use std::ptr;

/// Error message of Open Image Denoise.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Error(String);

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str(&self.0)
    }
}

impl std::error::Error for Error {}

impl Error {
    /// First error of a device since the last check, or of this thread if the handle is null.
    /// `None` if there was no error.
    fn of(device: OIDNDevice) -> Option<Self> {
        let mut message = ptr::null();
        // SAFETY: the handle is a live device or null. For null, the library returns the errors of
        // the thread.
        let code = unsafe { oidnGetDeviceError(device, &mut message) };
        if code == OIDNError_OIDN_ERROR_NONE {
            return None;
        }
        if message.is_null() {
            return Some(Self(format!("error {code}")));
        }
        // SAFETY: the library's message ends with a zero, and stays valid until the next error of
        // this thread.
        let words = unsafe { CStr::from_ptr(message) }.to_string_lossy();
        Some(Self(words.into_owned()))
    }

    /// First error of a device, or `words` if the library reports none.
    fn or(device: OIDNDevice, words: &str) -> Self {
        Self::of(device).unwrap_or_else(|| Self(words.into()))
    }
}

/// Width and height in pixels.
pub type Size = [usize; 2];

/// The CPU as a device of Open Image Denoise.
pub struct Device {
    device: oidn::Device,
    max_memory_mb: u32,
}

impl Device {
    /// Device with `threads` threads. Its filters take at most `max_memory_mb` MiB without the
    /// images, and process larger pictures in tiles.
    pub fn new(threads: usize, max_memory_mb: u32) -> Result<Self, Error> {
        // SAFETY: the type is a constant of the header. The function may return null, which is
        // handled.
        let handle = unsafe { oidnNewDevice(OIDNDeviceType_OIDN_DEVICE_TYPE_CPU) };
        if handle.is_null() {
            return Err(Error::or(handle, "no device"));
        }
        let threads = i32::try_from(threads).unwrap_or(i32::MAX);
        // SAFETY: the handle is a live device. Its parameters are set before it is committed, as
        // the library requires. The wrapper owns the handle from then on and releases it.
        let device = unsafe {
            oidnSetDeviceInt(handle, c"numThreads".as_ptr(), threads);
            // Threads bound to cores would wait for other programs on these cores.
            oidnSetDeviceBool(handle, c"setAffinity".as_ptr(), false);
            oidnCommitDevice(handle);
            oidn::Device::from_raw(handle)
        };
        let device = Self { device, max_memory_mb };
        device.check()?;
        Ok(device)
    }

    fn raw(&self) -> OIDNDevice {
        // SAFETY: the handle belongs to a live device, and nothing here releases it.
        unsafe { self.device.raw() }
    }

    /// Returns an error if a call failed since the last check.
    fn check(&self) -> Result<(), Error> {
        Error::of(self.raw()).map_or(Ok(()), Err)
    }

    fn buffer(&self, contents: &[f32]) -> Result<oidn::Buffer, Error> {
        let buffer = self.device.create_buffer(contents);
        buffer.ok_or_else(|| Error::or(self.raw(), "no memory for a buffer"))
    }

    /// Version of the library, such as `2.5.1`.
    pub fn version(&self) -> String {
        let numbers = [c"versionMajor", c"versionMinor", c"versionPatch"].map(|name| {
            // SAFETY: the handle is a live device, and the name ends with a zero.
            unsafe { oidnGetDeviceInt(self.raw(), name.as_ptr()) }.to_string()
        });
        numbers.join(".")
    }

    /// Denoises an albedo: three numbers from 0 to 1 per pixel, row by row.
    pub fn albedo(&self, albedo: &[f32], size: Size) -> Result<Vec<f32>, Error> {
        self.run(&[(c"albedo", albedo)], &[], Quality::HIGH, size)
    }

    /// Denoises normals: three numbers from −1 to 1 per pixel, row by row.
    pub fn normal(&self, normal: &[f32], size: Size) -> Result<Vec<f32>, Error> {
        self.run(&[(c"normal", normal)], &[], Quality::HIGH, size)
    }

    /// Denoises a picture of linear radiance, with optional denoised guides: albedo and normals.
    pub fn color(&self, color: &[f32], guides: Option<[&[f32]; 2]>, size: Size) -> Result<Vec<f32>, Error> {
        let flags: &[&CStr] = if guides.is_some() {
            &[c"hdr", c"cleanAux"]
        } else {
            &[c"hdr"]
        };
        self.run(&images(color, guides), flags, Quality::HIGH, size)
    }

    /// Denoises a picture of linear radiance with the library's fast quality, with optional noisy
    /// guides: albedo and normals. Some noise remains.
    pub fn color_fast(&self, color: &[f32], guides: Option<[&[f32]; 2]>, size: Size) -> Result<Vec<f32>, Error> {
        self.run(&images(color, guides), &[c"hdr"], Quality::FAST, size)
    }

    /// Runs `RT`, the library's filter for ray-traced images, on the named `images`, with `flags`
    /// enabled.
    fn run(
        &self,
        images: &[(&CStr, &[f32])],
        flags: &[&CStr],
        quality: Quality,
        size: Size,
    ) -> Result<Vec<f32>, Error> {
        let [width, height] = size;
        let len = width.checked_mul(height).and_then(|pixels| pixels.checked_mul(3));
        if images.iter().any(|(_, image)| Some(image.len()) != len) {
            return Err(Error("the size of an image is not that of the picture".into()));
        }
        // Buffers live longer than the filter, which refers to them.
        let output = self.buffer(&vec![0.0; len.unwrap_or(0)])?;
        let mut buffers = vec![(c"output", output)];
        for &(name, image) in images {
            buffers.push((name, self.buffer(image)?));
        }
        let filter = Filter::new(self)?;
        for (name, buffer) in &buffers {
            let format = OIDNFormat_OIDN_FORMAT_FLOAT3;
            // SAFETY: filter and buffer are live, and the buffer has width · height pixels of three
            // floats.
            unsafe { oidnSetFilterImage(filter.0, name.as_ptr(), buffer.raw(), format, width, height, 0, 0, 0) };
        }
        for flag in flags {
            // SAFETY: the filter is live, and the name ends with a zero.
            unsafe { oidnSetFilterBool(filter.0, flag.as_ptr(), true) };
        }
        // SAFETY: the filter is live, and the name ends with a zero; the value is a constant of the
        // header.
        unsafe { oidnSetFilterInt(filter.0, c"quality".as_ptr(), quality.0) };
        let limit = i32::try_from(self.max_memory_mb).unwrap_or(i32::MAX);
        // SAFETY: the filter is live, and the name ends with a zero.
        unsafe { oidnSetFilterInt(filter.0, c"maxMemoryMB".as_ptr(), limit) };
        // SAFETY: the filter is live, and everything that it refers to is live; the filter is done
        // when the call returns.
        unsafe {
            oidnCommitFilter(filter.0);
            oidnExecuteFilter(filter.0);
        }
        let pixels = buffers[0].1.read();
        self.check()?;
        Ok(pixels)
    }
}

/// A picture and its guides, with their names in the filter `RT`.
fn images<'a>(color: &'a [f32], guides: Option<[&'a [f32]; 2]>) -> Vec<(&'static CStr, &'a [f32])> {
    let guides = guides.map(|[albedo, normal]| [(c"albedo", albedo), (c"normal", normal)]);
    std::iter::once((c"color", color))
        .chain(guides.into_iter().flatten())
        .collect()
}

/// Quality of a filter, with the library's number.
#[derive(Clone, Copy)]
struct Quality(i32);

impl Quality {
    const HIGH: Self = Self(OIDNQuality_OIDN_QUALITY_HIGH);
    const FAST: Self = Self(OIDNQuality_OIDN_QUALITY_FAST);
}

/// A filter, released on drop.
struct Filter(OIDNFilter);

impl Filter {
    fn new(device: &Device) -> Result<Self, Error> {
        // SAFETY: the handle is a live device, and the name ends with a zero. The function may
        // return null, which is handled.
        let handle = unsafe { oidnNewFilter(device.raw(), c"RT".as_ptr()) };
        if handle.is_null() {
            return Err(Error::or(device.raw(), "no filter"));
        }
        Ok(Self(handle))
    }
}

impl Drop for Filter {
    fn drop(&mut self) {
        // SAFETY: the handle is not null and not used again.
        unsafe { oidnReleaseFilter(self.0) };
    }
}
