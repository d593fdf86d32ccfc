//! Open Image Denoise 2. Albedo and normals are filtered first, each by itself, and then the image
//! by those (`cleanAux`). For first looks the library's fast quality filters the image alone, by
//! albedo and normals as they are: a fifth of the time, and more noise.
//!
//! The oidn crate (2.5.1) has no filter without a colour image, spells the parameter `clean_aux`, which the library ignores, and takes no number of
//! threads. `sys/oidn` therefore makes these calls by the crate's raw bindings. docs/denoise.md has what the filter gains.

use super::layers::Layers;
use super::{DenoiseError, OIDN_MB};
use crate::math::Vec3;
use embrasure_oidn::{Device, Error};

/// `name` with the version of the library that is loaded.
pub(super) fn version(name: &str) -> Result<String, DenoiseError> {
    Ok(format!("{name} {}", Device::new(1, OIDN_MB).map_err(failed)?.version()))
}

/// The picture of `layers` without its noise: the guides albedo and normal first, each separately, then
/// the picture by guides without noise. Without guides the picture is filtered alone.
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

/// The picture of `layers` with little noise, by the small network and by guides as they are.
pub(super) fn denoise_fast(layers: &Layers) -> Result<Vec<Vec3>, DenoiseError> {
    let guides = guides(layers);
    let guides = guides
        .as_ref()
        .map(|[albedo, normal]| [albedo.as_slice(), normal.as_slice()]);
    filtered(|device| device.color_fast(&flat(&layers.color), guides, layers.size))
}

/// Albedo and normals, unless one of them is missing.
fn guides(layers: &Layers) -> Option<[Vec<f32>; 2]> {
    match (&layers.albedo, &layers.normal) {
        (Ok(albedo), Ok(normal)) => Some([flat(albedo), flat(normal)]),
        _ => None,
    }
}

/// The pixels that `filter` makes with a device.
fn filtered(filter: impl FnOnce(&Device) -> Result<Vec<f32>, Error>) -> Result<Vec<Vec3>, DenoiseError> {
    let device = Device::new(rayon::current_num_threads(), OIDN_MB).map_err(failed)?;
    let denoised = filter(&device).map_err(failed)?;
    Ok(denoised.chunks_exact(3).map(Vec3::from_slice).collect())
}

/// Three numbers a pixel, as the library takes them.
fn flat(values: &[Vec3]) -> Vec<f32> {
    values.iter().flat_map(|v| v.to_array()).collect()
}

fn failed(error: Error) -> DenoiseError {
    DenoiseError::Oidn(error.to_string())
}
