//! The reference of a scene's light maps, which a thread of low priority refines as long as the scene stays the same.

use nephroid::reference::{Options, caustic};
use nephroid::scene::{Atlas, Scene};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard};
use std::thread::{JoinHandle, spawn};

/// Rays of the first pass over a receiver, about; every pass has twice those of the last one, up to the most.
const FIRST_RAYS: u64 = 1 << 20;
const MOST_RAYS: u64 = 1 << 25;
/// Expected L1 error of a receiver that is not refined any more.
const GOAL: f64 = 0.001;
/// √(2/π): the expected |x| of a normal x over its standard deviation.
const MEAN_ABSOLUTE: f64 = 0.797_884_560_802_865_4;

/// The light map of a receiver so far.
#[derive(Debug, Clone)]
pub struct LightMap {
    /// Index of its object.
    pub receiver: usize,
    /// Irradiance, W/m², as the renderer's image has it; the fourth value is not used.
    pub texels: Vec<[f32; 4]>,
    /// Expected L1 error, from the standard errors of all values.
    pub error: f64,
}

/// All light maps that there are, or why there are no more.
type News = Result<Vec<LightMap>, String>;

#[derive(Default)]
struct Shared {
    cancel: AtomicBool,
    /// Since the last look.
    news: Mutex<Option<News>>,
}

impl Shared {
    fn lock(&self) -> MutexGuard<'_, Option<News>> {
        self.news.lock().expect("no panic while held")
    }
}

/// The reference of the scene that was set last. Its computation ends when it is dropped.
pub struct Reference {
    shared: Arc<Shared>,
    thread: JoinHandle<()>,
    /// The scene to begin with when the thread has ended, so that there is one at a time.
    next: Option<Scene>,
    /// Light maps so far, with a number that changes with them.
    pub maps: (u64, Arc<Vec<LightMap>>),
}

impl Reference {
    pub fn new(scene: Scene) -> Self {
        let shared = Arc::<Shared>::default();
        Self {
            thread: start(scene, shared.clone()),
            shared,
            next: None,
            maps: (1, Arc::default()),
        }
    }

    /// Begins again, with another scene.
    pub fn restart(&mut self, scene: Scene) {
        self.shared.cancel.store(true, Ordering::Relaxed);
        self.next = Some(scene);
        self.maps = (self.maps.0 + 1, Arc::default());
    }

    /// Whether [`Reference::follow`] would find something.
    pub fn has_news(&self) -> bool {
        match self.next {
            Some(_) => self.thread.is_finished(),
            None => self.shared.lock().is_some(),
        }
    }

    /// Takes over light maps that were refined, and begins with the scene that waits.
    ///
    /// # Errors
    /// Why there will be no more light maps, once.
    pub fn follow(&mut self) -> Result<(), String> {
        if self.next.is_none() {
            if let Some(news) = self.shared.lock().take() {
                self.maps = (self.maps.0 + 1, Arc::new(news?));
            }
        } else if self.thread.is_finished()
            && let Some(scene) = self.next.take()
        {
            self.shared = Arc::default();
            self.thread = start(scene, self.shared.clone());
        }
        Ok(())
    }
}

impl Drop for Reference {
    fn drop(&mut self) {
        // The thread looks at this often, and nobody waits for it.
        self.shared.cancel.store(true, Ordering::Relaxed);
    }
}

/// Refines the light maps of a scene on a thread.
fn start(scene: Scene, shared: Arc<Shared>) -> JoinHandle<()> {
    spawn(move || {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(1)
            .start_handler(|_| lower_priority())
            .build();
        let refined = match pool {
            Ok(pool) => pool
                .install(|| refine(&scene, &shared))
                .map_err(|error| error.to_string()),
            Err(error) => Err(error.to_string()),
        };
        if let Err(failure) = refined {
            *shared.lock() = Some(Err(failure));
        }
    })
}

/// The mean of independent estimates of a receiver, weighted by their samples.
struct Sum {
    receiver: usize,
    size: [u32; 2],
    samples: f64,
    /// Σ samples · mean, and Σ (samples · standard error)².
    values: Vec<[f64; 3]>,
    squares: Vec<[f64; 3]>,
}

impl Sum {
    fn add(&mut self, samples: u64, mean: &[[f64; 3]], error: &[[f64; 3]]) {
        let samples = samples as f64;
        let sums = self.values.as_flattened_mut().iter_mut();
        for (sum, value) in sums.zip(mean.as_flattened()) {
            *sum += samples * value;
        }
        let sums = self.squares.as_flattened_mut().iter_mut();
        for (sum, value) in sums.zip(error.as_flattened()) {
            *sum += (samples * value).powi(2);
        }
        self.samples += samples;
    }

    fn error(&self) -> f64 {
        let light: f64 = self.values.as_flattened().iter().sum();
        let squares = self.squares.as_flattened().iter();
        let deviation: f64 = squares.map(|square| square.sqrt()).sum();
        match self.samples > 0.0 {
            true if light > 0.0 => MEAN_ABSOLUTE * deviation / light,
            true => 0.0,
            false => f64::INFINITY,
        }
    }

    fn light_map(&self, scene: &Scene) -> LightMap {
        let texel = |sum: &[f64; 3]| {
            let [r, g, b] = sum.map(|sum| (sum / self.samples) as f32);
            [r, g, b, 0.0]
        };
        let mut texels: Vec<[f32; 4]> = self.values.iter().map(texel).collect();
        // As in the renderer, texels beside a mesh's charts copy the nearest ones in them.
        let object = &scene.objects[self.receiver];
        if object.geometry.placement().is_some()
            && let Ok((atlas, _)) = Atlas::of(object, self.size)
        {
            for (to, from) in atlas.around() {
                texels[to] = texels[from];
            }
        }
        LightMap {
            receiver: self.receiver,
            texels,
            error: self.error(),
        }
    }
}

/// Refines all receivers in turn until all are good enough.
fn refine(scene: &Scene, shared: &Shared) -> nephroid::Result<()> {
    let empty = |[width, height]: [u32; 2]| vec![[0.0; 3]; width as usize * height as usize];
    let sums = scene.light_maps().into_iter().map(|(receiver, size)| Sum {
        receiver,
        size,
        samples: 0.0,
        values: empty(size),
        squares: empty(size),
    });
    let mut sums: Vec<Sum> = sums.collect();
    let mut maps: Vec<LightMap> = Vec::new();
    let mut max_samples = FIRST_RAYS;
    for seed in 0.. {
        if sums.iter().all(|sum| sum.error() <= GOAL) {
            break;
        }
        for (index, sum) in sums.iter_mut().enumerate() {
            if sum.error() <= GOAL {
                continue;
            }
            let options = Options {
                error: GOAL,
                max_samples,
                seed,
            };
            let (receiver, size) = (sum.receiver, sum.size);
            let found = caustic(scene, receiver, size, &options, &mut |_| {}, &shared.cancel)?;
            sum.add(found.samples, &found.irradiance, &found.standard_error);
            let map = sum.light_map(scene);
            match maps.get_mut(index) {
                Some(last) => *last = map,
                None => maps.push(map),
            }
            *shared.lock() = Some(Ok(maps.clone()));
        }
        max_samples = (2 * max_samples).min(MOST_RAYS);
    }
    Ok(())
}

/// Of this thread, where the system has priorities of threads.
fn lower_priority() {
    #[cfg(all(target_os = "linux", target_env = "gnu"))]
    // SAFETY: no pointers; 0 is the calling thread. A refusal changes nothing.
    unsafe {
        libc::setpriority(libc::PRIO_PROCESS, 0, 19);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn estimates_are_weighted_by_their_samples() {
        let mut sum = Sum {
            receiver: 0,
            size: [1, 1],
            samples: 0.0,
            values: vec![[0.0; 3]],
            squares: vec![[0.0; 3]],
        };
        assert!(sum.error().is_infinite());
        sum.add(100, &[[1.0; 3]], &[[0.2; 3]]);
        sum.add(300, &[[2.0; 3]], &[[0.1; 3]]);
        // Mean 1.75; standard error √((100 · 0.2)² + (300 · 0.1)²) / 400.
        assert!((sum.values[0][0] / sum.samples - 1.75).abs() < 1e-12);
        let expected = MEAN_ABSOLUTE * (20f64.powi(2) + 30f64.powi(2)).sqrt() / 700.0;
        assert!((sum.error() - expected).abs() < 1e-12);
    }
}
