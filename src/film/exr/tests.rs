//! Round trips, windows, hostile and mutated EXR files. That OpenEXR itself agrees is tested in tests/film_python.rs.

use std::path::Path;

use super::*;
use crate::error::Result;
use crate::film::tests::{XorShift, mutate};
use crate::film::{Film, PlaneData, Window};

/// A film with every kind of plane, all values different.
fn film(width: u32, height: u32, window: Window) -> Film {
    let mut film = Film::new(width, height, window).unwrap();
    let n = film.pixels();
    for (k, name) in ["R", "G", "B", "A", "Z", "N.X", "albedo.R", "cost.nodes"].into_iter().enumerate() {
        let value = |i: usize| i as f32 * 0.37 + k as f32 * 1000.0;
        film.push(name, PlaneData::F32((0..n).map(value).collect())).unwrap();
    }
    film.push("id.instance", PlaneData::U32((0..n as u32).map(|i| !i).collect())).unwrap();
    film.push("level", PlaneData::U8((0..n).map(|i| i as u8).collect())).unwrap();
    film
}

fn encode(film: &Film, compression: Compression) -> Vec<u8> {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("a.exr");
    write(&path, film, &ImageInfo::default(), compression).unwrap();
    std::fs::read(&path).unwrap()
}

fn parse_bytes(bytes: &[u8]) -> Result<Film> {
    parse(Path::new("a.exr"), bytes)
}

#[test]
fn planes_windows_and_special_values_survive() {
    let window = Window { x0: 3, y0: 5, x1: 40, y1: 58 };
    let mut film = film(64, 60, window);
    let special = [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, -0.0, f32::MIN_POSITIVE / 2.0, f32::MAX];
    film.f32_plane_mut("Z").unwrap()[..6].copy_from_slice(&special);
    for compression in [Compression::Zip, Compression::Piz] {
        let back = parse_bytes(&encode(&film, compression)).unwrap();
        assert_eq!((back.width, back.height, back.window), (64, 60, window));
        assert_eq!(back.planes.len(), film.planes.len());
        let bits = |f: &Film, name: &str| -> Vec<u32> {
            match &f.plane(name).unwrap().data {
                PlaneData::F32(v) => v.iter().map(|x| x.to_bits()).collect(),
                PlaneData::U32(v) => v.clone(),
                PlaneData::U8(v) => v.iter().map(|&level| (f32::from(level) / 255.0).to_bits()).collect(),
            }
        };
        for plane in &film.planes {
            assert_eq!(bits(&back, &plane.name), bits(&film, &plane.name), "{} {compression:?}", plane.name);
        }
    }
}

#[test]
fn long_names_are_announced() {
    for (len, version) in [(31, [2, 0, 0, 0]), (32, [2, 4, 0, 0]), (255, [2, 4, 0, 0])] {
        let mut film = Film::full(1, 1).unwrap();
        film.push("n".repeat(len), PlaneData::F32(vec![0.5])).unwrap();
        let bytes = encode(&film, Compression::Zip);
        assert_eq!(bytes[4..8], version, "{len}");
        assert_eq!(parse_bytes(&bytes).unwrap(), film);
    }
}

#[test]
fn films_that_cannot_be_written_leave_no_file() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("a.exr");
    let info = ImageInfo::default();
    assert!(write(&path, &Film::full(2, 2).unwrap(), &info, Compression::Zip).is_err());
    let mut huge = Film::new(u32::MAX, 1, Window { x0: 0, y0: 0, x1: 1, y1: 1 }).unwrap();
    huge.push("R", PlaneData::F32(vec![0.0])).unwrap();
    let what = write(&path, &huge, &info, Compression::Zip).unwrap_err().to_string();
    assert!(what.contains("too large for EXR"), "{what}");
    let mut broken = film(4, 4, Window::full(4, 4));
    broken.planes[0].data = PlaneData::F32(vec![0.0; 3]);
    assert!(write(&path, &broken, &info, Compression::Zip).is_err());
    assert_eq!(std::fs::read_dir(dir.path()).unwrap().count(), 0);
}

/// A file of the exr crate's own making: half floats, and a data window that reaches out of the display window.
fn overscan_file() -> Vec<u8> {
    use ::exr::prelude::*;
    let samples: Vec<f16> = (0..16).map(|i| f16::from_f32(i as f32)).collect();
    let channel = AnyChannel::new("Y", FlatSamples::F16(samples));
    let attributes = LayerAttributes::default().with_position(Vec2(9, -1));
    let layer =
        Layer::new((4, 4), attributes, Encoding::SMALL_LOSSLESS, AnyChannels::sort([channel].into_iter().collect()));
    let display = IntegerBounds::new((10, 0), (20, 2));
    let image = Image::from_layers(ImageAttributes::new(display), vec![layer]);
    let mut bytes = std::io::Cursor::new(Vec::new());
    image.write().to_buffered(&mut bytes).unwrap();
    bytes.into_inner()
}

#[test]
fn overscan_is_dropped_and_halves_are_floats() {
    let film = parse_bytes(&overscan_file()).unwrap();
    assert_eq!((film.width, film.height), (20, 2));
    assert_eq!(film.window, Window { x0: 0, y0: 0, x1: 3, y1: 2 });
    // Rows 1 and 2 and columns 1 to 3 of the 4x4 samples.
    assert_eq!(film.f32_plane("Y").unwrap(), [5.0, 6.0, 7.0, 9.0, 10.0, 11.0]);
}

#[test]
fn files_of_several_parts_are_refused() {
    use ::exr::prelude::*;
    let layer = |name: &str| {
        let channel = AnyChannel::new("Y", FlatSamples::F32(vec![0.0; 4]));
        let channels = AnyChannels::sort([channel].into_iter().collect());
        Layer::new((2, 2), LayerAttributes::named(name), Encoding::UNCOMPRESSED, channels)
    };
    let image = Image::from_layers(ImageAttributes::with_size((2, 2)), vec![layer("a"), layer("b")]);
    let mut bytes = std::io::Cursor::new(Vec::new());
    image.write().to_buffered(&mut bytes).unwrap();
    let what = parse_bytes(&bytes.into_inner()).unwrap_err().to_string();
    assert_eq!(what, "a.exr: has 2 parts, expected one");
}

#[test]
fn a_header_that_claims_too_much_is_refused_before_memory_is_taken() {
    let mut bytes = encode(&film(8, 8, Window::full(8, 8)), Compression::Zip);
    let name = b"dataWindow\0box2i\0";
    let at = bytes.windows(name.len()).position(|w| w == name).unwrap() + name.len() + 4;
    // x_max: eight rows of fifty million pixels, 14 GB of planes. (The number of chunks depends on y alone.)
    bytes[at + 8..at + 12].copy_from_slice(&49_999_999_i32.to_le_bytes());
    let what = parse_bytes(&bytes).unwrap_err().to_string();
    assert!(what.contains("claims 50000000x8 pixels of 10 channels"), "{what}");
}

#[test]
fn a_blank_picture_is_no_liar() {
    let mut blank = Film::full(2048, 2048).unwrap();
    for name in ["R", "G", "B", "A"] {
        blank.push(name, PlaneData::F32(vec![0.0; 2048 * 2048])).unwrap();
    }
    for compression in [Compression::Zip, Compression::Piz] {
        let bytes = encode(&blank, compression);
        assert!(bytes.len() < 1_000_000);
        assert_eq!(parse_bytes(&bytes).unwrap(), sorted(&blank), "{compression:?}");
    }
}

fn sorted(film: &Film) -> Film {
    let mut film = film.clone();
    film.planes.sort_by(|a, b| a.name.cmp(&b.name));
    film
}

#[test]
fn truncated_files_are_errors() {
    let bytes = encode(&film(8, 8, Window::full(8, 8)), Compression::Zip);
    for cut in 0..bytes.len() {
        let what = parse_bytes(&bytes[..cut]).unwrap_err().to_string();
        assert!(what.starts_with("a.exr: "), "{what}");
    }
    assert!(read(Path::new("no such file.exr")).is_err());
}

#[test]
fn mutated_files_never_panic() {
    let seeds = [
        encode(&film(5, 4, Window { x0: 1, y0: 1, x1: 5, y1: 4 }), Compression::Zip),
        encode(&film(5, 4, Window::full(5, 4)), Compression::Piz),
        overscan_file(),
    ];
    let (mut random, mut accepted) = (XorShift(0x2545_f491_4f6c_dd1d), 0);
    for round in 0..20_000 {
        let bytes = mutate(&seeds[round % seeds.len()], &mut random);
        if let Ok(film) = parse_bytes(&bytes) {
            film.validate().unwrap();
            accepted += 1;
        }
    }
    assert!((100..19_900).contains(&accepted), "{accepted}");
}
