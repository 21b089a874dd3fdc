//! What glibc does with memory that a software device frees.

/// Has the process keep memory that was freed, rather than give it back to the system.
///
/// lavapipe takes some 7 MB for every frame and frees them at its end. glibc hands them back and
/// takes them again, and the page faults cost a quarter of a caustic's time. Programs that render on
/// lavapipe do well to call this once, before they start a thread. It does nothing on systems
/// without glibc.
pub fn keep_freed_memory() {
    #[cfg(all(target_os = "linux", target_env = "gnu"))]
    // SAFETY: no pointers; an option that is refused stays as it is.
    unsafe {
        libc::mallopt(libc::M_TRIM_THRESHOLD, 256 << 20);
        // From here on blocks are mapped one by one; glibc allows no more.
        libc::mallopt(libc::M_MMAP_THRESHOLD, 32 << 20);
    }
}
