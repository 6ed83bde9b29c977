//! Intel Open Image Denoise 2 behind a safe interface, loaded when it is asked for.
//!
//! It stands beside Embree since this folder holds all unsafe code.

use std::ffi::{CStr, c_char, c_int, c_void};
use std::path::{Path, PathBuf};
use std::ptr::null_mut;

use libloading::Library;

/// The library's name; the number is that of its interface.
const LIBRARY: &str = "libOpenImageDenoise.so.2";

/// `OIDN_DEVICE_TYPE_CPU`: the same library gives the same image on every machine
/// that has no other device.
const CPU: c_int = 1;

/// `OIDN_FORMAT_FLOAT3`.
const FLOAT3: c_int = 3;

/// Why an image can't be denoised.
#[derive(Debug, thiserror::Error)]
pub enum DenoiseError {
    /// The library is nowhere.
    #[error(
        "Open Image Denoise 2 ({LIBRARY}) was not found: `./setup.sh --with-denoiser` installs it, or OIDN_DIR names its folder ({0})"
    )]
    Missing(String),
    /// OIDN_DIR names a folder without it.
    #[error("OIDN_DIR is `{}`, but {LIBRARY} is neither there nor in its lib or lib64", .0.display())]
    NotInFolder(PathBuf),
    /// A library of that name lacks a function.
    #[error("{LIBRARY} is no Open Image Denoise 2: {0}")]
    Symbol(#[from] libloading::Error),
    /// The image has no such layer.
    #[error("the image has no layer `{0}` to denoise it by")]
    NoGuide(&'static str),
    /// An image or guide of another size.
    #[error("{name} has {found} pixels, the image {expected}")]
    Size {
        /// Which image.
        name: &'static str,
        /// Its pixels.
        found: usize,
        /// Width times height.
        expected: usize,
    },
    /// The library refused.
    #[error("Open Image Denoise: {0}")]
    Refused(String),
}

/// What an image is denoised with.
#[derive(Clone, Copy, Debug)]
pub struct Guides<'a> {
    /// Albedos of the first surfaces, 0 to 1.
    pub albedo: &'a [[f32; 3]],
    /// Their normals, components −1 to 1.
    pub normal: &'a [[f32; 3]],
}

/// The library's functions, from oidn.h of version 2.
struct Functions {
    new_device: unsafe extern "C" fn(c_int) -> *mut c_void,
    set_device_int: unsafe extern "C" fn(*mut c_void, *const c_char, c_int),
    commit_device: unsafe extern "C" fn(*mut c_void),
    device_error: unsafe extern "C" fn(*mut c_void, *mut *const c_char) -> c_int,
    release_device: unsafe extern "C" fn(*mut c_void),
    new_filter: unsafe extern "C" fn(*mut c_void, *const c_char) -> *mut c_void,
    set_image: unsafe extern "C" fn(
        *mut c_void,
        *const c_char,
        *mut c_void,
        c_int,
        usize,
        usize,
        usize,
        usize,
        usize,
    ),
    set_bool: unsafe extern "C" fn(*mut c_void, *const c_char, bool),
    commit_filter: unsafe extern "C" fn(*mut c_void),
    execute_filter: unsafe extern "C" fn(*mut c_void),
    release_filter: unsafe extern "C" fn(*mut c_void),
}

impl Functions {
    fn of(library: &Library) -> Result<Self, DenoiseError> {
        // SAFETY: the types are those of oidn.h, which version 2 keeps.
        unsafe {
            Ok(Self {
                new_device: *library.get(b"oidnNewDevice\0")?,
                set_device_int: *library.get(b"oidnSetDeviceInt\0")?,
                commit_device: *library.get(b"oidnCommitDevice\0")?,
                device_error: *library.get(b"oidnGetDeviceError\0")?,
                release_device: *library.get(b"oidnReleaseDevice\0")?,
                new_filter: *library.get(b"oidnNewFilter\0")?,
                set_image: *library.get(b"oidnSetSharedFilterImage\0")?,
                set_bool: *library.get(b"oidnSetFilterBool\0")?,
                commit_filter: *library.get(b"oidnCommitFilter\0")?,
                execute_filter: *library.get(b"oidnExecuteFilter\0")?,
                release_filter: *library.get(b"oidnReleaseFilter\0")?,
            })
        }
    }
}

/// An open denoiser, on the processor.
pub struct Denoiser {
    device: *mut c_void,
    functions: Functions,
    /// Keeps the functions' code; dropped last.
    _library: Library,
}

impl Denoiser {
    /// Opens the library where it is found first: in `$OIDN_DIR` (and nowhere else, if
    /// that is set), beside the program, where `setup.sh` puts it, where the system
    /// looks. Works with at most `threads` threads (0: all).
    ///
    /// # Errors
    /// When it is not there, or is another library.
    pub fn open(threads: usize) -> Result<Self, DenoiseError> {
        let library = load()?;
        let functions = Functions::of(&library)?;
        // SAFETY: a device of this type may be asked for anywhere.
        let device = unsafe { (functions.new_device)(CPU) };
        let denoiser = Self {
            device,
            functions,
            _library: library,
        };
        if device.is_null() {
            return Err(denoiser.refusal("no device"));
        }
        let threads = c_int::try_from(threads).unwrap_or(0);
        // SAFETY: the device is open, and the name ends with a NUL.
        unsafe {
            (denoiser.functions.set_device_int)(device, c"numThreads".as_ptr(), threads);
            (denoiser.functions.commit_device)(device);
        }
        denoiser.check()?;
        Ok(denoiser)
    }

    /// Denoises a scene-linear image of this width and height, row by row, by what its
    /// pixels show.
    ///
    /// # Errors
    /// When an image has another number of pixels, or the library refuses.
    pub fn denoise(
        &self,
        color: &[[f32; 3]],
        [width, height]: [usize; 2],
        guides: Guides<'_>,
    ) -> Result<Vec<[f32; 3]>, DenoiseError> {
        let Guides { albedo, normal } = guides;
        let expected = width * height;
        let inputs = [("color", color), ("albedo", albedo), ("normal", normal)];
        for (name, pixels) in inputs {
            if pixels.len() != expected {
                let found = pixels.len();
                return Err(DenoiseError::Size {
                    name,
                    found,
                    expected,
                });
            }
        }
        let mut output = vec![[0.0; 3]; expected];
        if expected == 0 {
            return Ok(output);
        }
        let f = &self.functions;
        // SAFETY: the device is open; all names end with NULs; the four images are of
        // width × height × 3 floats and live until the filter is released, and only the
        // output is written to.
        unsafe {
            let filter = (f.new_filter)(self.device, c"RT".as_ptr());
            if filter.is_null() {
                return Err(self.refusal("no filter"));
            }
            let image = |name: &CStr, pixels: *mut c_void| {
                (f.set_image)(
                    filter,
                    name.as_ptr(),
                    pixels,
                    FLOAT3,
                    width,
                    height,
                    0,
                    0,
                    0,
                );
            };
            let names = [c"color", c"albedo", c"normal"];
            for (name, (_, pixels)) in names.into_iter().zip(inputs) {
                image(name, pixels.as_ptr().cast_mut().cast());
            }
            image(c"output", output.as_mut_ptr().cast());
            (f.set_bool)(filter, c"hdr".as_ptr(), true);
            (f.commit_filter)(filter);
            (f.execute_filter)(filter);
            (f.release_filter)(filter);
        }
        self.check()?;
        Ok(output)
    }

    /// The first error since this was last asked.
    fn check(&self) -> Result<(), DenoiseError> {
        let mut message = null_mut::<c_char>().cast_const();
        // SAFETY: a null device stands for the errors of this thread.
        let code = unsafe { (self.functions.device_error)(self.device, &raw mut message) };
        if code == 0 {
            return Ok(());
        }
        if message.is_null() {
            return Err(DenoiseError::Refused(format!("error {code}")));
        }
        // SAFETY: the library's strings end with a NUL and live until the next call.
        let message = unsafe { CStr::from_ptr(message) };
        Err(DenoiseError::Refused(message.to_string_lossy().into()))
    }

    fn refusal(&self, what: &str) -> DenoiseError {
        let said = self.check().err();
        said.unwrap_or_else(|| DenoiseError::Refused(what.to_owned()))
    }
}

impl Drop for Denoiser {
    fn drop(&mut self) {
        if !self.device.is_null() {
            // SAFETY: the device is open, and no filter of it is left.
            unsafe { (self.functions.release_device)(self.device) };
        }
    }
}

/// Finds and loads the library.
fn load() -> Result<Library, DenoiseError> {
    // SAFETY: the library's initialisers set up tables of its own.
    let open = |path: &Path| unsafe { Library::new(path) };
    if let Some(folder) = std::env::var_os("OIDN_DIR").filter(|folder| !folder.is_empty()) {
        let folder = PathBuf::from(folder);
        let places = ["lib", "lib64", ""].map(|place| folder.join(place).join(LIBRARY));
        let found = places.iter().find(|path| path.exists());
        return match found {
            Some(path) => Ok(open(path)?),
            None => Err(DenoiseError::NotInFolder(folder)),
        };
    }
    let beside = std::env::current_exe().ok();
    let beside = beside.as_deref().and_then(Path::parent);
    let ours = Path::new(env!("CARGO_MANIFEST_DIR")).join(".deps/oidn/lib");
    for folder in beside.into_iter().chain([ours.as_path()]) {
        let path = folder.join(LIBRARY);
        if path.exists() {
            return Ok(open(&path)?);
        }
    }
    open(Path::new(LIBRARY)).map_err(|error| DenoiseError::Missing(error.to_string()))
}
