//! Embree devices and their errors.

use embree4_sys::*;
use std::ffi::{CString, c_void};
use std::ptr;
use std::sync::atomic::{AtomicI64, Ordering};
use thiserror::Error;

/// Error of Embree.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
pub enum EmbreeError {
    /// A call reported an error.
    #[error("Embree: {doing}: {reason}")]
    Call {
        /// Operation that failed.
        doing: &'static str,
        /// Embree's error code in words.
        reason: &'static str,
    },
    /// The loaded library does not match the headers of this build.
    #[error(
        "Embree {found} was loaded, but this program was built for {required} or a later {}.x\n  \
         help: install that version, or build this program with the installed version",
        RTC_VERSION_MAJOR
    )]
    Version {
        /// Version of the library.
        found: String,
        /// Version of the headers.
        required: String,
    },
    /// The build options of the loaded library differ from the options in its headers.
    #[error(
        "Embree {version} {problem}\n  help: install an Embree with {RTC_MAX_INSTANCE_LEVEL_COUNT} level of instances and without backface culling, or \
         build this program with the headers of the installed Embree"
    )]
    Misfit {
        /// Version of the library.
        version: String,
        /// Difference between library and headers.
        problem: &'static str,
    },
}

/// An Embree device with its threads. A counter has the memory of all scenes of the device in
/// bytes.
#[derive(Debug)]
pub struct Device {
    handle: RTCDevice,
    /// Allocated bytes. Boxed, because Embree stores the address.
    bytes: Box<AtomicI64>,
}

// SAFETY: handles may be used from any thread. Embree's API reference ("Embree API") says that the
// API is thread-safe for distinct objects. Reference counts are atomic, and each thread has its own
// error state of a device.
unsafe impl Send for Device {}
// SAFETY: as above; `&Device` serves queries of properties and errors, and makes scenes and
// geometries, which may run concurrently. The monitor of memory is set before the device is shared.
unsafe impl Sync for Device {}

impl Device {
    /// Instruction sets that a device can be configured for.
    pub const ISAS: [&str; 3] = ["sse2", "avx2", "avx512"];

    /// Creates a device with Embree's configuration string `config`. Checks the version of the
    /// library against the headers, but does not run the tests of `probe`.
    pub(super) fn configured(config: &str) -> Result<Self, EmbreeError> {
        let config = CString::new(config).unwrap_or_default();
        // SAFETY: rtcNewDevice reads the zero-terminated configuration during the call only, and
        // returns null on failure.
        let handle = unsafe { rtcNewDevice(config.as_ptr()) };
        if handle.is_null() {
            // SAFETY: a null device is allowed here. The call then returns the error of this
            // thread's failed rtcNewDevice.
            let code = unsafe { rtcGetDeviceError(ptr::null_mut()) };
            return Err(EmbreeError::Call {
                doing: "creating a device",
                reason: reason(code),
            });
        }
        let device = Self {
            handle,
            bytes: Box::new(AtomicI64::new(0)),
        };
        device.check_version()?;
        Ok(device)
    }

    /// Starts counting the memory of this device's scenes.
    pub(super) fn watch_memory(&self) -> Result<(), EmbreeError> {
        let user = ptr::from_ref::<AtomicI64>(&self.bytes).cast_mut().cast::<c_void>();
        // SAFETY: the handle is a live device. `user` stays valid until Drop has unregistered the
        // callback, because the box lives as long as the device does.
        unsafe { rtcSetDeviceMemoryMonitorFunction(self.handle, Some(count_bytes), user) };
        self.check("watching memory")
    }

    /// Returns an error unless the library has the major version of the headers and is at least as
    /// new. Structures and constants are then identical.
    fn check_version(&self) -> Result<(), EmbreeError> {
        let found = self.property(RTCDeviceProperty::RTC_DEVICE_PROPERTY_VERSION) as u32;
        let major = self.property(RTCDeviceProperty::RTC_DEVICE_PROPERTY_VERSION_MAJOR) as u32;
        if major == RTC_VERSION_MAJOR && found >= RTC_VERSION {
            return Ok(());
        }
        Err(EmbreeError::Version {
            found: self.version(),
            required: format!("{RTC_VERSION_MAJOR}.{RTC_VERSION_MINOR}.{RTC_VERSION_PATCH}"),
        })
    }

    pub(super) fn property(&self, property: RTCDeviceProperty) -> isize {
        // SAFETY: the handle is a live device; for a property that this library does not support,
        // the call sets an error and returns 0.
        unsafe { rtcGetDeviceProperty(self.handle, property) }
    }

    /// Version of the loaded library.
    pub fn version(&self) -> String {
        let [major, minor, patch] = [
            RTCDeviceProperty::RTC_DEVICE_PROPERTY_VERSION_MAJOR,
            RTCDeviceProperty::RTC_DEVICE_PROPERTY_VERSION_MINOR,
            RTCDeviceProperty::RTC_DEVICE_PROPERTY_VERSION_PATCH,
        ]
        .map(|p| self.property(p));
        format!("{major}.{minor}.{patch}")
    }

    /// Instruction set in use, derived from the widest ray packet that the device supports
    /// natively.
    pub fn isa(&self) -> &'static str {
        if self.property(RTCDeviceProperty::RTC_DEVICE_PROPERTY_NATIVE_RAY16_SUPPORTED) != 0 {
            "avx512"
        } else if self.property(RTCDeviceProperty::RTC_DEVICE_PROPERTY_NATIVE_RAY8_SUPPORTED) != 0 {
            if has_avx2() { "avx2" } else { "avx" }
        } else if self.property(RTCDeviceProperty::RTC_DEVICE_PROPERTY_NATIVE_RAY4_SUPPORTED) != 0 {
            "128-bit"
        } else {
            "scalar"
        }
    }

    /// Bytes used by the scenes of this device.
    pub fn bytes(&self) -> u64 {
        self.bytes.load(Ordering::Relaxed).max(0) as u64
    }

    pub(super) fn handle(&self) -> RTCDevice {
        self.handle
    }

    /// Returns the first error of this thread since the last check, if any. `doing` is the name of
    /// the operation in the error.
    pub(super) fn check(&self, doing: &'static str) -> Result<(), EmbreeError> {
        // SAFETY: the handle is a live device; the call reads and clears the error of this thread.
        let code = unsafe { rtcGetDeviceError(self.handle) };
        if code == RTCError::RTC_ERROR_NONE {
            return Ok(());
        }
        Err(EmbreeError::Call {
            doing,
            reason: reason(code),
        })
    }
}

impl Drop for Device {
    fn drop(&mut self) {
        // SAFETY: the handle is a live device and is not used again. The callback is unregistered
        // first, so that later releases of memory do not access the counter.
        unsafe {
            rtcSetDeviceMemoryMonitorFunction(self.handle, None, ptr::null_mut());
            rtcReleaseDevice(self.handle);
        }
    }
}

/// Embree's memory monitor: counts allocated bytes (`bytes` > 0) and freed bytes (`bytes` < 0).
/// Returns true, which allows the allocation.
///
/// # Safety
/// `user` is the address of an `AtomicI64` that outlives the registration.
unsafe extern "C" fn count_bytes(user: *mut c_void, bytes: isize, _post: bool) -> bool {
    // SAFETY: Device::watch_memory registered the address of its own counter, and Device::drop
    // unregisters it first.
    let counter = unsafe { &*user.cast::<AtomicI64>() };
    counter.fetch_add(bytes as i64, Ordering::Relaxed);
    true
}

#[cfg(target_arch = "x86_64")]
fn has_avx2() -> bool {
    std::arch::is_x86_feature_detected!("avx2")
}

#[cfg(not(target_arch = "x86_64"))]
fn has_avx2() -> bool {
    false
}

fn reason(code: RTCError) -> &'static str {
    match code {
        RTCError::RTC_ERROR_NONE => "no reason given",
        RTCError::RTC_ERROR_INVALID_ARGUMENT => "invalid argument",
        RTCError::RTC_ERROR_INVALID_OPERATION => "invalid operation",
        RTCError::RTC_ERROR_OUT_OF_MEMORY => "out of memory",
        RTCError::RTC_ERROR_UNSUPPORTED_CPU => "this processor lacks what Embree needs (SSE2 at least)",
        RTCError::RTC_ERROR_CANCELLED => "cancelled",
        _ => "unknown error",
    }
}
