//! Packets of up to sixteen rays in one Embree call. Camera rays and shadow rays towards one point
//! are traced in packets. Other rays are incoherent, and packets are not faster for them.

use super::EmbreeAccel;
use super::ray::interval;
use crate::geometry::{Hit, PrimId};
use crate::math::Ray;
use embree4_sys::*;
use std::ptr;

/// Maximum number of rays in a packet.
const WIDTH: usize = 16;
/// Minimum number of rays in a packet. Fewer rays are traced separately, which is faster.
const FEWEST: usize = 4;

/// Closest hits of `rays`, in packets of up to sixteen.
pub(super) fn intersect_coherent(accel: &EmbreeAccel, rays: &[Ray], hits: &mut [Option<Hit>]) {
    for (rays, hits) in rays.chunks(WIDTH).zip(hits.chunks_mut(WIDTH)) {
        if rays.len() >= FEWEST {
            intersect_packet(accel, rays, hits);
        } else {
            for (ray, hit) in rays.iter().zip(hits) {
                *hit = crate::accel::Accel::intersect(accel, ray);
            }
        }
    }
}

/// Occlusion of `rays`, in packets of up to sixteen.
pub(super) fn occluded_coherent(accel: &EmbreeAccel, rays: &[Ray], occluded: &mut [bool]) {
    for (rays, occluded) in rays.chunks(WIDTH).zip(occluded.chunks_mut(WIDTH)) {
        if rays.len() >= FEWEST {
            occluded_packet(accel, rays, occluded);
        } else {
            for (ray, occluded) in rays.iter().zip(occluded) {
                *occluded = crate::accel::Accel::occluded(accel, ray);
            }
        }
    }
}

/// Closest hits of at most sixteen rays, in one call.
fn intersect_packet(accel: &EmbreeAccel, rays: &[Ray], hits: &mut [Option<Hit>]) {
    // SAFETY: RTCRayHit16 is a C structure of numbers, and all zeros is a value of it. Zeroing
    // covers fields that only some builds of Embree have.
    let mut query: RTCRayHit16 = unsafe { std::mem::zeroed() };
    query.hit.geomID = [RTC_INVALID_GEOMETRY_ID; WIDTH];
    let valid = fill(&mut query.ray, rays);
    let mut arguments = RTCIntersectArguments {
        flags: RTCRayQueryFlags::RTC_RAY_QUERY_FLAG_COHERENT,
        feature_mask: RTCFeatureFlags::RTC_FEATURE_FLAG_ALL,
        context: ptr::null_mut(),
        filter: None,
        intersect: None,
    };
    // SAFETY: the scene is live and committed. `valid` holds sixteen integers aligned to 64 bytes,
    // as Embree requires. `query` has the layout and alignment of the headers, and belongs to this
    // thread. The arguments have the values that Embree's rtcInitIntersectArguments sets, with
    // another ray flag, and are only read.
    unsafe { rtcIntersect16(valid.0.as_ptr(), accel.handle(), &mut query, &mut arguments) };
    for (lane, (ray, hit)) in rays.iter().zip(hits).enumerate().take(WIDTH) {
        *hit = (query.hit.geomID[lane] != RTC_INVALID_GEOMETRY_ID).then(|| {
            let (geom, inst) = accel.ids(query.hit.geomID[lane], query.hit.instID[0][lane]);
            let hit = Hit {
                t: query.ray.tfar[lane],
                b1: query.hit.u[lane],
                b2: query.hit.v[lane],
                prim: PrimId(query.hit.primID[lane]),
                geom,
                inst,
            };
            let [b1, b2] = accel.barycentrics(ray, &hit);
            Hit { b1, b2, ..hit }
        });
    }
}

/// Occlusion of at most sixteen rays, in one call.
fn occluded_packet(accel: &EmbreeAccel, rays: &[Ray], occluded: &mut [bool]) {
    // SAFETY: RTCRay16 is a C structure of numbers, and all zeros is a value of it.
    let mut query: RTCRay16 = unsafe { std::mem::zeroed() };
    let valid = fill(&mut query, rays);
    let mut arguments = RTCOccludedArguments {
        flags: RTCRayQueryFlags::RTC_RAY_QUERY_FLAG_COHERENT,
        feature_mask: RTCFeatureFlags::RTC_FEATURE_FLAG_ALL,
        context: ptr::null_mut(),
        filter: None,
        occluded: None,
    };
    // SAFETY: as for rtcIntersect16, with an RTCRay16 and the values that rtcInitOccludedArguments
    // sets.
    unsafe { rtcOccluded16(valid.0.as_ptr(), accel.handle(), &mut query, &mut arguments) };
    for (lane, occluded) in occluded.iter_mut().enumerate().take(WIDTH) {
        // Embree sets tfar to minus infinity for occluded rays.
        *occluded = query.tfar[lane] == f32::NEG_INFINITY;
    }
}

/// Fills `packet` with `rays`, at most sixteen, and sets all bits of their masks. Ids and flags are
/// not set. Returns the validity of the lanes.
#[inline(always)]
fn fill(packet: &mut RTCRay16, rays: &[Ray]) -> Lanes {
    // Embree ignores lanes with validity 0.
    let mut valid = Lanes([0; WIDTH]);
    for (lane, ray) in rays.iter().enumerate().take(WIDTH) {
        valid.0[lane] = -1;
        let ([ox, oy, oz], [dx, dy, dz]) = (ray.origin.to_array(), ray.direction.to_array());
        (packet.org_x[lane], packet.org_y[lane], packet.org_z[lane]) = (ox, oy, oz);
        (packet.dir_x[lane], packet.dir_y[lane], packet.dir_z[lane]) = (dx, dy, dz);
        (packet.tnear[lane], packet.tfar[lane]) = interval(ray);
        packet.time[lane] = ray.time;
        packet.mask[lane] = u32::MAX;
    }
    valid
}

/// Validity of the lanes of a packet: −1 if valid, else 0.
#[repr(C, align(64))]
struct Lanes([i32; WIDTH]);
