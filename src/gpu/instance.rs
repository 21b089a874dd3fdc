//! The Vulkan instance, with the layers' messenger where they are on.

use super::device_error;
use super::validation::Messages;
use crate::error::{Error, Result};
use ash::{ext, vk};
use std::ffi::{CStr, c_char};
use std::ops::Deref;
use std::sync::Arc;

pub const INSTALL_DRIVER: &str = "install a Vulkan driver for your GPU, or the software renderer lavapipe \
     (Debian and Ubuntu: apt-get install libvulkan1 mesa-vulkan-drivers)";

const LAYER: &CStr = c"VK_LAYER_KHRONOS_validation";

pub fn no_device(reason: impl Into<String>, remedy: &str) -> Error {
    Error::NoDevice {
        reason: reason.into(),
        remedy: remedy.into(),
    }
}

/// One of ours destroys itself, after everything that was made from it; a host's does not.
pub struct Instance {
    functions: ash::Instance,
    is_ours: bool,
    messenger: Option<(ext::debug_utils::Instance, vk::DebugUtilsMessengerEXT)>,
    /// Whether objects can be named and passes labelled.
    pub debug_utils: bool,
    /// The layers write here, the last time while the instance goes.
    pub messages: Arc<Messages>,
    _entry: ash::Entry,
}

impl Deref for Instance {
    type Target = ash::Instance;

    fn deref(&self) -> &ash::Instance {
        &self.functions
    }
}

impl Instance {
    /// An instance, with the validation layers if asked for.
    ///
    /// # Errors
    /// [`Error::NoDevice`] where the loader, a driver or the layers are missing.
    pub fn new(validate: bool) -> Result<Self> {
        let entry = load_entry()?;
        let layers: Vec<*const c_char> = if validate {
            check_layer(&entry)?;
            vec![LAYER.as_ptr()]
        } else {
            Vec::new()
        };
        // SAFETY: a plain query.
        let extensions = unsafe { entry.enumerate_instance_extension_properties(None) }
            .map_err(device_error("listing the instance extensions"))?;
        // The layers bring the extension where the loader has not.
        let debug_utils = validate
            || extensions
                .iter()
                .any(|e| e.extension_name_as_c_str() == Ok(ext::debug_utils::NAME));
        let mut names = Vec::new();
        if debug_utils {
            names.push(ext::debug_utils::NAME.as_ptr());
        }

        let messages = Arc::<Messages>::default();
        let application = vk::ApplicationInfo::default()
            .application_name(c"nephroid")
            .api_version(vk::API_VERSION_1_3);
        let enabled = [
            vk::ValidationFeatureEnableEXT::SYNCHRONIZATION_VALIDATION,
            vk::ValidationFeatureEnableEXT::GPU_ASSISTED,
            vk::ValidationFeatureEnableEXT::GPU_ASSISTED_RESERVE_BINDING_SLOT,
        ];
        let mut features =
            vk::ValidationFeaturesEXT::default().enabled_validation_features(&enabled);
        // Chained, it hears what creating and destroying the instance itself gives rise to.
        let mut chained = messages.messenger_info();
        let mut info = vk::InstanceCreateInfo::default()
            .application_info(&application)
            .enabled_layer_names(&layers)
            .enabled_extension_names(&names);
        if validate {
            info = info.push_next(&mut features).push_next(&mut chained);
        }
        // SAFETY: everything the create-info points to lives until the call returns, and
        // `messages` until the instance is gone.
        let functions = unsafe { entry.create_instance(&info, None) }
            .map_err(|error| no_device(format!("no Vulkan instance: {error}"), INSTALL_DRIVER))?;
        let mut instance = Self {
            functions,
            is_ours: true,
            messenger: None,
            debug_utils,
            messages,
            _entry: entry,
        };
        if validate {
            let utils = ext::debug_utils::Instance::new(&instance._entry, &instance.functions);
            let info = instance.messages.messenger_info();
            // SAFETY: the extension is enabled; Drop destroys the messenger before `messages`.
            let handle = unsafe { utils.create_debug_utils_messenger(&info, None) }
                .map_err(device_error("listening to the layers"))?;
            instance.messenger = Some((utils, handle));
        }
        Ok(instance)
    }

    /// That of a host. Its objects are not named, as it may lack the extension, and its messages are its own.
    pub fn of_host(entry: ash::Entry, functions: ash::Instance) -> Self {
        Self {
            functions,
            is_ours: false,
            messenger: None,
            debug_utils: false,
            messages: Arc::default(),
            _entry: entry,
        }
    }
}

impl Drop for Instance {
    fn drop(&mut self) {
        if !self.is_ours {
            return;
        }
        // SAFETY: nothing made from the instance is left; the reverse of creation.
        unsafe {
            if let Some((utils, messenger)) = self.messenger.take() {
                utils.destroy_debug_utils_messenger(messenger, None);
            }
            self.functions.destroy_instance(None);
        }
    }
}

fn load_entry() -> Result<ash::Entry> {
    // SAFETY: loading the system's Vulkan loader runs its initialisers, which we must trust.
    let entry = unsafe { ash::Entry::load() }.map_err(|error| {
        no_device(
            format!("the Vulkan loader cannot be loaded: {error}"),
            INSTALL_DRIVER,
        )
    })?;
    // SAFETY: a plain query.
    let version = unsafe { entry.try_enumerate_instance_version() }
        .map_err(device_error("asking for the instance version"))?
        .unwrap_or(vk::API_VERSION_1_0);
    if version < vk::API_VERSION_1_3 {
        return Err(no_device(
            "the Vulkan loader is older than 1.3",
            "update the Vulkan loader",
        ));
    }
    Ok(entry)
}

fn check_layer(entry: &ash::Entry) -> Result<()> {
    // SAFETY: a plain query.
    let available = unsafe { entry.enumerate_instance_layer_properties() }
        .map_err(device_error("listing the layers"))?;
    if available
        .iter()
        .any(|layer| layer.layer_name_as_c_str() == Ok(LAYER))
    {
        return Ok(());
    }
    Err(no_device(
        "the validation layer VK_LAYER_KHRONOS_validation is not installed",
        "install it (Debian and Ubuntu: apt-get install vulkan-validationlayers) or run without the layer",
    ))
}
