//! Open Image Denoise 2. Albedo and normals are filtered first, each by itself, and then the image by those (`cleanAux`).
//!
//! The oidn crate (2.5.1) has no filter without a colour image, spells the parameter `clean_aux`, which the library ignores, and takes no number of
//! threads. `sys/oidn` therefore makes these calls by the crate's raw bindings. docs/denoise.md has what the filter gains.

use super::layers::Layers;
use super::{DenoiseError, OIDN_MB};
use crate::math::Vec3;
use embrasure_oidn::{Device, Error};

/// Name and version of the library that is loaded.
pub(super) fn version() -> Result<String, DenoiseError> {
    Ok(format!("oidn {}", Device::new(1, OIDN_MB).map_err(failed)?.version()))
}

/// The picture of `layers` without its noise: the guides albedo and normal first, each separately, then
/// the picture by guides without noise. Without guides the picture is filtered alone.
pub(super) fn denoise(layers: &Layers) -> Result<Vec<Vec3>, DenoiseError> {
    let (color, size) = (&layers.color, layers.size);
    let guides = match (&layers.albedo, &layers.normal) {
        (Ok(albedo), Ok(normal)) => Some([albedo, normal]),
        _ => None,
    };
    let run = || {
        let device = Device::new(rayon::current_num_threads(), OIDN_MB)?;
        let Some([albedo, normal]) = guides else {
            return device.color(&flat(color), None, size);
        };
        let albedo = device.albedo(&flat(albedo), size)?;
        let normal = device.normal(&flat(normal), size)?;
        device.color(&flat(color), Some([&albedo, &normal]), size)
    };
    let denoised: Vec<f32> = run().map_err(failed)?;
    Ok(denoised.chunks_exact(3).map(Vec3::from_slice).collect())
}

/// Three numbers a pixel, as the library takes them.
fn flat(values: &[Vec3]) -> Vec<f32> {
    values.iter().flat_map(|v| v.to_array()).collect()
}

fn failed(error: Error) -> DenoiseError {
    DenoiseError::Oidn(error.to_string())
}
