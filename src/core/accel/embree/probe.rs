//! Construction of Embree devices, with a test that the loaded library matches the headers.
//!
//! The version number does not show how the library was built. The number of instance levels sets
//! the size of a hit, and backface culling removes hits. To detect both, three rays are traced to a
//! triangle and to an instance of the triangle. Guard words after the hit in memory show whether
//! the library writes beyond the hit. A library that does not match its headers is rejected.

use super::device::{Device, EmbreeError};
use super::handles::{SceneHandle, attach_instance, attach_mesh};
use crate::geometry::{Mesh, Placement};
use crate::math::{Affine3A, Vec3};
use embree4_sys::*;
use std::ptr;

/// Guard words, which a matching library does not change.
const GUARD: [u32; 64] = [0xA5A5_A5A5; 64];

/// A query, followed by guard words, which a library with longer hits overwrites.
#[repr(C, align(16))]
struct GuardedQuery {
    query: RTCRayHit,
    guard: [u32; 64],
}

/// A test ray. It starts 2 units above or below the point (`x`, 0.5, 0) of a triangle.
struct Trial {
    x: f32,
    is_behind: bool,
    /// Expected id of the instance.
    inst: u32,
}

/// Test rays. Two hit the triangle (0,0,0), (1,0,0), (0,1,0) from both sides. The third hits an
/// instance of the triangle, moved by 4 along x.
const TRIALS: [Trial; 3] = [
    Trial {
        x: 0.25,
        is_behind: false,
        inst: RTC_INVALID_GEOMETRY_ID,
    },
    Trial {
        x: 0.25,
        is_behind: true,
        inst: RTC_INVALID_GEOMETRY_ID,
    },
    Trial {
        x: 4.25,
        is_behind: true,
        inst: INSTANCE,
    },
];

/// Id of the instance that is the copy of the triangle.
const INSTANCE: u32 = 1;

impl Device {
    /// Creates a device that builds with `threads` threads and uses the widest instructions of the
    /// processor.
    pub fn new(threads: usize) -> Result<Self, EmbreeError> {
        Self::tried(&format!("threads={threads}"))
    }

    /// Creates a device with `threads` threads and the instruction set `isa`, one of
    /// [`Device::ISAS`]. Returns an error if the processor or the library does not support the
    /// instruction set.
    pub fn with_isa(threads: usize, isa: &str) -> Result<Self, EmbreeError> {
        Self::tried(&format!("threads={threads},isa={isa}"))
    }

    fn tried(config: &str) -> Result<Self, EmbreeError> {
        let device = Self::configured(config)?;
        check(&device)?;
        device.watch_memory()?;
        Ok(device)
    }
}

/// Traces the test rays on `device`, which takes some microseconds. Returns an error if the library
/// does not match its headers.
fn check(device: &Device) -> Result<(), EmbreeError> {
    let misfit = |problem| EmbreeError::Misfit {
        version: device.version(),
        problem,
    };
    if device.property(RTCDeviceProperty::RTC_DEVICE_PROPERTY_TRIANGLE_GEOMETRY_SUPPORTED) == 0 {
        return Err(misfit("was built without triangles"));
    }
    if device.property(RTCDeviceProperty::RTC_DEVICE_PROPERTY_BACKFACE_CULLING_ENABLED) != 0 {
        return Err(misfit(CULLS));
    }
    let mesh = Mesh {
        positions: vec![Vec3::ZERO, Vec3::X, Vec3::Y],
        triangles: vec![[0, 1, 2]],
        ..Mesh::default()
    };
    let [prototype, scene] = [SceneHandle::new(device, false)?, SceneHandle::new(device, false)?];
    for scene in [&prototype, &scene] {
        // SAFETY: the mesh is not changed until the end of this function, and both scenes are
        // dropped before the mesh.
        unsafe { attach_mesh(device, scene, 0, &mesh)? };
    }
    prototype.commit(device)?;
    let aside = Placement::Still(Affine3A::from_translation((4.0 * Vec3::X).into()));
    attach_instance(device, &scene, INSTANCE, &prototype, &aside)?;
    scene.commit(device)?;
    for trial in &TRIALS {
        let mut answer = GuardedQuery {
            query: trial.query(),
            guard: GUARD,
        };
        // SAFETY: the scene is live and committed. The query has the layout and alignment of the
        // headers, and null arguments mean the defaults. If the layout of the loaded library is
        // longer, the library writes into the guard, which is part of the same object.
        unsafe { rtcIntersect1(scene.raw(), &mut answer.query, ptr::null_mut()) };
        trial.judge(&answer).map_err(misfit)?;
    }
    Ok(())
}

const CULLS: &str = "does not hit triangles from behind: it was built with backface culling";
const OVERRUNS: &str = "writes past the end of a hit: its instance levels differ from those in its headers";
const ERRS: &str = "gives a wrong hit: its build differs from its headers";

impl Trial {
    fn query(&self) -> RTCRayHit {
        let side = if self.is_behind { -1.0 } else { 1.0 };
        // SAFETY: RTCRayHit is a C structure of numbers, and all zeros is a value of it.
        let mut query: RTCRayHit = unsafe { std::mem::zeroed() };
        (query.ray.org_x, query.ray.org_y, query.ray.org_z) = (self.x, 0.5, 2.0 * side);
        query.ray.dir_z = -side;
        query.ray.tfar = f32::INFINITY;
        query.ray.mask = u32::MAX;
        // Set ids that differ from the ids of the expected hits
        query.hit.geomID = RTC_INVALID_GEOMETRY_ID;
        query.hit.primID = 7;
        query.hit.instID.fill(7);
        query
    }

    /// Returns an error if `answer` shows that the library does not match its headers.
    fn judge(&self, answer: &GuardedQuery) -> Result<(), &'static str> {
        let RTCRayHit { ray, hit } = &answer.query;
        let near = |a: f32, b: f32| (a - b).abs() < 1e-5;
        if answer.guard != GUARD {
            return Err(OVERRUNS);
        }
        if hit.geomID == RTC_INVALID_GEOMETRY_ID && self.is_behind {
            return Err(CULLS);
        }
        let is_there = near(ray.tfar, 2.0) && near(hit.u, 0.25) && near(hit.v, 0.5);
        let is_named = (hit.geomID, hit.primID, hit.instID[0]) == (0, 0, self.inst);
        if is_there && is_named { Ok(()) } else { Err(ERRS) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Answer of a correct library.
    fn right(trial: &Trial) -> GuardedQuery {
        let mut query = trial.query();
        query.ray.tfar = 2.0;
        (query.hit.u, query.hit.v) = (0.25, 0.5);
        (query.hit.geomID, query.hit.primID) = (0, 0);
        query.hit.instID[0] = trial.inst;
        GuardedQuery { query, guard: GUARD }
    }

    fn judged(trial: &Trial, change: impl Fn(&mut GuardedQuery)) -> Result<(), &'static str> {
        let mut answer = right(trial);
        change(&mut answer);
        trial.judge(&answer)
    }

    #[test]
    fn library_with_other_build_options_is_rejected() {
        let [front, behind, copy] = &TRIALS;
        for trial in &TRIALS {
            assert_eq!(judged(trial, |_| ()), Ok(()));
            assert_eq!(judged(trial, |a| a.guard[0] = RTC_INVALID_GEOMETRY_ID), Err(OVERRUNS));
            assert_eq!(judged(trial, |a| a.guard[63] = 0), Err(OVERRUNS));
            assert_eq!(judged(trial, |a| a.query.ray.tfar = 1.9), Err(ERRS));
            assert_eq!(judged(trial, |a| a.query.hit.v = 0.25), Err(ERRS));
            assert_eq!(judged(trial, |a| a.query.hit.primID = 7), Err(ERRS));
            assert_eq!(judged(trial, |a| a.query.hit.instID[0] = 7), Err(ERRS));
        }
        let nothing = |a: &mut GuardedQuery| a.query.hit.geomID = RTC_INVALID_GEOMETRY_ID;
        assert_eq!(judged(front, nothing), Err(ERRS));
        assert_eq!(judged(behind, nothing), Err(CULLS));
        assert_eq!(judged(copy, nothing), Err(CULLS));
        let error = EmbreeError::Misfit {
            version: "4.3.3".into(),
            problem: OVERRUNS,
        };
        assert!(error.to_string().contains("\n  help: "), "{error}");
    }

    #[test]
    fn this_library_passes() {
        assert!(Device::new(1).is_ok());
    }
}
