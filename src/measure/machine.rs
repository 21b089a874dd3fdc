//! When and on what something was measured.

/// Now, UTC, as ISO 8601.
pub fn date() -> String {
    format!("{:.0}", jiff::Timestamp::now())
}

/// Of the source that this program was built from, where it was a git checkout.
pub fn commit() -> Option<String> {
    option_env!("NEPHROID_COMMIT").map(Into::into)
}

/// Model name of the CPU, as Linux tells it; elsewhere its architecture.
pub fn cpu() -> String {
    let info = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let model = info.lines().find_map(|line| {
        let (key, value) = line.split_once(':')?;
        (key.trim() == "model name").then(|| value.trim().to_owned())
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
