//! A scene on a device, at a time, for the commands that render.

use super::files::Files;
use super::gpu_options::GpuOptions;
use super::light_map_size::LightMapSize;
use super::terminal::log;
use super::timeline::Shot;
use nephroid::gpu::{Context, ContextOptions, Messages};
use nephroid::measure::{ChosenLightMap, choose_light_maps};
use nephroid::render::{Renderer, Settings};
use nephroid::scene::{Animation, Scene};
use nephroid::{Error, Result};
use std::sync::Arc;

/// A scene on a device.
pub struct Session {
    // Dropped in this order, so that validation messages about dropping are seen.
    pub renderer: Renderer,
    pub context: Arc<Context>,
    pub complaints: Complaints,
    /// The scene at the time that is rendered.
    pub scene: Scene,
    settings: Settings,
    animation: Animation,
    lightmap: Option<LightMapSize>,
    /// The light maps whose sizes were chosen.
    pub chosen: Vec<ChosenLightMap>,
}

/// The scene at a time, with light maps of the size asked for.
fn scene_at(animation: &Animation, time: f64, lightmap: Option<LightMapSize>) -> Scene {
    let mut scene = animation.at(time);
    if let Some(size) = lightmap {
        for texels in (scene.objects.iter_mut()).filter_map(|o| o.light_map.as_mut()) {
            *texels = size.texels(*texels);
        }
    }
    scene
}

impl Session {
    /// Loads the scene, opens the device, uploads the scene at the time of the first picture.
    pub fn open(options: &GpuOptions, files: &Files, shots: &[Shot]) -> Result<Self> {
        let settings = options.settings()?;
        let mut animation = files.load(shots)?.animation;
        let time = shots[0].time;
        let context = Context::new(&ContextOptions {
            device: options.device.clone(),
            validate: options.validate,
        })?;
        let complaints = Complaints(context.messages());
        let auto = animation.auto_light_maps().to_vec();
        let mut chosen = Vec::new();
        if options.lightmap.is_none() && !auto.is_empty() {
            chosen = choose_light_maps(&context, &animation.at(time), &auto, &settings)?;
            for map in &chosen {
                animation.set_light_map(map.object, map.texels);
            }
        }
        let scene = scene_at(&animation, time, options.lightmap);
        let renderer = Renderer::new(&context, &scene, &settings)?;
        Ok(Self {
            renderer,
            context,
            complaints,
            scene,
            settings,
            animation,
            lightmap: options.lightmap,
            chosen,
        })
    }

    /// Updates the renderer to another time.
    pub fn show(&mut self, time: f64) -> Result<()> {
        self.scene = scene_at(&self.animation, time, self.lightmap);
        match self.renderer.update(&self.scene) {
            // For instance, a mesh that was convex is not any more.
            Err(Error::Usage { .. }) => {
                self.renderer = Renderer::new(&self.context, &self.scene, &self.settings)?;
                Ok(())
            }
            result => result,
        }
    }

    /// Closes the device.
    ///
    /// # Errors
    /// [`Error::Validation`] if there was any validation message since the device was opened.
    pub fn finish(self) -> Result<()> {
        drop(self.renderer);
        drop(self.context);
        self.complaints.check()
    }
}

/// Messages of the validation layers. A command that fails for another reason still prints them.
pub struct Complaints(Arc<Messages>);

impl Complaints {
    /// [`Error::Validation`] if there are any.
    pub fn check(&self) -> Result<()> {
        let messages = self.0.take();
        match messages.first() {
            None => Ok(()),
            Some(first) => Err(Error::Validation {
                count: messages.len(),
                first: first.clone(),
            }),
        }
    }
}

impl Drop for Complaints {
    fn drop(&mut self) {
        for message in self.0.take() {
            log("validation", &message);
        }
    }
}
