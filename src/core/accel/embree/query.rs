//! Implementation of [`Accel`] by Embree: queries for single rays, and for packets.

use super::EmbreeAccel;
use super::packet;
use super::ray::to_embree;
use crate::accel::{Accel, BackendInfo, Dispatch};
use crate::geometry::{Hit, PrimId};
use crate::math::Ray;
use embree4_sys::*;
use std::ptr;

impl Dispatch for EmbreeAccel<'_> {
    const IS_DYNAMIC: bool = false;
}

impl Accel for EmbreeAccel<'_> {
    #[inline(always)]
    fn intersect(&self, ray: &Ray) -> Option<Hit> {
        // SAFETY: RTCHit is a C structure of numbers, and all zeros is a value of it. Zeroing
        // covers fields that only some builds of Embree have.
        let mut hit: RTCHit = unsafe { std::mem::zeroed() };
        hit.geomID = RTC_INVALID_GEOMETRY_ID;
        let mut query = RTCRayHit {
            ray: to_embree(ray),
            hit,
        };
        // SAFETY: the scene is live and committed. `query` has the layout of the headers, is
        // aligned to 16 bytes by its type, and belongs to this thread. Null arguments mean the
        // defaults.
        unsafe { rtcIntersect1(self.handle(), &mut query, ptr::null_mut()) };
        if query.hit.geomID == RTC_INVALID_GEOMETRY_ID {
            return None;
        }
        let (geom, inst) = self.ids(query.hit.geomID, query.hit.instID[0]);
        let hit = Hit {
            t: query.ray.tfar,
            b1: query.hit.u,
            b2: query.hit.v,
            prim: PrimId(query.hit.primID),
            geom,
            inst,
        };
        let [b1, b2] = self.barycentrics(ray, &hit);
        Some(Hit { b1, b2, ..hit })
    }

    fn intersect_coherent(&self, rays: &[Ray], hits: &mut [Option<Hit>]) {
        packet::intersect_coherent(self, rays, hits);
    }

    fn occluded_coherent(&self, rays: &[Ray], occluded: &mut [bool]) {
        packet::occluded_coherent(self, rays, occluded);
    }

    #[inline(always)]
    fn occluded(&self, ray: &Ray) -> bool {
        let mut query = to_embree(ray);
        // SAFETY: as for rtcIntersect1, with an RTCRay.
        unsafe { rtcOccluded1(self.handle(), &mut query, ptr::null_mut()) };
        // Embree sets tfar to minus infinity for occluded rays.
        query.tfar == f32::NEG_INFINITY
    }

    fn info(&self) -> BackendInfo {
        BackendInfo {
            name: super::NAME,
            version: self.device().version(),
            isa: self.device().isa(),
        }
    }

    fn bytes(&self) -> u64 {
        self.device().bytes()
    }
}
