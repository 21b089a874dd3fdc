//! The passes and barriers of chains, in order, as a part of those of render/frame.rs.

use crate::error::Result;
use crate::gpu::{Access, Image, Recorder};
use crate::render::barriers::{LIST_READ, after_draw, next};
use crate::render::chains::Chains;
use crate::render::chains::landings::Landings;
use crate::render::device_scene::DeviceScene;

/// Chooses the rays that begin chains, and estimates the error that they leave on each receiver.
pub fn plan_chains(recorder: &mut Recorder, scene: &DeviceScene, chains: &Chains) -> Result<()> {
    recorder.pass("pilot chains", |r| {
        chains.record_pilot(r, scene);
        next(r);
        chains.record_weigh(r, scene);
        next(r);
        chains.record_plan(r, scene);
        next(r);
    })?;
    recorder.pass("number rays", |r| {
        chains.record_count_rays(r, scene);
        next(r);
        chains.record_number_rays(r, scene);
        next(r);
        chains.record_scan_rays(r, scene);
        next(r);
    })
}

/// Follows these rays from surface to surface, a wave at a time, and adds where they land to the light maps.
pub fn splat_chains(
    recorder: &mut Recorder,
    scene: &DeviceScene,
    chains: &Chains,
    light_map: &Image,
    clear: &mut bool,
) -> Result<()> {
    follow_chains(recorder, scene, chains)?;
    recorder.pass("splat chains", |r| {
        r.barrier(Access::COMPUTE_WRITE, LIST_READ);
        chains.record_splat(r, light_map, *clear);
        after_draw(r);
    })?;
    *clear = false;
    match &chains.landings {
        Some(landings) => splat_landings(recorder, scene, chains, landings, light_map),
        None => Ok(()),
    }
}

/// Counts the light of chains by where it ends, and lights nothing.
pub fn count_flux(recorder: &mut Recorder, scene: &DeviceScene, chains: &Chains) -> Result<()> {
    recorder.pass("clear sums of flux", |r| {
        chains.record_clear(r);
        r.barrier(Access::TRANSFER_WRITE, Access::COMPUTE);
    })?;
    plan_chains(recorder, scene, chains)?;
    follow_chains(recorder, scene, chains)?;
    match &chains.landings {
        Some(landings) => recorder.pass("count lost landings", |r| {
            landings.record_project(r, &chains.push(scene, chains.wave_count), [0, 0]);
            next(r);
        }),
        None => Ok(()),
    }
}

/// Follows the rays of the lattices to their ends, and lists the footprints of what lands on planar receivers and the landings on mesh
/// receivers.
fn follow_chains(recorder: &mut Recorder, scene: &DeviceScene, chains: &Chains) -> Result<()> {
    for wave in 0..chains.wave_count {
        recorder.pass("trace chains", |r| {
            chains.record_trace(r, scene, wave);
            next(r);
        })?;
        recorder.pass("number chains", |r| {
            chains.record_number(r, wave);
            next(r);
            chains.record_scan(r, scene, wave);
            next(r);
        })?;
        recorder.pass("emit chains", |r| {
            chains.record_emit(r, scene, wave);
            next(r);
        })?;
    }
    recorder.pass("finish chains", |r| {
        chains.record_finish(r, scene);
        next(r);
    })?;
    let Some(landings) = &chains.landings else {
        return Ok(());
    };
    recorder.pass("count landings", |r| {
        landings.record_count(r, &chains.push(scene, chains.wave_count));
        next(r);
    })?;
    recorder.pass("number landings", |r| {
        landings.record_number(r);
        next(r);
        landings.record_scan(r);
        next(r);
    })
}

/// Adds the light of landings to the light maps of mesh receivers, in batches of mesh footprints.
fn splat_landings(
    recorder: &mut Recorder,
    scene: &DeviceScene,
    chains: &Chains,
    landings: &Landings,
    light_map: &Image,
) -> Result<()> {
    let push = chains.push(scene, chains.wave_count);
    // A host's command buffer records the maximum number of batches.
    let mut total = landings.buffers.splat_capacity;
    if recorder.is_ours() {
        total = landings.splat_count(recorder)?;
    }
    let first = scene.first_pairs();
    recorder.tiled("landings", total.into(), first, |r, done, limit| {
        let batch = [done as u32, limit.min(landings.buffers.batch.into()) as u32];
        r.pass("project landings", |r| {
            landings.record_project(r, &push, batch);
            r.barrier(Access::COMPUTE_WRITE, LIST_READ);
        })?;
        r.pass("splat landings", |r| {
            landings.record_splat(r, light_map);
            after_draw(r);
        })?;
        Ok(batch[1].into())
    })
}
