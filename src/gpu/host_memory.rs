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

/// Bytes of the stack of a thread on which a driver compiles pipelines: as much as the main thread usually has.
pub const DRIVER_STACK: usize = 8 << 20;

/// Gives threads that are started from now on a stack of so many bytes, those of drivers included, which otherwise
/// follow `ulimit -s`. Only glibc has such a setting; elsewhere nothing happens.
#[cfg(all(target_os = "linux", target_env = "gnu"))]
pub fn set_stack_of_threads(bytes: usize) {
    unsafe extern "C" {
        fn pthread_setattr_default_np(attributes: *const libc::pthread_attr_t) -> libc::c_int;
    }
    let mut attributes = std::mem::MaybeUninit::uninit();
    // SAFETY: the attributes are initialised before they are used, and destroyed after. Where a call fails, the default
    // stays.
    unsafe {
        if libc::pthread_attr_init(attributes.as_mut_ptr()) == 0 {
            libc::pthread_attr_setstacksize(attributes.as_mut_ptr(), bytes);
            pthread_setattr_default_np(attributes.as_ptr());
            libc::pthread_attr_destroy(attributes.as_mut_ptr());
        }
    }
}

#[cfg(not(all(target_os = "linux", target_env = "gnu")))]
pub fn set_stack_of_threads(_: usize) {}
