//! Calls of Embree through the bindings: the loaded library must match the headers.

#![allow(unsafe_code)] // These tests call a C library. Each call has a SAFETY comment.

use embree4_sys::*;
use std::ptr;

/// An Embree device of one thread.
struct Device(RTCDevice);

impl Device {
    fn new() -> Self {
        // SAFETY: the configuration is a C string, read during the call only. On failure, the
        // function returns null.
        let device = unsafe { rtcNewDevice(c"threads=1".as_ptr()) };
        assert!(!device.is_null(), "no Embree device");
        Device(device)
    }

    fn error(&self) -> RTCError {
        // SAFETY: the device is alive. The call reads and clears this thread's error.
        unsafe { rtcGetDeviceError(self.0) }
    }

    fn property(&self, property: RTCDeviceProperty) -> isize {
        // SAFETY: the device is alive. For a property that Embree does not support, the call sets
        // an error.
        unsafe { rtcGetDeviceProperty(self.0, property) }
    }
}

impl Drop for Device {
    fn drop(&mut self) {
        // SAFETY: this releases the one reference that rtcNewDevice returned; `self` is not used
        // afterwards.
        unsafe { rtcReleaseDevice(self.0) }
    }
}

/// A committed scene: the triangle (0,0,0), (1,0,0), (0,1,0).
struct Scene(RTCScene);

impl Scene {
    fn one_triangle(device: &Device) -> Self {
        // SAFETY: the device is alive; handles are checked for null before use. Embree allocates
        // the buffers, aligned and padded; they are written in their format, within the requested
        // size, and before the commit. The scene holds its own reference to the geometry, so the
        // first reference is released.
        unsafe {
            let geometry = rtcNewGeometry(device.0, RTCGeometryType::RTC_GEOMETRY_TYPE_TRIANGLE);
            assert!(!geometry.is_null());

            let (vertex, float3) = (RTCBufferType::RTC_BUFFER_TYPE_VERTEX, RTCFormat::RTC_FORMAT_FLOAT3);
            let vertices = rtcSetNewGeometryBuffer(geometry, vertex, 0, float3, size_of::<[f32; 3]>(), 3);
            assert!(!vertices.is_null());
            vertices
                .cast::<[[f32; 3]; 3]>()
                .write([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]);

            let (index, uint3) = (RTCBufferType::RTC_BUFFER_TYPE_INDEX, RTCFormat::RTC_FORMAT_UINT3);
            let indices = rtcSetNewGeometryBuffer(geometry, index, 0, uint3, size_of::<[u32; 3]>(), 1);
            assert!(!indices.is_null());
            indices.cast::<[u32; 3]>().write([0, 1, 2]);

            rtcCommitGeometry(geometry);

            let scene = rtcNewScene(device.0);
            assert!(!scene.is_null());
            // Any id except 0, so that a hit that was not written cannot pass the test.
            rtcAttachGeometryByID(scene, geometry, GEOMETRY);
            rtcReleaseGeometry(geometry);
            rtcCommitScene(scene);
            assert_eq!(device.error(), RTCError::RTC_ERROR_NONE);
            Scene(scene)
        }
    }

    fn intersect(&self, query: &mut GuardedQuery<RTCRayHit>) {
        // SAFETY: the scene is committed; ray and hit may be read and written, and are aligned to
        // 16 bytes; null arguments stand for the defaults.
        unsafe { rtcIntersect1(self.0, &mut query.value, ptr::null_mut()) }
    }

    fn occluded(&self, query: &mut GuardedQuery<RTCRay>) {
        // SAFETY: as for `intersect`, with a ray alone.
        unsafe { rtcOccluded1(self.0, &mut query.value, ptr::null_mut()) }
    }
}

impl Drop for Scene {
    fn drop(&mut self) {
        // SAFETY: this releases the one reference that rtcNewScene returned; `self` is not used
        // afterwards.
        unsafe { rtcReleaseScene(self.0) }
    }
}

const GEOMETRY: u32 = 7;

/// A value between guard bytes: a library with a larger structure would overwrite them.
#[repr(C, align(16))]
struct GuardedQuery<T> {
    before: [u8; 64],
    value: T,
    after: [u8; 64],
}

const CANARY: [u8; 64] = [0xA5; 64];

impl<T> GuardedQuery<T> {
    // There must be no padding between the guards and the value, because padding would hide a short
    // overrun.
    const TIGHT: () = assert!(size_of::<Self>() == size_of::<T>() + 128);

    fn new(value: T) -> Self {
        let () = Self::TIGHT;
        GuardedQuery {
            before: CANARY,
            value,
            after: CANARY,
        }
    }

    fn assert_intact(&self) {
        assert_eq!(self.before, CANARY, "Embree wrote before the structure");
        assert_eq!(
            self.after, CANARY,
            "Embree wrote past the structure: these are not the headers of this library"
        );
    }
}

/// A ray in direction −z from a height of 2.
fn downwards(x: f32, y: f32) -> RTCRay {
    RTCRay {
        org_x: x,
        org_y: y,
        org_z: 2.0,
        tnear: 0.0,
        dir_x: 0.0,
        dir_y: 0.0,
        dir_z: -1.0,
        time: 0.0,
        tfar: f32::INFINITY,
        mask: u32::MAX,
        id: 0,
        flags: 0,
    }
}

/// Query for the closest hit: no hit yet, and the other fields hold values that no hit has.
fn closest(ray: RTCRay) -> RTCRayHit {
    // SAFETY: RTCHit is made of floats and integers, for which all bytes are valid.
    let stale: RTCHit = unsafe { std::mem::transmute([0x77_u8; size_of::<RTCHit>()]) };
    RTCRayHit {
        ray,
        hit: RTCHit {
            geomID: RTC_INVALID_GEOMETRY_ID,
            ..stale
        },
    }
}

#[test]
fn a_hit_is_read_back_and_stays_within_its_structure() {
    let device = Device::new();
    let scene = Scene::one_triangle(&device);

    let mut query = GuardedQuery::new(closest(downwards(0.25, 0.5)));
    scene.intersect(&mut query);
    query.assert_intact();

    let RTCRayHit { ray, hit } = query.value;
    assert!((ray.tfar - 2.0).abs() < 1e-6, "t = {}", ray.tfar);
    assert!(
        (hit.u - 0.25).abs() < 1e-6 && (hit.v - 0.5).abs() < 1e-6,
        "u, v = {}, {}",
        hit.u,
        hit.v
    );
    assert_eq!([hit.Ng_x, hit.Ng_y, hit.Ng_z], [0.0, 0.0, 1.0]);
    assert_eq!((hit.geomID, hit.primID), (GEOMETRY, 0));
    // The scene has no instance, so the instance id is invalid. This also checks the value of the
    // constant in the bindings against the library.
    assert!(
        hit.instID.iter().all(|&id| id == RTC_INVALID_GEOMETRY_ID),
        "instID = {:?}",
        hit.instID
    );
}

#[test]
fn a_miss_leaves_the_query_as_it_was() {
    let device = Device::new();
    let scene = Scene::one_triangle(&device);

    let mut query = GuardedQuery::new(closest(downwards(0.75, 0.75)));
    scene.intersect(&mut query);
    query.assert_intact();

    assert_eq!(query.value.ray.tfar, f32::INFINITY);
    assert_eq!(query.value.hit.geomID, RTC_INVALID_GEOMETRY_ID);
}

#[test]
fn occlusion_is_told_by_tfar_alone() {
    let device = Device::new();
    let scene = Scene::one_triangle(&device);

    for (x, y, tfar) in [(0.25, 0.5, f32::NEG_INFINITY), (0.75, 0.75, f32::INFINITY)] {
        let mut query = GuardedQuery::new(downwards(x, y));
        scene.occluded(&mut query);
        query.assert_intact();
        assert_eq!(query.value.tfar, tfar);
    }
}

#[test]
fn the_library_is_not_older_than_its_headers() {
    let device = Device::new();
    let major = device.property(RTCDeviceProperty::RTC_DEVICE_PROPERTY_VERSION_MAJOR);
    let version = device.property(RTCDeviceProperty::RTC_DEVICE_PROPERTY_VERSION);
    assert_eq!(major, RTC_VERSION_MAJOR as isize);
    assert!(
        version >= RTC_VERSION as isize,
        "library {version}, headers {RTC_VERSION}"
    );
}

#[test]
fn a_bad_call_leaves_an_error_that_is_read_once() {
    let device = Device::new();
    assert_eq!(device.error(), RTCError::RTC_ERROR_NONE);

    // SAFETY: the device is alive. For a type that Embree does not support, the call sets an error.
    let geometry = unsafe { rtcNewGeometry(device.0, RTCGeometryType(12345)) };
    assert!(geometry.is_null());
    // The error code differs between versions.
    assert_ne!(device.error(), RTCError::RTC_ERROR_NONE);
    assert_eq!(device.error(), RTCError::RTC_ERROR_NONE);
}

#[test]
fn flags_combine() {
    let device = Device::new();
    let scene = Scene::one_triangle(&device);
    let flags = RTCSceneFlags::RTC_SCENE_FLAG_ROBUST | RTCSceneFlags::RTC_SCENE_FLAG_COMPACT;

    // SAFETY: the scene is alive, and no other thread has its handle.
    let read_back = unsafe {
        rtcSetSceneFlags(scene.0, flags);
        rtcGetSceneFlags(scene.0)
    };
    assert_eq!(read_back, flags);
}
