//! The Embree device: opening the library and checking that it is one we know.

use std::ffi::{CStr, CString, c_char, c_void};
use std::sync::Mutex;

use embree4_sys as sys;

/// The oldest and the first too new version, as Embree encodes them
/// (major · 10 000 + minor · 100 + patch). Below 4.3 the hit record has another
/// layout, and 5 is unknown.
const SUPPORTED: std::ops::Range<isize> = 40_300..50_000;

/// What can go wrong between this crate and Embree.
#[derive(Debug, thiserror::Error)]
pub enum EmbreeError {
    /// The library that was loaded is too old or too new.
    #[error("Embree {major}.{minor}.{patch} was loaded, but 4.3 or newer and below 5 is needed; ./setup.sh installs one", major = .0 / 10_000, minor = .0 / 100 % 100, patch = .0 % 100)]
    Version(isize),
    /// Embree refused to open a device, for example for want of SSE2.
    #[error("Embree could not open a device ({0})")]
    Open(String),
    /// Embree reported an error while building.
    #[error("Embree could not build the scene: {0}")]
    Build(String),
    /// A triangle names a vertex that is not there.
    #[error("triangle {triangle} names vertex {index}, but the mesh has {vertices} vertices")]
    IndexOutOfRange {
        /// Position of the triangle in its mesh, from 0.
        triangle: usize,
        /// The vertex it names.
        index: u32,
        /// How many vertices the mesh has.
        vertices: usize,
    },
    /// An instance names a mesh that is not there.
    #[error("an instance names mesh {index} of {meshes}")]
    NoSuchMesh {
        /// The mesh it names.
        index: usize,
        /// How many meshes there are.
        meshes: usize,
    },
}

/// An open Embree device. Cheap to share; scenes keep it alive by themselves.
#[derive(Debug)]
pub struct Device {
    raw: sys::RTCDevice,
    /// The first message Embree sent since it was last taken. Boxed: Embree
    /// holds its address.
    message: Box<Mutex<Option<String>>>,
}

// SAFETY: Embree documents its device and scene functions as thread safe; the
// message is behind a mutex.
unsafe impl Send for Device {}
// SAFETY: as above.
unsafe impl Sync for Device {}

impl Device {
    /// Opens a device that builds with at most `threads` threads (0: all).
    ///
    /// # Errors
    /// When the library is no Embree ≥ 4.3 and < 5, or refuses to start.
    pub fn new(threads: usize) -> Result<Self, EmbreeError> {
        let config = if threads == 0 {
            String::new()
        } else {
            format!("threads={threads}")
        };
        let config = CString::new(config).expect("digits and letters alone");
        // SAFETY: the string ends with a NUL and outlives the call.
        let raw = unsafe { sys::rtcNewDevice(config.as_ptr()) };
        if raw.is_null() {
            // SAFETY: a null device asks for the error of the thread's last rtcNewDevice.
            let code = unsafe { sys::rtcGetDeviceError(std::ptr::null_mut()) };
            return Err(EmbreeError::Open(format!("{code:?}")));
        }
        let device = Self {
            raw,
            message: Box::new(Mutex::new(None)),
        };
        let version = device.version();
        if !SUPPORTED.contains(&version) {
            return Err(EmbreeError::Version(version));
        }
        let user = std::ptr::from_ref::<Mutex<Option<String>>>(&device.message);
        // SAFETY: `user` points into a box that lives as long as the device.
        unsafe { sys::rtcSetDeviceErrorFunction(raw, Some(on_error), user.cast_mut().cast()) };
        Ok(device)
    }

    /// The library's version: major · 10 000 + minor · 100 + patch.
    #[must_use]
    pub fn version(&self) -> isize {
        // SAFETY: the device is valid while `self` lives.
        unsafe { sys::rtcGetDeviceProperty(self.raw, sys::RTCDeviceProperty::VERSION) }
    }

    pub(super) fn raw(&self) -> sys::RTCDevice {
        self.raw
    }

    /// Turns a message that Embree sent since the last check into an error.
    pub(super) fn check(&self) -> Result<(), EmbreeError> {
        let mut slot = self
            .message
            .lock()
            .unwrap_or_else(std::sync::PoisonError::into_inner);
        slot.take()
            .map_or(Ok(()), |text| Err(EmbreeError::Build(text)))
    }
}

impl Drop for Device {
    fn drop(&mut self) {
        // Scenes may keep the device alive in Embree; they must not call into a freed box.
        // SAFETY: the device is valid, and a missing function stops the callbacks.
        unsafe {
            sys::rtcSetDeviceErrorFunction(self.raw, None, std::ptr::null_mut());
            sys::rtcReleaseDevice(self.raw);
        }
    }
}

unsafe extern "C" fn on_error(user: *mut c_void, code: sys::RTCError, text: *const c_char) {
    if user.is_null() {
        return;
    }
    // SAFETY: `user` is the mutex that `Device::new` passed, alive while the device is.
    let slot = unsafe { &*user.cast::<Mutex<Option<String>>>() };
    let text = if text.is_null() {
        String::new()
    } else {
        // SAFETY: Embree passes a NUL-terminated string.
        unsafe { CStr::from_ptr(text) }
            .to_string_lossy()
            .into_owned()
    };
    if let Ok(mut slot) = slot.lock() {
        slot.get_or_insert(format!("{text} ({code:?})"));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn opens_a_supported_version() {
        let device = Device::new(1).expect("Embree is installed");
        assert!(
            SUPPORTED.contains(&device.version()),
            "{}",
            device.version()
        );
    }

    #[test]
    fn a_wrong_version_is_named_in_the_error() {
        assert!(
            EmbreeError::Version(31_302)
                .to_string()
                .contains("Embree 3.13.2 was loaded")
        );
    }
}
