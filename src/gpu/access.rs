//! The two sides of a barrier.

use ash::vk;

/// One side of a barrier: which stages touch memory, and how.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Access(
    pub(super) vk::PipelineStageFlags2,
    pub(super) vk::AccessFlags2,
);

impl Access {
    pub const COMPUTE_READ: Self = Self(
        vk::PipelineStageFlags2::COMPUTE_SHADER,
        vk::AccessFlags2::SHADER_READ,
    );
    pub const COMPUTE_WRITE: Self = Self(
        vk::PipelineStageFlags2::COMPUTE_SHADER,
        vk::AccessFlags2::SHADER_WRITE,
    );
    pub const COMPUTE: Self = Self::COMPUTE_READ.and(Self::COMPUTE_WRITE);
    pub const VERTEX_READ: Self = Self(
        vk::PipelineStageFlags2::VERTEX_SHADER,
        vk::AccessFlags2::SHADER_READ,
    );
    pub const FRAGMENT_READ: Self = Self(
        vk::PipelineStageFlags2::FRAGMENT_SHADER,
        vk::AccessFlags2::SHADER_READ,
    );
    pub const INDEX_READ: Self = Self(
        vk::PipelineStageFlags2::INDEX_INPUT,
        vk::AccessFlags2::INDEX_READ,
    );
    pub const INDIRECT_READ: Self = Self(
        vk::PipelineStageFlags2::DRAW_INDIRECT,
        vk::AccessFlags2::INDIRECT_COMMAND_READ,
    );
    /// Blending reads and writes.
    pub const BLEND: Self = Self(
        vk::PipelineStageFlags2::COLOR_ATTACHMENT_OUTPUT,
        vk::AccessFlags2::from_raw(
            vk::AccessFlags2::COLOR_ATTACHMENT_READ.as_raw()
                | vk::AccessFlags2::COLOR_ATTACHMENT_WRITE.as_raw(),
        ),
    );
    /// Writes of a color or depth attachment, without blending.
    pub const DRAW: Self = Self(
        vk::PipelineStageFlags2::from_raw(
            vk::PipelineStageFlags2::COLOR_ATTACHMENT_OUTPUT.as_raw()
                | vk::PipelineStageFlags2::EARLY_FRAGMENT_TESTS.as_raw()
                | vk::PipelineStageFlags2::LATE_FRAGMENT_TESTS.as_raw(),
        ),
        vk::AccessFlags2::from_raw(
            vk::AccessFlags2::COLOR_ATTACHMENT_WRITE.as_raw()
                | vk::AccessFlags2::DEPTH_STENCIL_ATTACHMENT_READ.as_raw()
                | vk::AccessFlags2::DEPTH_STENCIL_ATTACHMENT_WRITE.as_raw(),
        ),
    );
    pub const TRANSFER_READ: Self = Self(
        vk::PipelineStageFlags2::ALL_TRANSFER,
        vk::AccessFlags2::TRANSFER_READ,
    );
    pub const TRANSFER_WRITE: Self = Self(
        vk::PipelineStageFlags2::ALL_TRANSFER,
        vk::AccessFlags2::TRANSFER_WRITE,
    );
    pub const HOST_READ: Self = Self(vk::PipelineStageFlags2::HOST, vk::AccessFlags2::HOST_READ);
    /// For uploads and read-backs, where speed does not matter.
    pub const ANY_READ: Self = Self(
        vk::PipelineStageFlags2::ALL_COMMANDS,
        vk::AccessFlags2::MEMORY_READ,
    );
    pub const ANY_WRITE: Self = Self(
        vk::PipelineStageFlags2::ALL_COMMANDS,
        vk::AccessFlags2::MEMORY_WRITE,
    );

    /// For a barrier of a host.
    pub fn masks(self) -> (vk::PipelineStageFlags2, vk::AccessFlags2) {
        (self.0, self.1)
    }

    /// Both.
    pub const fn and(self, other: Self) -> Self {
        Self(
            vk::PipelineStageFlags2::from_raw(self.0.as_raw() | other.0.as_raw()),
            vk::AccessFlags2::from_raw(self.1.as_raw() | other.1.as_raw()),
        )
    }
}
