//! Conversion of rays to Embree's format.

use crate::math::{Ray, Vec4};
use embree4_sys::*;

/// Three 16-byte words that have the layout of an `RTCRay`.
///
/// Embree loads a ray in 16-byte words. If the ray was stored in the same words, the CPU forwards
/// the words from the store buffer. If the ray was stored field by field, each query has to wait
/// until the fields are in the cache.
#[repr(C, align(16))]
struct RayWords {
    origin_tnear: Vec4,
    direction_time: Vec4,
    tfar_mask_id_flags: Vec4,
}

const _: () = assert!(size_of::<RayWords>() == size_of::<RTCRay>());

/// Returns Embree's closed interval for the open interval of `ray`. Both ends are moved inwards to
/// the next float. A surface at the start of the ray, at t = 0, is also excluded.
#[inline(always)]
pub(super) fn interval(ray: &Ray) -> (f32, f32) {
    const ABOVE_ZERO: f32 = f32::from_bits(f32::MIN_POSITIVE.to_bits() - 1);
    // Adding 1 to the bits of a positive float gives the next larger float. Subtracting 1 from the
    // bits of infinity gives the largest float.
    let near = f32::from_bits(ray.t_min.max(ABOVE_ZERO).to_bits() + 1);
    let far = f32::from_bits(ray.t_max.max(f32::MIN_POSITIVE).to_bits() - 1);
    (near, far)
}

/// Returns `ray` in Embree's format. All bits of the mask are set; id and flags are 0.
#[inline(always)]
pub(super) fn to_embree(ray: &Ray) -> RTCRay {
    let (near, far) = interval(ray);
    let words = RayWords {
        origin_tnear: ray.origin.extend(near),
        direction_time: ray.direction.extend(ray.time),
        tfar_mask_id_flags: Vec4::new(far, f32::from_bits(u32::MAX), 0.0, 0.0),
    };
    // SAFETY: both types are twelve 4-byte words in the order that embree4-sys asserts for RTCRay,
    // of the same size and alignment, and every bit pattern is a value of their fields.
    unsafe { std::mem::transmute::<RayWords, RTCRay>(words) }
}
