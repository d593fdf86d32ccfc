//! Raw bindings to Intel [Embree 4](https://www.embree.org), generated at build time from the
//! headers of the linked library.
//!
//! The layout of Embree's structures depends on its build options: `RTCRayHit` has 96 bytes with
//! instance arrays and 80 without. Bindings from another machine may have the smaller structure,
//! and Embree would then write past its end. A program should still check, by
//! `RTC_DEVICE_PROPERTY_VERSION`, that the library at run time has the major version
//! `RTC_VERSION_MAJOR` and is not older than `RTC_VERSION`.
//!
//! Names are as in the C header. An enum is a newtype over an integer, because C may return values
//! that the header does not name. The named values are associated constants
//! (`RTCError::RTC_ERROR_NONE`), and flags combine with `|`. The header's inline helpers
//! (`rtcInitIntersectArguments` and similar) are not bound. Null arguments select the defaults.
//!
//! docs.rs has no Embree, so the page there has no bindings. `cargo doc -p embrasure-embree-sys`
//! with an installed Embree documents them.
//!
//! The build searches for Embree in this order: `EMBREE_DIR` (a prefix), `EMBREE_INCLUDE_DIR` with
//! `EMBREE_LIB_DIR`, the workspace's `.deps/embree`, the system's usual prefixes. The build script
//! of a crate that depends on this crate can read these variables:
//!
//! | variable | value |
//! |---|---|
//! | `DEP_EMBREE4_VERSION` | version of the headers, such as `4.3.3` |
//! | `DEP_EMBREE4_LIB_DIR` | folder of the library |
//! | `DEP_EMBREE4_RPATH` | folder of the library if the loader does not search it, else empty |

#[cfg(not(without_bindings))]
mod bindings {
    // Rules of the project that generated code does not follow:
    #![allow(
        // Names are Embree's.
        non_camel_case_types,
        non_snake_case,
        non_upper_case_globals,
        // Functions of a C library are unsafe to call.
        unsafe_code,
        // The documentation is Embree's: it has gaps, and was not written as Markdown.
        missing_docs,
        rustdoc::all,
        // The style is bindgen's.
        clippy::all,
        clippy::undocumented_unsafe_blocks
    )]
    include!(concat!(env!("OUT_DIR"), "/bindings.rs"));
}

#[cfg(not(without_bindings))]
pub use bindings::*;

// Check assumptions of safe code that uses these bindings. bindgen has already checked every
// structure against libclang's view of the header. These assertions check that view against
// Embree's documentation.
#[cfg(not(without_bindings))]
const _: () = {
    use core::mem::offset_of;

    // Embree loads rays and hits with aligned 16-byte instructions.
    assert!(align_of::<RTCRay>() == 16);
    assert!(align_of::<RTCHit>() == 16);
    assert!(align_of::<RTCRayHit>() == 16);

    assert!(size_of::<RTCRay>() == 48);
    assert!(offset_of!(RTCRay, org_x) == 0);
    assert!(offset_of!(RTCRay, tnear) == 12);
    assert!(offset_of!(RTCRay, dir_x) == 16);
    assert!(offset_of!(RTCRay, time) == 28);
    assert!(offset_of!(RTCRay, tfar) == 32);
    assert!(offset_of!(RTCRay, mask) == 36);
    assert!(offset_of!(RTCRay, id) == 40);
    assert!(offset_of!(RTCRay, flags) == 44);

    assert!(offset_of!(RTCHit, Ng_x) == 0);
    assert!(offset_of!(RTCHit, u) == 12);
    assert!(offset_of!(RTCHit, v) == 16);
    assert!(offset_of!(RTCHit, primID) == 20);
    assert!(offset_of!(RTCHit, geomID) == 24);
    assert!(offset_of!(RTCHit, instID) == 28);

    // A hit has seven words and an instance id for each level of instancing. With instance arrays,
    // each level has two ids. At the usual single level, ray and hit together have 80 or 96 bytes.
    let ids = RTC_MAX_INSTANCE_LEVEL_COUNT as usize * (1 + RTC_GEOMETRY_INSTANCE_ARRAY as usize);
    assert!(offset_of!(RTCRayHit, ray) == 0);
    assert!(offset_of!(RTCRayHit, hit) == 48);
    assert!(size_of::<RTCRayHit>() == 48 + (4 * (7 + ids)).next_multiple_of(16));
};
