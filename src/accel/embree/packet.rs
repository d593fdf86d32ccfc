use super::EmbreeAccel;
use crate::geometry::{GeomId, Hit, InstanceId, PrimId};
use crate::math::Ray;
use embree4_sys::*;
use std::ptr;

/// Rays that are traced together.
const WIDTH: usize = 16;
/// Fewer are faster one by one.
const FEWEST: usize = 4;

/// The closest hits of `rays`, sixteen at a time where there are as many.
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

/// Traces up to sixteen rays by one call.
fn intersect_packet(accel: &EmbreeAccel, rays: &[Ray], hits: &mut [Option<Hit>]) {
    // SAFETY: RTCRayHit16 is a C structure of numbers, and all zeros is a value of it.
    let mut packet: RTCRayHit16 = unsafe { std::mem::zeroed() };
    // Lanes whose validity is 0 are left alone.
    let mut valid = Lanes([0; WIDTH]);
    for (lane, ray) in rays.iter().enumerate().take(WIDTH) {
        valid.0[lane] = -1;
        let (to, [ox, oy, oz], [dx, dy, dz]) = (&mut packet.ray, ray.origin.to_array(), ray.direction.to_array());
        (to.org_x[lane], to.org_y[lane], to.org_z[lane]) = (ox, oy, oz);
        (to.dir_x[lane], to.dir_y[lane], to.dir_z[lane]) = (dx, dy, dz);
        (to.tnear[lane], to.tfar[lane]) = (super::scene::t_near(ray), ray.t_max);
        to.mask[lane] = u32::MAX;
    }
    packet.hit.geomID = [RTC_INVALID_GEOMETRY_ID; WIDTH];
    let mut arguments = RTCIntersectArguments {
        flags: RTCRayQueryFlags::RTC_RAY_QUERY_FLAG_COHERENT,
        feature_mask: RTCFeatureFlags::RTC_FEATURE_FLAG_ALL,
        context: ptr::null_mut(),
        filter: None,
        intersect: None,
    };
    // SAFETY: the scene is live and committed. `valid` holds sixteen integers aligned to 64 bytes, as Embree asks; `packet` is of
    // the layout and alignment that the headers give, and this thread's own. The arguments are what Embree's
    // rtcInitIntersectArguments sets, with another ray flag, and are only read.
    unsafe { rtcIntersect16(valid.0.as_ptr(), accel.handle(), &mut packet, &mut arguments) };
    for (lane, hit) in hits.iter_mut().enumerate().take(WIDTH) {
        *hit = (packet.hit.geomID[lane] != RTC_INVALID_GEOMETRY_ID).then(|| Hit {
            t: packet.ray.tfar[lane],
            b1: packet.hit.u[lane],
            b2: packet.hit.v[lane],
            prim: PrimId(packet.hit.primID[lane]),
            geom: GeomId(packet.hit.geomID[lane]),
            inst: InstanceId::NONE,
        });
    }
}

/// Which lanes of a packet hold rays.
#[repr(C, align(64))]
struct Lanes([i32; WIDTH]);
