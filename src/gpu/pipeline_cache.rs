//! The driver's pipeline cache, one an open device, kept on disk between runs.
//!
//! A file is a checksum and the driver's data. It is written atomically; one that is damaged or
//! of another driver is ignored. Failing to read or write it costs time only, so it is silent.

use super::device_error;
use crate::error::Result;
use crate::output::write_atomically;
use ash::vk;
use std::path::PathBuf;

/// What the driver learns from compiling pipelines.
pub struct PipelineCache {
    handle: vk::PipelineCache,
    /// Where it is kept; none for devices of a host, whose user did not ask for files.
    file: Option<PathBuf>,
    /// What the file had.
    stored: Vec<u8>,
}

impl PipelineCache {
    /// With what earlier runs left for drivers of this UUID, or without.
    ///
    /// # Errors
    /// [`crate::Error::Device`] where the device fails.
    pub fn new(device: &ash::Device, uuid: Option<[u8; vk::UUID_SIZE]>) -> Result<Self> {
        let file = uuid.and_then(file);
        let stored = (file.as_ref())
            .and_then(|path| std::fs::read(path).ok())
            .and_then(unpack)
            .unwrap_or_default();
        let info = vk::PipelineCacheCreateInfo::default().initial_data(&stored);
        // SAFETY: the driver checks the header of data that passed our checksum.
        let handle = unsafe { device.create_pipeline_cache(&info, None) }
            .map_err(device_error("making a pipeline cache"))?;
        Ok(Self {
            handle,
            file,
            stored,
        })
    }

    pub fn handle(&self) -> vk::PipelineCache {
        self.handle
    }

    /// Keeps what was learnt. Only while the device exists.
    pub fn destroy(&mut self, device: &ash::Device) {
        // SAFETY: a live cache of this device, used by nobody else.
        let data = unsafe { device.get_pipeline_cache_data(self.handle) }.unwrap_or_default();
        // SAFETY: as above.
        unsafe { device.destroy_pipeline_cache(self.handle, None) };
        if let Some(path) = &self.file
            && data != self.stored
        {
            let _ = std::fs::create_dir_all(path.parent().expect("a file in a folder"));
            let _ = write_atomically(path, &pack(&data));
        }
    }
}

fn file(uuid: [u8; vk::UUID_SIZE]) -> Option<PathBuf> {
    let id: String = uuid.iter().map(|byte| format!("{byte:02x}")).collect();
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
