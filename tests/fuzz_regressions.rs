//! Inputs that once failed under fuzzing; see docs/fuzzing.md.

#![cfg(feature = "cli")]

#[path = "../fuzz/src/lib.rs"]
mod fuzz;

use std::fs;
use std::path::Path;

#[test]
fn inputs_that_once_failed_are_read_or_refused() {
    limit_memory();
    let inputs = fuzz::Inputs::new();
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("fuzz/regressions");
    let mut count = 0;
    for target in fs::read_dir(folder).unwrap() {
        let target = target.unwrap();
        for file in fs::read_dir(target.path()).unwrap() {
            let file = file.unwrap().path();
            eprintln!("{}", file.display());
            inputs.run(
                target.file_name().to_str().unwrap(),
                &fs::read(file).unwrap(),
            );
            count += 1;
        }
    }
    assert!(count > 0, "there are no regressions");
}

/// What would take more is refused or aborts, as in `fuzz/run`. The test's threads reserve more there.
fn limit_memory() {
    #[cfg(all(target_os = "linux", target_env = "gnu"))]
    {
        let limit = libc::rlimit {
            rlim_cur: 8 << 30,
            rlim_max: 8 << 30,
        };
        // SAFETY: a valid pointer.
        let result = unsafe { libc::setrlimit(libc::RLIMIT_AS, &limit) };
        assert_eq!(result, 0);
    }
}
