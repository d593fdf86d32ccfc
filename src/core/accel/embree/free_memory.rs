//! Return of freed memory to the system.

/// Returns memory that was freed to the system.
///
/// The C library of GNU keeps freed blocks for later requests. After large files are read, the
/// blocks are as large as the scene. Embree allocates pages from the system instead of these
/// blocks, so without this call both would be resident at the same time.
pub(super) fn return_free_memory() {
    #[cfg(all(target_os = "linux", target_env = "gnu"))]
    {
        unsafe extern "C" {
            fn malloc_trim(pad: usize) -> std::ffi::c_int;
        }
        // SAFETY: `malloc_trim` is a function of the GNU C library with this signature. It locks
        // the heaps, and changes only memory that no block uses.
        unsafe { malloc_trim(0) };
    }
}
