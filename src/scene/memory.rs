//! Whether there is memory for what a file holds, judged before it is taken: a system without enough
//! does not refuse it, but ends the program later.

use sysinfo::System;

/// Bytes of a triangle at most, from its file to a picture or a reference, measured on meshes of a
/// million and of ten million triangles.
pub const TRIANGLE: u64 = 1200;
/// Bytes of a triangle of each further frame of an animated mesh.
pub const TRIANGLE_OF_FRAME: u64 = 160;
/// Bytes of an environment's pixel at most, measured in the same way.
pub const PIXEL: u64 = 110;
/// Bytes of a texel of a mesh's light map at most, while it is laid out.
pub const TEXEL: u64 = 600;

/// Bytes that are not worth asking for: to ask takes longer than to read a small file.
const SMALL: u64 = 1 << 20;

/// What to do about it.
pub const REMEDY: &str = "free some memory, or use a smaller file";

/// # Errors
/// The reason, with both sizes, where `what` takes more `bytes` than are available.
pub fn check(what: &str, bytes: u64) -> Result<(), String> {
    if bytes <= SMALL {
        return Ok(());
    }
    within(what, bytes, available())
}

fn within(what: &str, bytes: u64, available: u64) -> Result<(), String> {
    const GIB: f64 = (1u64 << 30) as f64;
    if bytes <= available {
        return Ok(());
    }
    Err(format!(
        "{what} would take some {:.1} GiB of memory, and {:.1} GiB are available",
        bytes as f64 / GIB,
        available as f64 / GIB
    ))
}

/// Bytes that this process may still take; all where that is not known.
fn available() -> u64 {
    let Ok(mut system) = System::new() else {
        return address_space();
    };
    system.refresh_memory();
    let free = match system.available_memory() {
        0 => u64::MAX, // unknown to sysinfo
        free => free,
    };
    // What a container may have; files in the system's cache do not count.
    let group = (system.cgroup_limits()).map_or(u64::MAX, |group| {
        group.total_memory.saturating_sub(group.rss)
    });
    free.min(group).min(address_space())
}

/// Bytes of address space that `ulimit -v` leaves to this process.
#[cfg(all(target_os = "linux", target_env = "gnu"))]
fn address_space() -> u64 {
    let mut limit = libc::rlimit {
        rlim_cur: libc::RLIM_INFINITY,
        rlim_max: libc::RLIM_INFINITY,
    };
    // SAFETY: a valid pointer; where it fails, the limit stays as it is.
    unsafe { libc::getrlimit(libc::RLIMIT_AS, &mut limit) };
    if limit.rlim_cur == libc::RLIM_INFINITY {
        return u64::MAX;
    }
    // The first number of statm is the size of the address space in use, in pages (proc(5)).
    let pages = std::fs::read_to_string("/proc/self/statm").ok();
    let pages = pages.and_then(|line| line.split(' ').next()?.parse::<u64>().ok());
    // SAFETY: it only returns a number.
    let page = unsafe { libc::sysconf(libc::_SC_PAGESIZE) } as u64;
    limit.rlim_cur.saturating_sub(pages.unwrap_or(0) * page)
}

#[cfg(not(all(target_os = "linux", target_env = "gnu")))]
fn address_space() -> u64 {
    u64::MAX
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_are_named() {
        assert_eq!(within("a mesh", 3 << 30, 3 << 30), Ok(()));
        let reason = within("a mesh", 7 << 29, 3 << 30).unwrap_err();
        assert_eq!(
            reason,
            "a mesh would take some 3.5 GiB of memory, and 3.0 GiB are available"
        );
    }

    #[test]
    fn this_machine_has_memory() {
        assert!(
            (1 << 20..u64::MAX).contains(&available()),
            "{}",
            available()
        );
    }
}
