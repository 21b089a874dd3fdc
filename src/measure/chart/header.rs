//! What a chart's header says about the machine and the program.

use super::{Chart, DeviceKind, SCHEMA};
use crate::gpu::DeviceInfo;
use crate::measure::machine;

impl Chart {
    /// Without scenes, made now, on this machine.
    pub fn new(device: &DeviceInfo) -> Self {
        Self {
            schema: SCHEMA,
            nephroid: env!("CARGO_PKG_VERSION").into(),
            commit: machine::commit(),
            date: machine::date(),
            device: device.name.clone(),
            driver: device.driver.clone(),
            cpu: machine::cpu(),
            kind: match device.kind {
                "cpu" => DeviceKind::Software,
                _ => DeviceKind::Hardware,
            },
            scenes: Vec::new(),
        }
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
