//! Timestamps around the scopes of one submission, of which there may be any number.

use super::{Context, device_error};
use crate::error::Result;
use ash::vk;
use std::sync::Arc;

/// Scopes of one pool; more of them take more pools.
const POOL_SCOPES: usize = 128;

pub struct Timestamps {
    context: Arc<Context>,
    pools: Vec<vk::QueryPool>,
    /// Scopes since the last [`Timestamps::read`].
    scopes: usize,
}

/// Where a scope's two timestamps go.
#[derive(Clone, Copy)]
pub struct Scope {
    pool: vk::QueryPool,
    first: u32,
}

impl Timestamps {
    pub fn new(context: &Arc<Context>) -> Self {
        Self {
            context: context.clone(),
            pools: Vec::new(),
            scopes: 0,
        }
    }

    /// Begins a scope, outside of rendering; `None` where the queue has no timestamps.
    ///
    /// # Errors
    /// [`crate::Error::Device`] where the device fails.
    pub fn begin(&mut self, commands: vk::CommandBuffer) -> Result<Option<Scope>> {
        if self.context.timestamp_bits == 0 {
            return Ok(None);
        }
        let index = self.scopes / POOL_SCOPES;
        if index == self.pools.len() {
            let info = vk::QueryPoolCreateInfo::default()
                .query_type(vk::QueryType::TIMESTAMP)
                .query_count(2 * POOL_SCOPES as u32);
            // SAFETY: a valid device; destroyed in Drop.
            let pool = unsafe { self.context.device.create_query_pool(&info, None) }
                .map_err(device_error("making a query pool"))?;
            self.pools.push(pool);
        }
        let scope = Scope {
            pool: self.pools[index],
            first: 2 * (self.scopes % POOL_SCOPES) as u32,
        };
        if scope.first == 0 {
            // SAFETY: no submission that uses the pool is under way: the recorder waits.
            unsafe {
                self.context.device.cmd_reset_query_pool(
                    commands,
                    scope.pool,
                    0,
                    2 * POOL_SCOPES as u32,
                );
            }
        }
        self.scopes += 1;
        self.write(commands, scope.pool, scope.first);
        Ok(Some(scope))
    }

    /// Ends a scope.
    pub fn end(&self, commands: vk::CommandBuffer, scope: Scope) {
        self.write(commands, scope.pool, scope.first + 1);
    }

    fn write(&self, commands: vk::CommandBuffer, pool: vk::QueryPool, query: u32) {
        // SAFETY: the query is in the pool, and `begin` had the pool reset.
        unsafe {
            self.context.device.cmd_write_timestamp2(
                commands,
                vk::PipelineStageFlags2::ALL_COMMANDS,
                pool,
                query,
            );
        }
    }

    /// Durations of the scopes of the submission that just ended, s, in their order.
    ///
    /// # Errors
    /// [`crate::Error::Device`] where the device fails.
    pub fn read(&mut self) -> Result<Vec<f64>> {
        let scopes = std::mem::take(&mut self.scopes);
        let limits = &self.context.properties.limits;
        let mut durations = Vec::with_capacity(scopes);
        for pool in &self.pools[..scopes.div_ceil(POOL_SCOPES)] {
            let count = POOL_SCOPES.min(scopes - durations.len());
            let mut ticks = vec![0u64; 2 * count];
            // SAFETY: the submission wrote these queries.
            unsafe {
                self.context.device.get_query_pool_results(
                    *pool,
                    0,
                    &mut ticks,
                    vk::QueryResultFlags::TYPE_64 | vk::QueryResultFlags::WAIT,
                )
            }
            .map_err(device_error("reading timestamps"))?;
            durations.extend(ticks.chunks_exact(2).map(|pair| {
                let ticks = elapsed(pair[0], pair[1], self.context.timestamp_bits);
                ticks as f64 * f64::from(limits.timestamp_period) * 1e-9
            }));
        }
        Ok(durations)
    }

    /// Leaves out the scopes since the last [`Timestamps::read`], which were never run.
    pub fn forget(&mut self) {
        self.scopes = 0;
    }
}

/// Ticks between two timestamps of which only so many bits count, even if they wrap around in
/// between. Time that went back a little, as between cores, counts as none.
fn elapsed(start: u64, end: u64, bits: u32) -> u64 {
    let mask = u64::MAX >> (64 - bits);
    let ticks = end.wrapping_sub(start) & mask;
    if ticks > mask / 2 { 0 } else { ticks }
}

impl Drop for Timestamps {
    fn drop(&mut self) {
        for pool in &self.pools {
            // SAFETY: submissions are waited for.
            unsafe { self.context.device.destroy_query_pool(*pool, None) };
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn timestamps_wrap_around() {
        assert_eq!(elapsed(5, 12, 64), 7);
        assert_eq!(elapsed(u64::MAX - 2, 4, 64), 7);
        // Bits beyond the valid ones are rubbish.
        assert_eq!(elapsed(5 | 1 << 40, 12 | 1 << 50, 36), 7);
        assert_eq!(elapsed((1 << 36) - 3, 4, 36), 7);
        assert_eq!(elapsed(12, 11, 64), 0);
        assert_eq!(elapsed(12, 11, 36), 0);
    }
}
