//! The blocking calls: they record the same passes as [`Renderer::record`], submit them, and read the results.

use crate::error::{Error, Result};
use crate::flux_balance::FluxBalance;
use crate::gpu::Image;
use crate::image_file::RgbImage;
use crate::render::chains::Chains;
use crate::render::chains::frame::count_flux;
use crate::render::left_out::{LeftOut, left_out};
use crate::render::splat::resolve::Levels;
use crate::render::stages::Reached;
use crate::render::{FrameBudget, MAX_PATCHES, MAX_RAYS, ReceiverTile, Renderer, frame};
use crate::scene::Camera;
use std::time::{Duration, Instant};

/// Frames in which a budget is approached, at most.
const SETTLING: usize = 20;

impl Renderer {
    /// Begins a blocking frame.
    fn begin(&mut self) -> Result<()> {
        self.recorder.begin_frame()?;
        self.retired.clear();
        Ok(())
    }

    /// Renders the caustic into the light maps and waits for it.
    ///
    /// # Errors
    /// [`Error::Device`] if the device fails, [`Error::Cancelled`] if the watcher stops the work, [`Error::Host`] on the
    /// device of a host.
    pub fn caustic(&mut self) -> Result<()> {
        if let Some(reached) = self.grows.take() {
            self.grow(&reached)?;
        }
        let mut start = Instant::now();
        self.begin()?;
        if self.is_current {
            return Ok(());
        }
        loop {
            self.record_caustic()?;
            self.recorder
                .submit()
                .inspect_err(|_| self.is_current = false)?;
            // Not so before what was drawn is known to be all.
            self.is_current = false;
            self.is_current = self.caustic.is_complete()?;
            if !self.is_current {
                start = Instant::now();
                self.begin()?;
                continue;
            }
            let Some(reached) = self.caustic.reached()? else {
                return Ok(());
            };
            let can_grow = self.can_grow(&reached);
            if self.budget.is_some() {
                let time = std::mem::take(&mut self.update_time) + start.elapsed();
                self.hold_budget(time, reached, can_grow);
                return Ok(());
            }
            if !can_grow {
                return Ok(());
            }
            self.is_current = false;
            self.grow(&reached)?;
            self.begin()?;
        }
    }

    /// Sets the error that the next frame aims for, after a frame that took `time`.
    fn hold_budget(&mut self, time: Duration, reached: Reached, can_grow: bool) {
        if let Some(budget) = &mut self.budget
            && let Some(error) = reached.error
            && !self.recorder.waits_each_pass()
        {
            budget.add(time, error);
            self.grows = (can_grow && budget.has_time_for_more()).then_some(reached);
            let (error, is_met) = (budget.error(), budget.is_met());
            self.set_error(error);
            // A still scene is rendered again until the budget is met.
            self.is_current = is_met && self.grows.is_none();
        }
    }

    /// Renders the caustic until [`super::Settings::budget`] is met or cannot be met, in at most 20 frames. Without a budget,
    /// nothing is rendered.
    ///
    /// # Errors
    /// As [`Renderer::caustic`].
    pub fn settle(&mut self) -> Result<()> {
        for _ in 0..SETTLING {
            if self.budget.as_ref().is_none_or(FrameBudget::is_met) {
                break;
            }
            self.caustic()?;
        }
        Ok(())
    }

    /// Whether the buffers that were too small for a frame can be larger.
    fn can_grow(&self, reached: &Reached) -> bool {
        reached.needs_patches && self.scene.patch_budget < MAX_PATCHES
            || reached.lacking_halvings > 0 && self.scene.lattices.ray_capacity < MAX_RAYS
    }

    /// Binds the stages to buffers for four times as many patches, or for all rays that the frame needed.
    fn grow(&mut self, reached: &Reached) -> Result<()> {
        self.overlays = None;
        if reached.needs_patches && self.scene.patch_budget < MAX_PATCHES {
            self.scene.patch_budget *= 4;
        }
        self.scene.lattices.ray_capacity = self.rays_with(reached.lacking_halvings);
        self.caustic = self.bind_stages()?;
        Ok(())
    }

    /// Computes where the light of the scene's suns, lamps and environment cells ends that meets mirrors and interfaces. `None`
    /// where the frame follows no chains: with methods other than `footprint`, or if no light can meet several surfaces.
    ///
    /// It follows the rays of a frame once more, in passes of its own that count the light, with the memory of their own that they
    /// need; light maps and later frames stay as they are. The light of a single surface is counted by the same rays, although
    /// facets carry it to the light maps.
    ///
    /// # Errors
    /// As [`Renderer::caustic`].
    pub fn flux_balance(&mut self) -> Result<Option<FluxBalance>> {
        self.begin()?;
        if !self.caustic.has_chains() {
            return Ok(None);
        }
        // The stages of the frame are bound to buffers of their own size.
        let rays = self.scene.lattices.ray_capacity;
        let counted = self.count_flux_of_all_rays();
        self.scene.lattices.ray_capacity = rays;
        counted.map(Some)
    }

    /// Has room for more and more rays until there is room for all.
    fn count_flux_of_all_rays(&mut self) -> Result<FluxBalance> {
        let levels = Levels::new(&self.context, &self.scene)?;
        loop {
            let error = self.settings.error;
            let chains = Chains::new(&self.context, &mut self.scene, &levels, error, true)?;
            self.context.compile_pipelines()?;
            frame::upload(&mut self.recorder, &mut self.scene)?;
            count_flux(&mut self.recorder, &self.scene, &chains)?;
            self.recorder.submit()?;
            let needed = self.rays_with(chains.lacking_halvings()?);
            if needed == self.scene.lattices.ray_capacity {
                return chains.read_flux_balance(&self.scene);
            }
            self.scene.lattices.ray_capacity = needed;
            self.begin()?;
        }
    }

    /// Room for the rays of chains that twice as many would need so often, as far as it may grow.
    fn rays_with(&self, doublings: u32) -> u32 {
        let rays = self.scene.lattices.ray_capacity;
        let needed = u64::from(rays) << doublings.min(16);
        needed.min(MAX_RAYS.max(rays).into()) as u32
    }

    /// What the last [`Renderer::caustic`] left out. [`Renderer::notes`] has what concerns the whole scene, in sentences.
    ///
    /// `balance` is that of [`Renderer::flux_balance`], which counts the light that chains cut off.
    ///
    /// # Errors
    /// [`crate::Error::Device`] where the device fails.
    pub fn left_out(&self, balance: Option<&FluxBalance>) -> Result<Vec<LeftOut>> {
        left_out(&self.scene, &self.caustic, balance)
    }

    /// Renders the direct light of all lights into the direct maps and waits for it.
    ///
    /// # Errors
    /// As [`Renderer::caustic`].
    pub fn direct(&mut self) -> Result<()> {
        self.fit_direct_maps()?;
        self.begin()?;
        frame::upload(&mut self.recorder, &mut self.scene)?;
        self.record_direct()?;
        self.submit_direct()
    }

    /// Submits; where that fails, the direct maps are undefined.
    fn submit_direct(&mut self) -> Result<()> {
        let submitted = self.recorder.submit();
        submitted.inspect_err(|_| self.forget_direct())
    }

    /// Renders one frame: caustic, direct light, and `camera`'s view of `size` pixels with
    /// `side`² samples per pixel, as linear radiance. Waits for it. If only the camera differs from the last frame, the caustic and
    /// the direct light are kept.
    ///
    /// # Errors
    /// As [`Renderer::caustic`].
    pub fn view(&mut self, camera: &Camera, size: [u32; 2], side: u32) -> Result<()> {
        self.fit_direct_maps()?;
        self.prepare_view(size, side)?;
        let was_current = self.is_current;
        self.caustic()?;
        if self.prepare_overlays()? || was_current {
            frame::upload(&mut self.recorder, &mut self.scene)?;
        }
        let recorded = self.record_direct().and_then(|()| self.record_view(camera));
        recorded.inspect_err(|_| self.forget_direct())?;
        self.submit_direct()
    }

    /// Linear radiance of the last [`Renderer::view`], W/m²/sr.
    ///
    /// # Errors
    /// [`Error::Device`] where the device fails.
    ///
    /// # Panics
    /// If no view was rendered.
    pub fn read_view(&self) -> Result<RgbImage> {
        let view = &self.view.as_ref().expect("a view was rendered").image;
        read(view, [0, 0], [view.width, view.height])
    }

    /// Caustic irradiance of the receiver `object`, W/m², after [`Renderer::caustic`].
    ///
    /// # Errors
    /// [`Error::Usage`] where the object has no light map, [`Error::Device`] where the device fails.
    pub fn read_caustic(&self, object: usize) -> Result<RgbImage> {
        let tile = self.tile(object)?.light;
        let image = read(&self.light_map, tile.origin, tile.size)?;
        Ok(self.without_borders(image, object))
    }

    /// Number of splats that each texel of the light map of `object` got, in all channels, without those of coarser levels, after
    /// a [`Renderer::view`] with [`super::Overlay::Density`].
    ///
    /// # Errors
    /// As [`Renderer::read_caustic`].
    ///
    /// # Panics
    /// If the last view was without the overlay.
    pub fn read_density(&self, object: usize) -> Result<RgbImage> {
        let tile = self.tile(object)?.light;
        let overlays = self.overlays.as_ref();
        let counts = overlays.and_then(|overlays| overlays.counts.as_ref());
        read(counts.expect("a view with density"), tile.origin, tile.size)
    }

    /// Direct irradiance of the receiver `object`, W/m², after [`Renderer::direct`]: means over the texels of the light map, or the value of
    /// the texel of the direct map that contains them where that is coarser.
    ///
    /// # Errors
    /// As [`Renderer::read_caustic`].
    pub fn read_direct(&self, object: usize) -> Result<RgbImage> {
        let tile = self.tile(object)?;
        let fine = read(&self.direct.map, tile.direct.origin, tile.direct.size)?;
        let [width, height] = tile.light.size;
        let mut pixels = vec![[0.0f32; 3]; (width * height) as usize];
        if fine.width < width {
            // The map is coarser than the light map, as in motion.
            for (index, pixel) in (0..).zip(&mut pixels) {
                let [x, y] = [
                    index % width * fine.width / width,
                    index / width * fine.height / height,
                ];
                *pixel = fine.pixels[(y * fine.width + x) as usize];
            }
        } else {
            let scale = fine.width / width;
            for (index, rgb) in (0..).zip(&fine.pixels) {
                let [column, row] = [index % fine.width, index / fine.width].map(|at| at / scale);
                let texel = &mut pixels[(row * width + column) as usize];
                for (sum, value) in texel.iter_mut().zip(rgb) {
                    *sum += value / (scale * scale) as f32;
                }
            }
        }
        let image = RgbImage {
            width,
            height,
            pixels,
        };
        Ok(self.without_borders(image, object))
    }

    fn tile(&self, object: usize) -> Result<&ReceiverTile> {
        (self.tiles.iter())
            .find(|tile| tile.object == object)
            .ok_or_else(|| Error::Usage {
                reason: format!("object {object} has no light map"),
                remedy: "name a diffuse rect or mesh with the key lightmap".into(),
            })
    }

    /// Sets texels of a mesh's light map outside its charts to 0.
    fn without_borders(&self, mut image: RgbImage, object: usize) -> RgbImage {
        if let Some(atlas) = &self.scene.receivers.atlases[object] {
            for (texel, pixel) in image.pixels.iter_mut().enumerate() {
                if atlas.pieces(texel).is_empty() {
                    *pixel = [0.0; 3];
                }
            }
        }
        image
    }
}

fn read(image: &Image, origin: [u32; 2], size: [u32; 2]) -> Result<RgbImage> {
    let pixels = image
        .read(origin, size)?
        .iter()
        .map(|&[r, g, b, _]| [r, g, b])
        .collect();
    Ok(RgbImage {
        width: size[0],
        height: size[1],
        pixels,
    })
}
