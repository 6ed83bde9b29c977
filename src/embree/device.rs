//! The Embree device: opening the library and checking that it is one we know.

use std::ffi::{CStr, CString, c_char, c_void};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Mutex, PoisonError};

use embree4_sys as sys;

use crate::memory::Bytes;

/// `rtcSetDeviceErrorFunction` calls this with an error code. A plain number:
/// newer libraries know more codes than the bindings' enum, and a Rust enum of
/// another value would be undefined behaviour.
type ErrorFunction = unsafe extern "C" fn(*mut c_void, u32, *const c_char);

unsafe extern "C" {
    fn rtcGetDeviceError(device: sys::RTCDevice) -> u32;
    fn rtcSetDeviceErrorFunction(
        device: sys::RTCDevice,
        function: Option<ErrorFunction>,
        user: *mut c_void,
    );
}

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
    /// The acceleration structures need more memory than there is for them.
    #[error(
        "Embree's acceleration structures need more than the {0} that are left; --memory sets the limit"
    )]
    Memory(Bytes),
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
    /// Boxed: Embree holds its address.
    watch: Box<Watch>,
}

/// What Embree tells while it works.
#[derive(Debug)]
struct Watch {
    /// The first message since it was last taken.
    message: Mutex<Option<String>>,
    /// Bytes that Embree holds, and the most that it may.
    bytes: AtomicU64,
    limit: u64,
}

// SAFETY: Embree documents its device and scene functions as thread safe; what
// it tells is behind a mutex and atomics.
unsafe impl Send for Device {}
// SAFETY: as above.
unsafe impl Sync for Device {}

/// The family of instructions that Embree's code is of on this processor. It has code
/// of its own for each, and hits differ in their last bits; so it is held to AVX2, which
/// all x86 processors since 2013 to 2015 have.
#[must_use]
pub fn instructions() -> &'static str {
    #[cfg(target_arch = "x86_64")]
    {
        if std::arch::is_x86_feature_detected!("avx2") {
            return AVX2;
        } else if std::arch::is_x86_feature_detected!("avx") {
            return "AVX";
        }
    }
    std::env::consts::ARCH
}

const AVX2: &str = "AVX2";

impl Device {
    /// Opens a device that builds with at most `threads` threads (0: all).
    ///
    /// # Errors
    /// When the library is no Embree ≥ 4.3 and < 5, or refuses to start.
    pub fn new(threads: usize) -> Result<Self, EmbreeError> {
        Self::with_limit(threads, u64::MAX)
    }

    /// As [`Device::new`], and holds at most `limit` bytes of memory.
    ///
    /// # Errors
    /// As [`Device::new`].
    pub fn with_limit(threads: usize, limit: u64) -> Result<Self, EmbreeError> {
        let held = if instructions() == AVX2 {
            ",isa=avx2"
        } else {
            ""
        };
        let config = format!("threads={threads}{held}");
        let config = CString::new(config).expect("digits and letters alone");
        // SAFETY: the string ends with a NUL and outlives the call.
        let raw = unsafe { sys::rtcNewDevice(config.as_ptr()) };
        if raw.is_null() {
            // SAFETY: a null device asks for the error of the thread's last rtcNewDevice.
            let code = unsafe { rtcGetDeviceError(std::ptr::null_mut()) };
            return Err(EmbreeError::Open(name(code)));
        }
        let device = Self {
            raw,
            watch: Box::new(Watch {
                message: Mutex::new(None),
                bytes: AtomicU64::new(0),
                limit,
            }),
        };
        let version = device.version();
        if !SUPPORTED.contains(&version) {
            return Err(EmbreeError::Version(version));
        }
        let user = std::ptr::from_ref::<Watch>(&device.watch).cast_mut().cast();
        // SAFETY: `user` points into a box that lives as long as the device.
        unsafe {
            rtcSetDeviceErrorFunction(raw, Some(on_error), user);
            sys::rtcSetDeviceMemoryMonitorFunction(raw, Some(on_memory), user);
        }
        Ok(device)
    }

    /// The bytes that the device's scenes hold, the buffers that they share with
    /// us not counted.
    #[must_use]
    pub fn memory(&self) -> u64 {
        self.watch.bytes.load(Ordering::Relaxed)
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
            .watch
            .message
            .lock()
            .unwrap_or_else(PoisonError::into_inner);
        match slot.take() {
            None => Ok(()),
            Some(text) if text.contains(REFUSED_BY_US) => {
                let left = self.watch.limit.saturating_sub(self.memory());
                Err(EmbreeError::Memory(Bytes(left)))
            }
            Some(text) => Err(EmbreeError::Build(text)),
        }
    }
}

impl Drop for Device {
    fn drop(&mut self) {
        // Scenes may keep the device alive in Embree; they must not call into a freed box.
        // SAFETY: the device is valid, and missing functions stop the callbacks.
        unsafe {
            rtcSetDeviceErrorFunction(self.raw, None, std::ptr::null_mut());
            sys::rtcSetDeviceMemoryMonitorFunction(self.raw, None, std::ptr::null_mut());
            sys::rtcReleaseDevice(self.raw);
        }
    }
}

/// What Embree says when [`on_memory`] refuses.
const REFUSED_BY_US: &str = "memory monitor";

/// The name of an error code (`RTCError` of `rtcore_device.h`).
fn name(code: u32) -> String {
    let name = match code {
        1 => "unknown error",
        2 => "invalid argument",
        3 => "invalid operation",
        4 => "out of memory",
        5 => "unsupported processor",
        6 => "cancelled",
        _ => return format!("error {code}"),
    };
    name.to_owned()
}

unsafe extern "C" fn on_error(user: *mut c_void, code: u32, text: *const c_char) {
    if user.is_null() {
        return;
    }
    // SAFETY: `user` is what `Device::new` passed, alive while the device is.
    let watch = unsafe { &*user.cast::<Watch>() };
    let text = if text.is_null() {
        String::new()
    } else {
        // SAFETY: Embree passes a NUL-terminated string.
        unsafe { CStr::from_ptr(text) }
            .to_string_lossy()
            .into_owned()
    };
    if let Ok(mut slot) = watch.message.lock() {
        slot.get_or_insert(format!("{text} ({})", name(code)));
    }
}

/// Embree asks before it takes memory, and tells after it has given some back.
unsafe extern "C" fn on_memory(user: *mut c_void, bytes: isize, _: bool) -> bool {
    if user.is_null() {
        return true;
    }
    // SAFETY: `user` is what `Device::new` passed, alive while the device is.
    let watch = unsafe { &*user.cast::<Watch>() };
    let change = bytes.unsigned_abs() as u64;
    let counted = watch
        .bytes
        .fetch_update(Ordering::Relaxed, Ordering::Relaxed, |held| {
            if bytes < 0 {
                Some(held.saturating_sub(change))
            } else {
                held.checked_add(change).filter(|&sum| sum <= watch.limit)
            }
        });
    counted.is_ok()
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
    fn codes_that_the_bindings_do_not_know_are_numbers() {
        assert_eq!(name(4), "out of memory");
        assert_eq!(name(7), "error 7");
        let device = Device::new(1).expect("Embree is installed");
        let user = std::ptr::from_ref::<Watch>(&device.watch).cast_mut().cast();
        // SAFETY: as Embree calls it.
        unsafe { on_error(user, 7, c"no such level".as_ptr()) };
        let error = device.check().expect_err("there was an error");
        let said = "Embree could not build the scene: no such level (error 7)";
        assert_eq!(error.to_string(), said);
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
