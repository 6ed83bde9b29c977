//! Image files and saved films, through the file system.

use std::path::PathBuf;

use smithwalk::film::{
    Aov, AovSet, Film, FilmError, Finish, Identity, Origin, Sample, SavedFilm, sidecar_path,
};
use smithwalk::image::{Display, OutputError, OutputPath, Window, read_exr};
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

/// Adds samples up to `end` to every pixel, some of them faulty.
fn expose(film: &mut Film, end: u32) {
    for tile in film.tiles_mut() {
        while tile.next() < end {
            for pixel in tile.window().pixels() {
                let mut sampler = Sampler::new(5, pixel, tile.next());
                let u = sampler.get_4d(Dimension::bsdf(0));
                let fault = u[3] < 0.01;
                let mut sample =
                    Sample::of([u[0], if fault { f32::NAN } else { u[1] }, 1e4 * u[2]])
                        .with(Aov::Albedo, [u[0], 0.5, 0.25])
                        .with(Aov::Normal, [u[0] - 0.5, 0.0, 1.0])
                        .with(Aov::Single, [u[0] * 0.5; 3])
                        .with(Aov::Multiple, [u[1] * 0.5; 3]);
                if u[3] > 0.5 {
                    sample = sample.with(Aov::Depth, [10.0 * u[3]; 3]);
                }
                tile.add(pixel, &[sample]);
            }
            tile.advance();
        }
    }
}

/// Whatever stands for a render.
fn identity(seed: &str) -> Identity {
    [("camera", "0f"), ("seed", seed)]
        .map(|(name, value)| (name.to_owned(), value.to_owned()))
        .into()
}

fn origin(seed: &str) -> Origin {
    Origin {
        identity: identity(seed),
        target: 8,
        finish: Some(Finish {
            scene: "Grünspan.yaml".to_owned(),
            complete: "1f".to_owned(),
            display: Display::srgb(0.1),
        }),
    }
}

#[test]
fn an_exr_comes_back_bit_by_bit() {
    let folder = Folder::new("exr");
    let mut film = film();
    expose(&mut film, 5);
    let mut image = film.develop();
    image.attributes = vec![
        ("smithwalk.scene".into(), "Grünspan.yaml".into()),
        ("smithwalk.seed".into(), u64::MAX.to_string()),
    ];
    let path = folder.file("image.exr");
    let output = OutputPath::new(&path).unwrap();
    output.check().unwrap();
    output.write(&image, &Display::default()).unwrap();
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
    OutputPath::new(&path)
        .unwrap()
        .write(&image, &Display::default())
        .unwrap();
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
    expose(&mut first, 3);
    // As an interrupted render leaves it: more in some tiles than in others.
    let [tile, ..] = first.tiles_mut() else {
        panic!("no tiles")
    };
    for pixel in tile.window().pixels() {
        let u = Sampler::new(5, pixel, 3).get_4d(Dimension::bsdf(0));
        tile.add(pixel, &[Sample::of([u[0]; 3])]);
    }
    tile.advance();
    first.save(&path, &origin("1")).unwrap();
    let mut resumed = film();
    let saved = SavedFilm::read(&path).unwrap();
    assert_eq!(saved.origin, origin("1"));
    resumed.resume(saved, &identity("1")).unwrap();
    assert!(resumed == first, "saving changed the film");
    assert_eq!(resumed.samples_per_pixel(), 3);

    expose(&mut first, 8);
    expose(&mut resumed, 8);
    assert!(resumed == first, "resuming changed the film");
    assert!(!resumed.faults().is_empty(), "faults are part of the test");
}

/// Parts of any length, merged in any order, have the bits of the whole; the noise
/// estimate, of sums in single precision, is that of the whole but for rounding.
#[test]
fn merged_parts_equal_the_whole() {
    let mut whole = film();
    expose(&mut whole, 19);
    let part = |start: u32, end: u32| {
        let mut part = film();
        part.set_share(start..end);
        expose(&mut part, end);
        part
    };
    let parts = [part(0, 5), part(5, 8), part(8, 17), part(17, 19)];
    for order in [[0, 1, 2, 3], [3, 2, 1, 0], [2, 0, 3, 1]] {
        let mut merged = parts[order[0]].clone();
        let others = order[1..].iter().map(|&i| parts[i].clone());
        merged.merge(&others.collect::<Vec<_>>()).unwrap();
        assert_eq!(merged.common().to_string(), "0–18");
        assert!(merged.develop() == whole.develop(), "{order:?}");
        assert_eq!(merged.faults(), whole.faults());
        let noise = [&merged, &whole].map(|film| film.relative_error().unwrap());
        assert!((noise[0] / noise[1] - 1.0).abs() < 1e-5, "{noise:?}");
    }
    let mut overlapping = part(4, 6);
    assert_eq!(overlapping.merge(&parts[..2]), Err([1, 0]));
}

#[test]
fn a_film_of_another_render_is_refused_and_the_difference_named() {
    let folder = Folder::new("refuse");
    let path = folder.file("image.exr.film");
    let mut saved = film();
    expose(&mut saved, 2);
    saved.save(&path, &origin("1")).unwrap();

    let differs = |film: &mut Film, identity: &Identity| {
        let before = film.clone();
        let saved = SavedFilm::read(&path).unwrap();
        let error = film.resume(saved, identity).unwrap_err();
        assert!(*film == before, "an error leaves the film alone");
        assert!(matches!(error, FilmError::OtherRender { .. }), "{error}");
        error.to_string()
    };
    assert!(differs(&mut film(), &identity("2")).contains("seed 1, not 2"));
    let mut renamed = identity("1");
    renamed.insert("mesh `a`".to_owned(), "00".to_owned());
    assert!(differs(&mut film(), &renamed).contains("no mesh `a`"));
    let mut full = Film::new(RESOLUTION, Window::full(RESOLUTION), film().aovs());
    assert!(differs(&mut full, &identity("1")).contains("another resolution or crop"));
    let mut plain = Film::new(RESOLUTION, CROP, AovSet::NONE);
    assert!(differs(&mut plain, &identity("1")).contains("other AOVs"));
    let mut part = film();
    part.set_share(2..4);
    assert!(differs(&mut part, &identity("1")).contains("samples 0–1"));

    // Every truncation and a flip of any bit in a sample of them is noticed.
    let good = std::fs::read(&path).unwrap();
    let refused = |bytes: &[u8]| {
        std::fs::write(&path, bytes).unwrap();
        SavedFilm::read(&path).is_err()
    };
    for length in (0..good.len()).step_by(997) {
        assert!(refused(&good[..length]), "cut to {length} bytes");
    }
    for position in (0..good.len()).step_by(1009) {
        let mut bytes = good.clone();
        bytes[position] ^= 1 << (position % 8);
        assert!(refused(&bytes), "bit flipped in byte {position}");
    }
    // A right checksum over content that no film can have must not panic either.
    let content = good.len() - 16;
    for position in (0..content).step_by(101) {
        let mut bytes = good.clone();
        bytes[position] = !bytes[position];
        let sum = xxhash_rust::xxh3::xxh3_128(&bytes[..content]);
        bytes[content..].copy_from_slice(&sum.to_le_bytes());
        std::fs::write(&path, &bytes).unwrap();
        if let Ok(film) = SavedFilm::read(&path) {
            let image = film.film.develop();
            assert!(image.color.as_flattened().iter().all(|c| c.is_finite()));
            let _ = film.film.relative_error();
        }
    }
    assert!(!refused(&good));
}

/// Sums can hold squares of single-precision numbers; a mean of colours that is beyond
/// such numbers is no film's.
#[test]
fn sums_that_no_colours_have_are_refused() {
    let folder = Folder::new("huge");
    let path = folder.file("a.film");
    let mut film = Film::new([1, 1], Window::full([1, 1]), AovSet::NONE);
    for tile in film.tiles_mut() {
        tile.add([0, 0], &[Sample::of([1.0, 2.0, 3.0])]);
        tile.advance();
    }
    film.save(&path, &origin("1")).unwrap();
    let good = std::fs::read(&path).unwrap();
    // First the bins, of 38 exponents each: 1 is in bin 0.
    let content = good.len() - 16;
    let ranges = [1u32, 0, 1].map(u32::to_le_bytes).concat();
    let mut windows = good.windows(ranges.len());
    let start = windows.rposition(|w| *w == ranges).unwrap() + ranges.len();
    for bin in [0u8, 3, 6] {
        let mut bytes = good.clone();
        assert_eq!(bytes[start], 0);
        bytes[start] = bin;
        let sum = xxhash_rust::xxh3::xxh3_128(&bytes[..content]);
        bytes[content..].copy_from_slice(&sum.to_le_bytes());
        std::fs::write(&path, &bytes).unwrap();
        assert_eq!(SavedFilm::read(&path).is_ok(), bin < 6, "{bin}");
    }
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
    output.write(&image, &Display::default()).unwrap();
    let before = std::fs::read(&path).unwrap();
    // Two channels of one name: the encoder refuses.
    let twin = image.layers[0].clone();
    image.layers.push(twin);
    let error = output.write(&image, &Display::default()).unwrap_err();
    assert!(matches!(error, OutputError::Write { .. }), "{error}");
    assert_eq!(std::fs::read(&path).unwrap(), before);
    assert_eq!(folder.names(), ["image.exr"], "no leftovers");
}

/// Planted links in a shared folder lead nowhere, what a killed process has left is
/// taken away, a link that is an output stays one, a pipe stays a pipe.
#[cfg(unix)]
#[test]
fn temporary_files_follow_no_links_and_leave_nothing() {
    use std::os::unix::fs::{FileTypeExt, symlink};
    let folder = Folder::new("links");
    let image = film().develop();
    let victim = folder.file("victim");
    std::fs::write(&victim, "precious").unwrap();
    symlink(&victim, folder.file(".image.exr.part")).unwrap();
    let output = OutputPath::new(folder.file("image.exr")).unwrap();
    output.check().unwrap();
    symlink(&victim, folder.file(".image.exr.part")).unwrap();
    output.write(&image, &Display::default()).unwrap();
    assert_eq!(std::fs::read(&victim).unwrap(), b"precious");

    std::fs::create_dir(folder.file("real")).unwrap();
    std::fs::write(folder.file("real/there.exr"), "").unwrap();
    symlink(folder.file("real/there.exr"), folder.file("link.exr")).unwrap();
    let link = OutputPath::new(folder.file("link.exr")).unwrap();
    link.write(&image, &Display::default()).unwrap();
    assert!(folder.file("link.exr").is_symlink());
    assert!(read_exr(&folder.file("real/there.exr")).unwrap().color == image.color);

    let pipe = folder.file("pipe.png");
    let made = std::process::Command::new("mkfifo").arg(&pipe).status();
    assert!(made.unwrap().success());
    let reader = std::thread::spawn({
        let pipe = pipe.clone();
        move || std::fs::read(pipe).unwrap()
    });
    let output = OutputPath::new(&pipe).unwrap();
    output.check().unwrap();
    output.write(&image, &Display::default()).unwrap();
    assert!(reader.join().unwrap().starts_with(b"\x89PNG"));
    let kind = std::fs::symlink_metadata(&pipe).unwrap().file_type();
    assert!(kind.is_fifo());

    let mut names = folder.names();
    names.sort();
    assert_eq!(
        names,
        ["image.exr", "link.exr", "pipe.png", "real", "victim"]
    );
}

#[test]
fn files_that_are_no_images_give_errors() {
    let folder = Folder::new("broken");
    let path = folder.file("image.exr");
    let missing = read_exr(&path).unwrap_err().to_string();
    assert!(missing.contains("can't read"), "{missing}");

    OutputPath::new(&path)
        .unwrap()
        .write(&film().develop(), &Display::default())
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
