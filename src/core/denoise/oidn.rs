//! Open Image Denoise 2. Albedo and normals are filtered first, each separately, and then guide the
//! filter of the image (`cleanAux`). For previews, only the image is filtered, with the library's
//! quality `fast` and with unfiltered albedo and normals. This takes a fifth of the time and leaves
//! more noise.
//!
//! The oidn crate (2.5.1) has three defects. It has no filter without a colour image. It spells the
//! parameter `clean_aux`, which the library ignores. It does not accept a number of threads.
//! `sys/oidn` therefore makes these calls through the raw bindings of the crate. docs/denoise.md
//! says how much the filtered guides reduce the error.

use super::layers::Layers;
use super::{DenoiseError, OIDN_MB};
use crate::math::Vec3;
use embrasure_oidn::{Device, Error};

/// `name` with the version of the loaded library.
pub(super) fn version(name: &str) -> Result<String, DenoiseError> {
    Ok(format!("{name} {}", Device::new(1, OIDN_MB).map_err(failed)?.version()))
}

/// Denoises the picture of `layers`: first the guides albedo and normal, each separately, then the
/// picture with the denoised guides. Without guides, only the picture is filtered.
pub(super) fn denoise(layers: &Layers) -> Result<Vec<Vec3>, DenoiseError> {
    let (color, size) = (flat(&layers.color), layers.size);
    filtered(|device| {
        let Some([albedo, normal]) = guides(layers) else {
            return device.color(&color, None, size);
        };
        let albedo = device.albedo(&albedo, size)?;
        let normal = device.normal(&normal, size)?;
        device.color(&color, Some([&albedo, &normal]), size)
    })
}

/// Denoises the picture of `layers` quickly, by the small network and with unfiltered guides.
pub(super) fn denoise_fast(layers: &Layers) -> Result<Vec<Vec3>, DenoiseError> {
    let guides = guides(layers);
    let guides = guides
        .as_ref()
        .map(|[albedo, normal]| [albedo.as_slice(), normal.as_slice()]);
    filtered(|device| device.color_fast(&flat(&layers.color), guides, layers.size))
}

/// Albedo and normals; `None` if one of them is missing.
fn guides(layers: &Layers) -> Option<[Vec<f32>; 2]> {
    match (&layers.albedo, &layers.normal) {
        (Ok(albedo), Ok(normal)) => Some([flat(albedo), flat(normal)]),
        _ => None,
    }
}

/// Returns the pixels that `filter` computes on a new device.
fn filtered(filter: impl FnOnce(&Device) -> Result<Vec<f32>, Error>) -> Result<Vec<Vec3>, DenoiseError> {
    let device = Device::new(rayon::current_num_threads(), OIDN_MB).map_err(failed)?;
    let denoised = filter(&device).map_err(failed)?;
    Ok(denoised.chunks_exact(3).map(Vec3::from_slice).collect())
}

/// Pixels as a flat list with three numbers per pixel, for the library.
fn flat(values: &[Vec3]) -> Vec<f32> {
    values.iter().flat_map(|v| v.to_array()).collect()
}

fn failed(error: Error) -> DenoiseError {
    DenoiseError::Oidn(error.to_string())
}
