//! Plain calls of Embree as in a C program, to measure the overhead of the wrapper.

use super::EmbreeAccel;
use crate::math::Ray;
use embree4_sys::*;
use std::ptr;

/// Embree ray, filled field by field.
fn raw_ray(ray: &Ray) -> RTCRay {
    RTCRay {
        org_x: ray.origin.x,
        org_y: ray.origin.y,
        org_z: ray.origin.z,
        tnear: ray.t_min,
        dir_x: ray.direction.x,
        dir_y: ray.direction.y,
        dir_z: ray.direction.z,
        time: ray.time,
        tfar: ray.t_max,
        mask: u32::MAX,
        id: 0,
        flags: 0,
    }
}

/// Number of `rays` that hit a surface, by a plain loop over `rtcIntersect1`.
pub fn raw_hits(accel: &EmbreeAccel, rays: &[Ray]) -> usize {
    let mut hits = 0;
    for ray in rays {
        // SAFETY: RTCHit is a C structure of numbers, and all zeros is a value of it.
        let mut hit: RTCHit = unsafe { std::mem::zeroed() };
        hit.geomID = RTC_INVALID_GEOMETRY_ID;
        let mut query = RTCRayHit { ray: raw_ray(ray), hit };
        // SAFETY: as in EmbreeAccel::intersect.
        unsafe { rtcIntersect1(accel.handle(), &mut query, ptr::null_mut()) };
        hits += usize::from(query.hit.geomID != RTC_INVALID_GEOMETRY_ID);
    }
    hits
}

/// Number of `rays` that are occluded, by a plain loop over `rtcOccluded1`.
pub fn raw_occlusions(accel: &EmbreeAccel, rays: &[Ray]) -> usize {
    let mut occlusions = 0;
    for ray in rays {
        let mut query = raw_ray(ray);
        // SAFETY: as in EmbreeAccel::occluded.
        unsafe { rtcOccluded1(accel.handle(), &mut query, ptr::null_mut()) };
        occlusions += usize::from(query.tfar == f32::NEG_INFINITY);
    }
    occlusions
}
