//! What a chart's header says about the machine and the program.

use super::{Chart, DeviceKind, SCHEMA};
use crate::gpu::DeviceInfo;

impl Chart {
    /// Without scenes, made now, on this machine.
    pub fn new(device: &DeviceInfo) -> Self {
        Self {
            schema: SCHEMA,
            nephroid: env!("CARGO_PKG_VERSION").into(),
            commit: option_env!("NEPHROID_COMMIT").map(Into::into),
            date: format!("{:.0}", jiff::Timestamp::now()),
            device: device.name.clone(),
            driver: device.driver.clone(),
            cpu: cpu(),
            kind: match device.kind {
                "cpu" => DeviceKind::Software,
                _ => DeviceKind::Hardware,
            },
            scenes: Vec::new(),
        }
    }
}

/// Model name, where the system tells it.
fn cpu() -> String {
    let info = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let name = (info.lines())
        .filter_map(|line| line.split_once(':'))
        .find(|(key, _)| key.trim() == "model name")
        .map(|(_, name)| name.trim());
    match name {
        Some(name) if !name.is_empty() => name.into(),
        _ => format!("unknown, {}", std::env::consts::ARCH),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn software_is_told_from_hardware() {
        let chart = |kind| {
            Chart::new(&DeviceInfo {
                name: "a".into(),
                kind,
                driver: "b".into(),
                api_version: "1.3.0".into(),
                unsuitable: None,
            })
        };
        assert_eq!(chart("cpu").kind, DeviceKind::Software);
        let discrete = chart("discrete");
        assert_eq!(discrete.kind, DeviceKind::Hardware);
        assert!(!discrete.cpu.is_empty());
        // Like 2024-05-06T07:08:09Z.
        assert_eq!(discrete.date.len(), 20, "{}", discrete.date);
    }
}
