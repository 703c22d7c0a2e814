//! Pictures of every kind that scenes use, against numbers that are known without our decoder: the files of
//! fuzz/corpus/picture were written by another program (Pillow 13) or byte by byte.

use std::path::{Path, PathBuf};

use lanecast::scene::pictures::{Content, Curve, MAX_TEXELS, Picture, decode, decode_all};
use lanecast::scene::texture::{Texels, Texture};

/// The bytes of a file of the corpus, or a line that says it is not there.
fn file(name: &str) -> Option<Vec<u8>> {
    let path = path(name);
    let bytes = std::fs::read(&path).ok();
    if bytes.is_none() {
        println!("SKIPPED: {} is not there (packaged sources leave it out)", path.display());
    }
    bytes
}

fn path(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("fuzz/corpus/picture").join(name)
}

fn read(name: &str, curve: Curve) -> Option<Texture> {
    let bytes = file(name)?;
    Some(decode(name, &bytes, curve).unwrap_or_else(|e| panic!("{name}: {e}")))
}

/// The gradient that the JPEGs hold: 24 x 16, red to the right, green downwards, blue along the diagonal.
fn gradient(x: usize, y: usize) -> [f64; 3] {
    [x * 255 / 23, y * 255 / 15, (x + y) * 255 / 38].map(|level| level as f64)
}

#[test]
fn jpegs_baseline_and_progressive() {
    for (name, tolerance) in [("baseline.jpg", 6.0), ("progressive.jpg", 6.0), ("progressive_420.jpg", 40.0)] {
        let Some(picture) = read(name, Curve::Srgb) else { return };
        assert_eq!((picture.width, picture.height), (24, 16), "{name}");
        let Texels::Srgb8(texels) = &picture.texels else { panic!("{name}") };
        for (i, texel) in texels.iter().enumerate() {
            let wanted = gradient(i % 24, i / 24);
            for c in 0..3 {
                let difference = (f64::from(texel[c]) - wanted[c]).abs();
                assert!(difference <= tolerance, "{name} texel {i}: {texel:?}, not {wanted:?}");
            }
            assert_eq!(texel[3], 255);
        }
    }
    // What libjpeg-turbo makes of the same bytes, to two levels: the standard leaves rounding to the decoder.
    let Some(picture) = read("progressive.jpg", Curve::Linear) else { return };
    let Texels::Linear8(texels) = &picture.texels else { panic!("not linear") };
    for (at, wanted) in [(0, [1, 0, 0]), (8 * 24 + 12, [132, 136, 135]), (15 * 24 + 23, [255, 255, 253])] {
        assert!((0..3).all(|c| texels[at][c].abs_diff(wanted[c]) <= 2), "{:?}, not {wanted:?}", texels[at]);
    }
    let Some(Texels::Srgb8(grey)) = read("grey.jpg", Curve::Srgb).map(|t| t.texels) else { panic!("not grey") };
    assert!(grey.iter().all(|[r, g, b, a]| r == g && g == b && *a == 255));
    let Some(Texels::Srgb8(cmyk)) = read("cmyk.jpg", Curve::Srgb).map(|t| t.texels) else { panic!("not read") };
    assert!(cmyk[0][0] < 12 && cmyk[15 * 24 + 23].iter().all(|&level| level > 240), "{cmyk:?}");
}

#[test]
fn pngs_with_palettes_and_few_or_many_bits() {
    let Some(palette) = read("palette.png", Curve::Srgb) else { return };
    let colours = [[255, 0, 0, 255], [0, 255, 0, 128], [0, 0, 255, 0], [10, 20, 30, 255]];
    let wanted: Vec<[u8; 4]> = (0..15).map(|i| colours[i % 4]).collect();
    assert_eq!(palette.texels, Texels::Srgb8(wanted));
    assert_eq!((palette.width, palette.height, palette.bytes()), (5, 3, 60));

    let wanted: Vec<[u8; 4]> = (0..15).map(|i| if i % 2 == 1 { [255; 4] } else { [0, 0, 0, 255] }).collect();
    assert_eq!(read("one_bit.png", Curve::Linear).unwrap().texels, Texels::Linear8(wanted));

    let level = |i: u16| [i * 4369, i * 4369, i * 4369, 65535];
    assert_eq!(read("grey16.png", Curve::Linear).unwrap().texels, Texels::Linear16((0..15).map(level).collect()));
    let level = |i: u32| (i / 12 * 4000 + i % 12 * 13) as u16;
    let wanted: Vec<[u16; 4]> = (0..6).map(|p| std::array::from_fn(|c| level(4 * p + c as u32))).collect();
    assert_eq!(read("rgba16.png", Curve::Linear).unwrap().texels, Texels::Linear16(wanted.clone()));
    // IEC 61966-2-1: 0.13333 of full is 0.015996 of the light, 0.93333 is 0.85499; alpha has no curve.
    let Texels::Linear16(light) = read("grey16.png", Curve::Srgb).unwrap().texels else { panic!("not 16 bits") };
    assert_eq!(light[2], [1048, 1048, 1048, 65535]);
    assert_eq!((light[0][0], light[14][0]), (0, 56032));
}

#[test]
fn pictures_of_floats() {
    let Some(hdr) = read("flat.hdr", Curve::Srgb) else { return };
    let wanted: Vec<[f32; 4]> = (0..8_i16).map(|i| [2.0_f32.powi(i.into()), 0.5, f32::from(1 + i), 1.0]).collect();
    let Texels::Float(texels) = &hdr.texels else { panic!("not floats") };
    for (texel, wanted) in texels.iter().zip(&wanted) {
        // A common exponent leaves 8 bits to the largest number.
        let step = wanted[0].max(wanted[2]) / 128.0;
        assert!((0..4).all(|c| (texel[c] - wanted[c]).abs() <= step), "{texel:?}, not {wanted:?}");
    }
    let bytes = exr_file(|x, y| (x as f32, y as f32 * 0.25, if x == 2 { f32::NAN } else { -1.0 }));
    let exr = decode("t.exr", &bytes, Curve::Srgb).unwrap();
    let wanted: Vec<[f32; 4]> = (0..6).map(|i| [(i % 3) as f32, (i / 3) as f32 * 0.25, 0.0, 1.0]).collect();
    assert_eq!((exr.width, exr.height, exr.texels), (3, 2, Texels::Float(wanted)), "not a number and negative are 0");
    let infinite = decode("t.exr", &exr_file(|_, _| (f32::INFINITY, 1.0, 1.0)), Curve::Linear).unwrap();
    let Texels::Float(texels) = infinite.texels else { panic!("not floats") };
    assert!(texels[0][0] > 1e9 && texels[0][0].is_finite());
}

/// A Radiance picture of one texel of 1, 1, 1 with `lines` in its header.
fn hdr_file(signature: &str, lines: &str) -> Vec<u8> {
    let mut bytes = format!("{signature}\n{lines}FORMAT=32-bit_rle_rgbe\n\n-Y 1 +X 1\n").into_bytes();
    bytes.extend([128, 128, 128, 129]);
    bytes
}

#[test]
fn exposure_of_radiance_pictures_is_divided_out() {
    for (lines, wanted) in [
        ("", [1.0; 4]),
        ("EXPOSURE=4\n", [0.25, 0.25, 0.25, 1.0]),
        ("EXPOSURE=4\nSOFTWARE=x\nEXPOSURE= 0.5\n", [0.5, 0.5, 0.5, 1.0]),
        ("COLORCORR=2 1 0.5\nEXPOSURE=2\n", [0.25, 0.5, 1.0, 1.0]),
    ] {
        let read = decode("t.hdr", &hdr_file("#?RADIANCE", lines), Curve::Linear).unwrap();
        assert_eq!(read.texels, Texels::Float(vec![wanted]), "{lines}");
        // The other signature of the same format.
        let other = decode("t.hdr", &hdr_file("#?RGBE", lines), Curve::Linear).unwrap();
        assert_eq!(other, read, "{lines}");
    }
    for (lines, wanted) in [
        ("EXPOSURE=0\n", "expected a finite EXPOSURE above zero, found 0"),
        ("EXPOSURE=-1\n", "expected a finite EXPOSURE above zero, found -1"),
        ("EXPOSURE=inf\n", "expected a finite EXPOSURE above zero, found inf"),
        ("EXPOSURE=1e30\nEXPOSURE=1e30\n", "expected a finite EXPOSURE above zero, found inf"),
        ("COLORCORR=1 nan 1\n", "expected a finite COLORCORR above zero, found NaN"),
        ("COLORCORR=1 1 1e30\nEXPOSURE=1e30\n", "EXPOSURE and COLORCORR multiply to [1e30, 1e30, inf]"),
    ] {
        let error = decode("t.hdr", &hdr_file("#?RADIANCE", lines), Curve::Linear).unwrap_err();
        assert!(error.contains(wanted), "{lines}: {error}");
    }
}

fn exr_file(colour: impl Sync + Fn(usize, usize) -> (f32, f32, f32)) -> Vec<u8> {
    use exr::prelude::{Image, SpecificChannels, Vec2, WritableImage};
    let channels = SpecificChannels::rgb(|at: Vec2<usize>| colour(at.x(), at.y()));
    let mut bytes = std::io::Cursor::new(Vec::new());
    Image::from_channels((3, 2), channels).write().to_buffered(&mut bytes).unwrap();
    bytes.into_inner()
}

#[test]
fn luminance_alone_is_grey_and_with_chroma_refused() {
    use exr::prelude::{AnyChannel, AnyChannels, FlatSamples, Image, WritableImage};
    let read = |names: &[&str]| {
        let list = names.iter().map(|&name| AnyChannel::new(name, FlatSamples::F32(vec![0.5; 6]))).collect();
        let mut bytes = std::io::Cursor::new(Vec::new());
        Image::from_channels((3, 2), AnyChannels::sort(list)).write().to_buffered(&mut bytes).unwrap();
        decode("t.exr", &bytes.into_inner(), Curve::Linear).map(|picture| picture.texels)
    };
    assert_eq!(read(&["Y"]), Ok(Texels::Float(vec![[0.5, 0.5, 0.5, 1.0]; 6])));
    for names in [&["Y", "RY", "BY"][..], &["Y", "BY"]] {
        let error = read(names).unwrap_err();
        assert!(error.contains("luminance with chroma (Y, RY, BY) is not read"), "{error}");
    }
    assert!(read(&["R", "G", "B", "Y", "RY", "BY"]).is_ok());
}

#[test]
fn what_cannot_be_read_says_why() {
    for (name, wanted) in [
        ("text.png", "expected a PNG, JPEG, Radiance HDR or EXR picture, found a file that begins `this is `"),
        ("huge.png", "is too large: 60000 x 60000 texels"),
        ("lie.png", "claims 8192 x 8192 texels, more than its 66 bytes can hold"),
        ("lie.hdr", "claims 8000 x 4000 texels, more than its 101 bytes can hold"),
        ("truncated.jpg", "not a readable JPEG picture: the data ends before the picture does"),
    ] {
        let Some(bytes) = file(name) else { return };
        let error = decode(name, &bytes, Curve::Srgb).unwrap_err();
        assert!(error.starts_with(wanted), "{name}: {error}");
    }
    assert_eq!(decode("x", b"", Curve::Srgb).unwrap_err(), "the picture is empty");
    assert_eq!(MAX_TEXELS, 8192 * 8192);
}

#[test]
fn every_truncation_is_an_error_or_a_whole_picture() {
    for name in ["palette.png", "rgba16.png", "progressive.jpg", "baseline.jpg", "flat.hdr", "zip.exr"] {
        let Some(bytes) = file(name) else { return };
        let whole = decode(name, &bytes, Curve::Linear).unwrap();
        for length in 0..bytes.len() {
            // The end of a file may hold nothing that the picture needs (the last chunk of a PNG).
            if let Ok(cut) = decode(name, &bytes[..length], Curve::Linear) {
                assert!(cut == whole && length + 16 > bytes.len(), "{name} cut to {length} of {}", bytes.len());
            }
        }
    }
}

#[test]
fn damaged_bytes_end_in_a_picture_or_an_error() {
    let mut state = 1_u64;
    let mut random = |n: usize| {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        (state % n as u64) as usize
    };
    let (mut good, mut bad) = (0, 0);
    for name in ["palette.png", "rgba16.png", "progressive.jpg", "baseline.jpg", "flat.hdr", "zip.exr"] {
        let Some(bytes) = file(name) else { return };
        for _ in 0..300 {
            let mut bytes = bytes.clone();
            for _ in 0..1 + random(3) {
                let at = random(bytes.len());
                bytes[at] = random(256) as u8;
            }
            match decode(name, &bytes, Curve::Linear) {
                Ok(t) => {
                    good += 1;
                    let texel = if matches!(t.texels, Texels::Float(_)) { 16 } else { 4 };
                    assert!(t.bytes() >= u64::from(t.width) * u64::from(t.height) * texel);
                }
                Err(_) => bad += 1,
            }
        }
    }
    assert!(good > 50 && bad > 50, "{good} good, {bad} bad");
}

#[test]
fn many_pictures_keep_their_order_and_name_the_first_that_is_wrong() {
    let Some(palette) = file("palette.png") else { return };
    let picture = |content, name: &str| Picture { name: name.into(), content, curve: Curve::Srgb };
    let mut list: Vec<_> =
        (0..40).map(|i| picture(Content::Bytes((&palette[..]).into()), &format!("number {i}"))).collect();
    list.push(picture(Content::File(path("grey16.png")), "grey"));
    let all = decode_all(&list).unwrap();
    assert!(all.iter().take(40).enumerate().all(|(i, (t, _))| t.name == format!("number {i}") && t.width == 5));
    assert_eq!((all.len(), all[0].1 == all[39].1, all[0].1 == all[40].1), (41, true, false));
    list[7].content = Content::File(path("none.png"));
    list[9].content = Content::Bytes(Vec::new().into());
    let wrong = decode_all(&list).unwrap_err();
    assert_eq!((wrong.index, wrong.what.starts_with("cannot read it: ")), (7, true), "{wrong:?}");
    assert!(decode_all(&[picture(Content::File(PathBuf::from("/")), "x")]).unwrap_err().what.contains("not a file"));
}
