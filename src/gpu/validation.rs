//! The validation layers' messages, collected per context; any message is a failure.

use ash::vk;
use std::ffi::{CStr, c_void};
use std::sync::Mutex;

/// Messages that are the layers' own shortcomings, not ours: (id or text, reason).
const ALLOWED: &[(&str, &str)] = &[(
    "UNASSIGNED-CoreValidation-DrawState-InvalidImageLayout: Validation Performance Warning",
    "images stay in layout GENERAL, so that barriers need only stages; layouts cost nothing where \
     that matters here",
)];

/// What the layers say, from making the instance to its end.
#[derive(Debug, Default)]
pub struct Messages(Mutex<Vec<String>>);

impl Messages {
    /// Everything said so far that is not on the allow-list.
    pub fn all(&self) -> Vec<String> {
        self.0.lock().expect("no panic while held").clone()
    }

    /// Everything said since the last call.
    pub fn take(&self) -> Vec<String> {
        std::mem::take(&mut self.0.lock().expect("no panic while held"))
    }

    /// Create-info for a messenger that writes here; `self` must outlive the messenger.
    pub(super) fn messenger_info(&self) -> vk::DebugUtilsMessengerCreateInfoEXT<'_> {
        use vk::{
            DebugUtilsMessageSeverityFlagsEXT as Severity, DebugUtilsMessageTypeFlagsEXT as Type,
        };
        vk::DebugUtilsMessengerCreateInfoEXT::default()
            .message_severity(Severity::ERROR | Severity::WARNING)
            .message_type(Type::VALIDATION | Type::PERFORMANCE | Type::GENERAL)
            .pfn_user_callback(Some(collect))
            .user_data(std::ptr::from_ref(self).cast_mut().cast())
    }
}

/// Called by the layers, from any thread.
unsafe extern "system" fn collect(
    _severity: vk::DebugUtilsMessageSeverityFlagsEXT,
    kind: vk::DebugUtilsMessageTypeFlagsEXT,
    data: *const vk::DebugUtilsMessengerCallbackDataEXT<'_>,
    user: *mut c_void,
) -> vk::Bool32 {
    // Messages of the loader about drivers it cannot open are none of a pass's business.
    if kind == vk::DebugUtilsMessageTypeFlagsEXT::GENERAL {
        return vk::FALSE;
    }
    // SAFETY: the specification promises valid data; `user` is the Messages of `messenger_info`.
    let (data, messages) = unsafe { (&*data, &*user.cast::<Messages>()) };
    let text = |pointer: *const std::ffi::c_char| {
        if pointer.is_null() {
            String::new()
        } else {
            // SAFETY: not null, and the specification promises a C string.
            unsafe { CStr::from_ptr(pointer) }
                .to_string_lossy()
                .into_owned()
        }
    };
    let message = format!("{}: {}", text(data.p_message_id_name), text(data.p_message));
    let allowed = ALLOWED.iter().any(|(pattern, _)| message.contains(pattern));
    if !allowed && let Ok(mut list) = messages.0.lock() {
        list.push(message);
    }
    vk::FALSE
}
