//! Image files and saved films, through the file system.

use std::path::PathBuf;

use smithwalk::film::{Aov, AovSet, Film, ResumeError, Sample, sidecar_path};
use smithwalk::image::{OutputError, OutputPath, Window, read_exr};
use smithwalk::sampler::{Dimension, Sampler};

/// A folder of its own for each test, removed at the end.
struct Folder(PathBuf);

impl Folder {
    fn new(name: &str) -> Self {
        let name = format!("smithwalk-film-{name}-{}", std::process::id());
        let path = std::env::temp_dir().join(name);
        std::fs::create_dir_all(&path).unwrap();
        Self(path)
    }

    fn file(&self, name: &str) -> PathBuf {
        self.0.join(name)
    }

    fn names(&self) -> Vec<String> {
        let entries = std::fs::read_dir(&self.0).unwrap();
        let name = |entry: std::io::Result<std::fs::DirEntry>| entry.unwrap().file_name();
        entries.map(|e| name(e).into_string().unwrap()).collect()
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

const RESOLUTION: [u32; 2] = [45, 30];
const CROP: Window = Window {
    x: 7,
    y: 3,
    width: 33,
    height: 21,
};

fn film() -> Film {
    Film::new(RESOLUTION, CROP, Aov::ALL.into_iter().collect())
}

/// Adds samples `from..to` of every pixel, some of them faulty.
fn expose(film: &mut Film, from: u32, to: u32) {
    for tile in film.tiles_mut() {
        for pixel in tile.window().pixels() {
            for index in from..to {
                assert_eq!(tile.samples(pixel), index);
                let mut sampler = Sampler::new(5, pixel, index);
                let u = sampler.get_4d(Dimension::bsdf(0));
                let fault = u[3] < 0.01;
                let sample = Sample {
                    color: [u[0], if fault { f32::NAN } else { u[1] }, 1e4 * u[2]],
                    albedo: [u[0], 0.5, 0.25],
                    normal: [u[0] - 0.5, 0.0, 1.0],
                    depth: (u[3] > 0.5).then_some(10.0 * u[3]),
                    single: [u[0] * 0.5; 3],
                    multiple: [u[1] * 0.5; 3],
                };
                tile.add(pixel, &[sample]);
            }
        }
    }
}

#[test]
fn an_exr_comes_back_bit_by_bit() {
    let folder = Folder::new("exr");
    let mut film = film();
    expose(&mut film, 0, 5);
    let mut image = film.develop();
    image.attributes = vec![
        ("smithwalk.scene".into(), "Grünspan.yaml".into()),
        ("smithwalk.seed".into(), u64::MAX.to_string()),
    ];
    let path = folder.file("image.exr");
    let output = OutputPath::new(&path).unwrap();
    output.check().unwrap();
    output.write(&image, 0.0).unwrap();
    let back = read_exr(&path).unwrap();
    assert_eq!(back.resolution, RESOLUTION);
    assert_eq!(back.window, CROP);
    assert!(back.color == image.color);
    assert_eq!(back.attributes, image.attributes);
    assert_eq!(back.layers.len(), Aov::ALL.len());
    for layer in &image.layers {
        let read = back.layer(&layer.name).unwrap();
        assert_eq!(read.planes.len(), layer.planes.len());
        for (channel, plane) in layer.channels.iter().zip(&layer.planes) {
            let name = &layer.name;
            assert!(read.channel(channel) == Some(plane), "{name}.{channel}");
        }
    }
    assert_eq!(folder.names(), ["image.exr"], "no leftovers");
}

#[test]
fn a_png_has_the_size_of_the_window() {
    let folder = Folder::new("png");
    let path = folder.file("image.PNG");
    let mut image = film().develop();
    image.color[0] = [1.0, 0.214_041_14, 0.0];
    OutputPath::new(&path).unwrap().write(&image, 0.0).unwrap();
    let bytes = std::fs::read(&path).unwrap();
    let png = image::load_from_memory(&bytes).unwrap().into_rgb8();
    assert_eq!(png.dimensions(), (CROP.width, CROP.height));
    assert_eq!(png.get_pixel(0, 0).0, [255, 128, 0]);
}

#[test]
fn a_resumed_film_equals_an_uninterrupted_one() {
    let folder = Folder::new("resume");
    let path = sidecar_path(&folder.file("image.exr"));
    assert!(path.ends_with("image.exr.film"));

    let mut first = film();
    expose(&mut first, 0, 3);
    first.save(&path, 42).unwrap();
    let mut resumed = film();
    resumed.resume(&path, 42).unwrap();
    assert!(resumed == first, "saving changed the film");
    assert_eq!(resumed.samples_per_pixel(), 3);
    expose(&mut resumed, 3, 8);

    let mut whole = film();
    expose(&mut whole, 0, 8);
    assert!(resumed == whole, "resuming changed the film");
    assert!(!whole.faults().is_empty(), "faults are part of the test");
    assert_eq!(resumed.relative_error(), whole.relative_error());
}

#[test]
fn a_film_of_another_render_is_refused() {
    let folder = Folder::new("refuse");
    let path = folder.file("image.exr.film");
    let mut saved = film();
    expose(&mut saved, 0, 2);
    saved.save(&path, 42).unwrap();

    let differs = |film: &mut Film, fingerprint| {
        let before = film.clone();
        let error = film.resume(&path, fingerprint).unwrap_err();
        assert!(*film == before, "an error leaves the film alone");
        assert!(matches!(error, ResumeError::OtherRender { .. }), "{error}");
        error.to_string()
    };
    assert!(differs(&mut film(), 43).contains("another scene"));
    let mut full = Film::new(RESOLUTION, Window::full(RESOLUTION), film().aovs());
    assert!(differs(&mut full, 42).contains("another resolution or crop"));
    let mut plain = Film::new(RESOLUTION, CROP, AovSet::NONE);
    assert!(differs(&mut plain, 42).contains("other AOVs"));

    // Every truncation and a flip of any bit in a sample of them is noticed.
    let good = std::fs::read(&path).unwrap();
    let refused = |bytes: &[u8]| {
        std::fs::write(&path, bytes).unwrap();
        film().resume(&path, 42).is_err()
    };
    for length in (0..good.len()).step_by(997) {
        assert!(refused(&good[..length]), "cut to {length} bytes");
    }
    for position in (0..good.len()).step_by(1009) {
        let mut bytes = good.clone();
        bytes[position] ^= 1 << (position % 8);
        assert!(refused(&bytes), "bit flipped in byte {position}");
    }
    assert!(!refused(&good));
}

#[test]
fn unusable_outputs_are_found_beforehand() {
    let folder = Folder::new("outputs");
    let check = |path: PathBuf| OutputPath::new(path).unwrap().check();
    for name in ["image", "image.jpg", "image.exr.film", ".exr"] {
        let error = OutputPath::new(folder.file(name)).unwrap_err();
        assert!(matches!(error, OutputError::Extension(_)), "{error}");
    }
    check(folder.file("new/folder/image.exr")).unwrap();
    assert!(folder.file("new/folder").is_dir());

    let error = check(folder.file("new/folder/../../new.exr/a.png"));
    error.unwrap();
    let error = check(folder.file("new.exr")).unwrap_err();
    assert!(matches!(error, OutputError::IsFolder(_)), "{error}");

    // A file where a folder is needed stops root as well.
    std::fs::write(folder.file("file"), "").unwrap();
    let error = check(folder.file("file/image.exr")).unwrap_err();
    assert!(matches!(error, OutputError::Folder { .. }), "{error}");
    assert!(error.to_string().contains("file"), "{error}");
}

#[test]
fn a_failed_write_keeps_the_older_file() {
    let folder = Folder::new("keep");
    let path = folder.file("image.exr");
    let output = OutputPath::new(&path).unwrap();
    let mut image = film().develop();
    output.write(&image, 0.0).unwrap();
    let before = std::fs::read(&path).unwrap();
    // Two channels of one name: the encoder refuses.
    let twin = image.layers[0].clone();
    image.layers.push(twin);
    let error = output.write(&image, 0.0).unwrap_err();
    assert!(matches!(error, OutputError::Write { .. }), "{error}");
    assert_eq!(std::fs::read(&path).unwrap(), before);
    assert_eq!(folder.names(), ["image.exr"], "no leftovers");
}

#[test]
fn files_that_are_no_images_give_errors() {
    let folder = Folder::new("broken");
    let path = folder.file("image.exr");
    let missing = read_exr(&path).unwrap_err().to_string();
    assert!(missing.contains("can't read"), "{missing}");

    OutputPath::new(&path)
        .unwrap()
        .write(&film().develop(), 0.0)
        .unwrap();
    let good = std::fs::read(&path).unwrap();
    for length in (0..good.len()).step_by(37) {
        std::fs::write(&path, &good[..length]).unwrap();
        let error = read_exr(&path).unwrap_err().to_string();
        assert!(
            error.contains("no OpenEXR file that can be read"),
            "{error}"
        );
    }
    // Damage within need not be noticed, but must not panic.
    for position in (0..good.len()).step_by(11) {
        let mut bytes = good.clone();
        bytes[position] ^= 0x55;
        std::fs::write(&path, &bytes).unwrap();
        let _ = read_exr(&path);
    }
}
