//! The driver's pipeline cache, kept on disk between runs.
//!
//! A file is a checksum and the driver's data. It is written atomically; one that is damaged or
//! of another driver is ignored. Failing to read or write it costs time only, so it is silent.

use super::{Context, device_error};
use crate::error::Result;
use crate::output::write_atomically;
use ash::vk;
use std::path::PathBuf;

/// Runs `make` with a cache that knows what earlier runs compiled, and keeps what it learns.
pub fn with(
    context: &Context,
    make: impl FnOnce(vk::PipelineCache) -> Result<vk::Pipeline>,
) -> Result<vk::Pipeline> {
    let path = file(context);
    let stored = path
        .as_ref()
        .and_then(|path| std::fs::read(path).ok())
        .and_then(unpack)
        .unwrap_or_default();
    let info = vk::PipelineCacheCreateInfo::default().initial_data(&stored);
    let device = &context.device;
    // SAFETY: the driver checks the header of data that passed our checksum.
    let cache = unsafe { device.create_pipeline_cache(&info, None) }
        .map_err(device_error("making a pipeline cache"))?;
    let pipeline = make(cache);
    // SAFETY: a live cache of this device, used by nobody else.
    let data = unsafe { device.get_pipeline_cache_data(cache) }.unwrap_or_default();
    // SAFETY: as above.
    unsafe { device.destroy_pipeline_cache(cache, None) };
    if let Some(path) = path
        && data != stored
    {
        let _ = std::fs::create_dir_all(path.parent().expect("a file in a folder"));
        let _ = write_atomically(&path, &pack(&data));
    }
    pipeline
}

fn file(context: &Context) -> Option<PathBuf> {
    let id: String = context
        .cache_uuid()
        .iter()
        .map(|byte| format!("{byte:02x}"))
        .collect();
    Some(
        dirs::cache_dir()?
            .join("nephroid")
            .join(format!("pipelines-{id}.bin")),
    )
}

fn pack(data: &[u8]) -> Vec<u8> {
    [&crc32fast::hash(data).to_le_bytes(), data].concat()
}

fn unpack(file: Vec<u8>) -> Option<Vec<u8>> {
    let (checksum, data) = file.split_first_chunk()?;
    (crc32fast::hash(data) == u32::from_le_bytes(*checksum)).then(|| data.to_vec())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn damaged_files_are_ignored() {
        let file = pack(b"what the driver learnt");
        assert_eq!(
            unpack(file.clone()).as_deref(),
            Some(&b"what the driver learnt"[..])
        );
        for (index, _) in file.iter().enumerate() {
            let mut damaged = file.clone();
            damaged[index] ^= 1;
            assert_eq!(unpack(damaged), None, "byte {index}");
        }
        assert_eq!(unpack(file[..file.len() - 1].to_vec()), None);
        assert_eq!(unpack(Vec::new()), None);
    }
}
