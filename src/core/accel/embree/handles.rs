//! Owned references to Embree's scenes and geometries, and functions that attach meshes and
//! instances to a scene.

use super::device::{Device, EmbreeError};
use crate::geometry::{Mesh, Placement};
use crate::math::Vec3;
use embree4_sys::*;

/// An owned reference to an Embree scene.
#[derive(Debug)]
pub(super) struct SceneHandle(RTCScene);

// SAFETY: after its commit a scene is only read. Embree's documentation of rtcCommitScene and
// rtcIntersect1 says that queries on a committed scene may run in parallel from many threads;
// reference counts are atomic.
unsafe impl Send for SceneHandle {}
// SAFETY: as above.
unsafe impl Sync for SceneHandle {}

impl SceneHandle {
    /// Creates an empty scene. If `is_compact` is true, the hierarchy of the scene takes less
    /// memory.
    pub(super) fn new(device: &Device, is_compact: bool) -> Result<Self, EmbreeError> {
        // SAFETY: the device is live; null is checked below.
        let handle = Self(unsafe { rtcNewScene(device.handle()) });
        device.check("creating a scene")?;
        let flags = if is_compact {
            RTCSceneFlags::RTC_SCENE_FLAG_ROBUST | RTCSceneFlags::RTC_SCENE_FLAG_COMPACT
        } else {
            RTCSceneFlags::RTC_SCENE_FLAG_ROBUST
        };
        // SAFETY: the scene is live, not yet committed, and no other thread has its handle.
        unsafe {
            rtcSetSceneFlags(handle.0, flags);
            rtcSetSceneBuildQuality(handle.0, RTCBuildQuality::RTC_BUILD_QUALITY_HIGH);
        }
        device.check("configuring a scene")?;
        Ok(handle)
    }

    /// Builds the hierarchy over all attached geometries.
    pub(super) fn commit(&self, device: &Device) -> Result<(), EmbreeError> {
        // SAFETY: the scene is live, and no other thread has its handle yet.
        unsafe { rtcCommitScene(self.0) };
        device.check("building the acceleration structure")
    }

    /// Handle for queries, after the scene is committed.
    #[inline(always)]
    pub(super) fn raw(&self) -> RTCScene {
        self.0
    }
}

impl Drop for SceneHandle {
    fn drop(&mut self) {
        // SAFETY: this releases the one reference that rtcNewScene returned; the handle is not used
        // again.
        unsafe { rtcReleaseScene(self.0) }
    }
}

/// An owned reference to an Embree geometry.
struct GeometryHandle(RTCGeometry);

impl Drop for GeometryHandle {
    fn drop(&mut self) {
        // SAFETY: this releases the one reference that rtcNewGeometry returned. A scene to which
        // the geometry is attached holds another reference.
        unsafe { rtcReleaseGeometry(self.0) }
    }
}

/// Attaches a geometry with the arrays of `mesh` to `scene`.
///
/// # Safety
/// The arrays of `mesh` are neither moved nor changed while `scene` exists, and `id` is free in
/// `scene`.
pub(super) unsafe fn attach_mesh(
    device: &Device,
    scene: &SceneHandle,
    id: u32,
    mesh: &Mesh,
) -> Result<(), EmbreeError> {
    // SAFETY: the device is live; failure is reported through the error that is checked next.
    let geometry = unsafe { rtcNewGeometry(device.handle(), RTCGeometryType::RTC_GEOMETRY_TYPE_TRIANGLE) };
    let geometry = GeometryHandle(geometry);
    device.check("creating a geometry")?;
    let (vertex, index) = (
        RTCBufferType::RTC_BUFFER_TYPE_VERTEX,
        RTCBufferType::RTC_BUFFER_TYPE_INDEX,
    );
    let (float3, uint3) = (RTCFormat::RTC_FORMAT_FLOAT3, RTCFormat::RTC_FORMAT_UINT3);
    // SAFETY: Vec3 begins with three floats and has 16 bytes, [u32; 3] is three integers; the
    // caller guarantees that the arrays are neither moved nor changed.
    unsafe {
        if mesh.deforms() {
            // The number of time steps sets the number of vertex buffer slots, so it must be set
            // first.
            rtcSetGeometryTimeStepCount(geometry.0, 2);
            share_buffer::<Vec3>(device, &geometry, (vertex, 1), float3, &mesh.positions_close)?;
        }
        share_buffer::<Vec3>(device, &geometry, (vertex, 0), float3, &mesh.positions)?;
        share_buffer::<[u32; 3]>(device, &geometry, (index, 0), uint3, &mesh.triangles)?;
    }
    attach(device, scene, id, &geometry)
}

/// Attaches an instance of `prototype`, which must be committed, to `scene`. `id` must be free in
/// `scene`.
pub(super) fn attach_instance(
    device: &Device,
    scene: &SceneHandle,
    id: u32,
    prototype: &SceneHandle,
    placement: &Placement,
) -> Result<(), EmbreeError> {
    // SAFETY: the device is live; failure is reported through the error that is checked next.
    let geometry = unsafe { rtcNewGeometry(device.handle(), RTCGeometryType::RTC_GEOMETRY_TYPE_INSTANCE) };
    let geometry = GeometryHandle(geometry);
    device.check("creating an instance")?;
    let steps = placement.steps();
    // SAFETY: geometry and prototype are live, and of the same device; Embree's
    // rtcSetGeometryInstancedScene keeps a reference to the scene of the prototype. The builder
    // allows no more steps than Embree, so the number of steps fits 32 bits.
    unsafe {
        rtcSetGeometryInstancedScene(geometry.0, prototype.0);
        rtcSetGeometryTimeStepCount(geometry.0, steps.len() as u32);
    }
    for (step, placement) in (0..).zip(steps) {
        let columns = placement.to_cols_array();
        let format = RTCFormat::RTC_FORMAT_FLOAT3X4_COLUMN_MAJOR;
        // SAFETY: the geometry is live and has this step. The pointer is to twelve floats, column
        // by column, as `format` requires; Embree copies them.
        unsafe { rtcSetGeometryTransform(geometry.0, step, format, columns.as_ptr().cast()) };
    }
    device.check("placing an instance")?;
    attach(device, scene, id, &geometry)
}

/// Commits `geometry` and attaches it to `scene`, in which `id` must be free.
fn attach(device: &Device, scene: &SceneHandle, id: u32, geometry: &GeometryHandle) -> Result<(), EmbreeError> {
    // SAFETY: geometry and scene are live, and no other thread has their handles. Embree reports an
    // id that is not free as an error.
    unsafe {
        rtcCommitGeometry(geometry.0);
        rtcAttachGeometryByID(scene.0, geometry.0, id);
    }
    device.check("attaching a geometry")
}

/// Makes `items` a buffer of `geometry` without copying. `kind` and `slot` are the type and the
/// index of the buffer.
///
/// # Safety
/// `T` begins with the fields of `format`, and has 16 bytes if Embree loads it as a vertex. `items`
/// is neither moved nor changed while the geometry is part of a scene.
unsafe fn share_buffer<T>(
    device: &Device,
    geometry: &GeometryHandle,
    (kind, slot): (RTCBufferType, u32),
    format: RTCFormat,
    items: &[T],
) -> Result<(), EmbreeError> {
    // SAFETY: the geometry is live. Embree requires a pointer and a stride that are multiples of 4,
    // items that stay while they are in use, and a last vertex of which 16 bytes can be loaded.
    // Embree only reads the items.
    unsafe {
        rtcSetSharedGeometryBuffer(
            geometry.0,
            kind,
            slot,
            format,
            items.as_ptr().cast(),
            0,
            size_of::<T>(),
            items.len(),
        );
    }
    device.check("sharing a buffer")
}

// Check the sizes that [`attach_mesh`] assumes
const _: () = assert!(size_of::<Vec3>() == 16 && size_of::<[u32; 3]>() == 12);
