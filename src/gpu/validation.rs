//! The validation layers' messages, collected per context; any message is a failure.

use ash::vk;
use std::ffi::{CStr, c_void};
use std::sync::Mutex;

/// Messages about the layers' own shortcomings, or about a choice of ours: (id, part of the text,
/// reason). The id alone is too wide: some ids stand for many messages.
const ALLOWED: &[(&str, &str, &str)] = &[
    (
        "UNASSIGNED-CoreValidation-DrawState-InvalidImageLayout",
        "Validation Performance Warning",
        "images stay in layout GENERAL, so that barriers need only stages; layouts cost nothing \
         where that matters here",
    ),
    (
        "UNASSIGNED-GPU-Assisted Validation Warning",
        "shaderInt64 feature is not available.  No buffer device address checking",
        "the layer names a check that it leaves out on devices without shaderInt64, such as \
         SwiftShader; no shader here uses buffer device addresses",
    ),
];

fn is_allowed(id: &str, text: &str) -> bool {
    (ALLOWED.iter()).any(|(allowed, part, _)| *allowed == id && text.contains(part))
}

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

    /// Create-info for a messenger that writes here, also of a host; `self` must outlive the messenger.
    pub fn messenger_info(&self) -> vk::DebugUtilsMessengerCreateInfoEXT<'_> {
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
    let (id, text) = (text(data.p_message_id_name), text(data.p_message));
    if !is_allowed(&id, &text)
        && let Ok(mut list) = messages.0.lock()
    {
        list.push(format!("{id}: {text}"));
    }
    vk::FALSE
}

#[cfg(test)]
mod tests {
    use super::is_allowed;

    /// The other messages of an id on the list are still heard, and so is its text under another.
    #[test]
    fn the_allow_list_is_narrow() {
        let id = "UNASSIGNED-GPU-Assisted Validation Warning";
        let text = |feature: &str, check: &str| {
            format!(
                "Validation Warning: [ {id} ] | {feature} feature is not available.  No {check}"
            )
        };
        let known = text(
            "shaderInt64",
            "buffer device address checking will be attempted",
        );
        assert!(is_allowed(id, &known));
        assert!(!is_allowed(
            "UNASSIGNED-GPU-Assisted Validation Error",
            &known
        ));
        assert!(!is_allowed(id, &text("shaderInt64", "checking")));
        assert!(!is_allowed(
            id,
            &text("robustBufferAccess", "bounds checking")
        ));
    }
}
