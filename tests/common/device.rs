//! Devices of tests: under the validation layers, lent from one test to the next.

use super::footprint;
use nephroid::gpu::{Context, ContextOptions};
use nephroid::image_file::RgbImage;
use nephroid::render::{Renderer, Settings};
use nephroid::scene::Scene;
use std::cell::Cell;
use std::sync::{Arc, Condvar, LazyLock, Mutex};

/// Tests that have a device at the same time: others wait. As many as `make test` runs.
const DEVICES: usize = 3;

/// Devices under the validation layers that no test has. All are made at once, and none ends before the process: the layers look
/// up devices in a map that they do not lock (KhronosGroup/Vulkan-ValidationLayers, issue 4391), so that making or destroying one
/// can crash another test amid any call. A missing driver or layer fails the tests.
static IDLE: LazyLock<(Mutex<Vec<Arc<Context>>>, Condvar)> = LazyLock::new(|| {
    let options = ContextOptions {
        validate: true,
        ..ContextOptions::default()
    };
    let open = || Context::new(&options).unwrap_or_else(|error| panic!("{error}"));
    let devices = std::iter::repeat_with(open).take(DEVICES).collect();
    // After the driver and the layers, which are then still there when it is called.
    // SAFETY: called once, after `main`, when no test runs any more.
    assert_eq!(unsafe { libc::atexit(close_devices) }, 0);
    (Mutex::new(devices), Condvar::new())
});

/// Fails a process whose devices, when destroyed, still have objects.
extern "C" fn close_devices() {
    for context in IDLE.0.lock().unwrap().drain(..) {
        let messages = context.messages();
        drop(context);
        let messages = messages.all();
        if !messages.is_empty() {
            eprintln!("{}", messages.join("\n"));
            std::process::abort();
        }
    }
}

thread_local! {
    /// Whether this thread has one of the devices: two tests that want a second one would wait for each other.
    static HAS_DEVICE: Cell<bool> = const { Cell::new(false) };
}

/// A device, and what watches it.
pub struct Device(pub Arc<Context>, Option<Watch>);

impl Device {
    /// Under the validation layers: any message of theirs fails the test, once this is dropped.
    pub fn open() -> Self {
        assert!(!HAS_DEVICE.replace(true), "this test has a device already");
        let (idle, ended) = &*IDLE;
        let mut idle = (ended.wait_while(idle.lock().unwrap(), |idle| idle.is_empty())).unwrap();
        let context = idle.pop().expect("one is idle");
        Self(context.clone(), Some(Watch(context)))
    }

    /// A new one without the layers: for what is measured, or counted from nothing.
    pub fn unwatched() -> Self {
        let context = Context::new(&ContextOptions::default());
        Self(context.unwrap_or_else(|error| panic!("{error}")), None)
    }

    pub fn renderer(&self, scene: &Scene, settings: &Settings) -> Renderer {
        Renderer::new(&self.0, scene, settings).unwrap_or_else(|error| panic!("{error}"))
    }

    /// The caustic on one receiver.
    pub fn caustic(&self, scene: &Scene, receiver: &str, settings: &Settings) -> RgbImage {
        self.caustics(scene, &[receiver], settings).pop().unwrap()
    }

    /// The caustics on several receivers.
    pub fn caustics(&self, scene: &Scene, names: &[&str], settings: &Settings) -> Vec<RgbImage> {
        let mut renderer = self.renderer(scene, settings);
        renderer.caustic().unwrap();
        (names.iter())
            .map(|name| renderer.read_caustic(scene.object_index(name).unwrap()))
            .map(Result::unwrap)
            .collect()
    }

    /// All direct light on one receiver.
    pub fn direct(&self, scene: &Scene, receiver: &str) -> RgbImage {
        self.coarse_direct(scene, receiver, 0)
    }

    /// The same in maps whose sides were halved so often, as in motion.
    pub fn coarse_direct(&self, scene: &Scene, receiver: &str, halvings: u32) -> RgbImage {
        let mut renderer = self.renderer(scene, &footprint(1));
        renderer.set_direct_halvings(halvings);
        renderer.direct().unwrap();
        let receiver = scene.object_index(receiver).unwrap();
        renderer.read_direct(receiver).unwrap()
    }
}

/// Gives a device to the next test, and fails this one if it was not silent. Dropped after the test's own hold on the device.
pub struct Watch(Arc<Context>);

impl Drop for Watch {
    fn drop(&mut self) {
        let messages = self.0.messages().take();
        let is_idle = Arc::strong_count(&self.0) == 1;
        let (idle, ended) = &*IDLE;
        idle.lock().unwrap().push(self.0.clone());
        ended.notify_one();
        HAS_DEVICE.set(false);
        if !std::thread::panicking() {
            assert!(is_idle, "something outlives the test's device");
            assert!(messages.is_empty(), "{}", messages.join("\n"));
        }
    }
}
