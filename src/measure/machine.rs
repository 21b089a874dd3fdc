//! When and on what something was measured.

use sysinfo::{CpuRefreshKind, System};

/// Now, UTC, as ISO 8601.
pub fn date() -> String {
    format!("{:.0}", jiff::Timestamp::now())
}

/// Of the source that this program was built from, where it was a git checkout.
pub fn commit() -> Option<String> {
    option_env!("NEPHROID_COMMIT").map(Into::into)
}

/// Model name of the CPU; its architecture where the system does not tell.
pub fn cpu() -> String {
    let model = System::new().ok().and_then(|mut system| {
        system.refresh_cpu_list(CpuRefreshKind::nothing());
        let brand = system.cpus().first()?.brand().trim().to_owned();
        (!brand.is_empty()).then_some(brand)
    });
    model.unwrap_or_else(|| std::env::consts::ARCH.into())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_cpu_has_a_name() {
        assert!(!cpu().trim().is_empty());
    }
}
