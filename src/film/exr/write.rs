//! Writing EXR files.

use std::io::{self, Seek, SeekFrom, Write};
use std::path::Path;

use exr::block::lines::LineRefMut;
use exr::image::write::samples::{SamplesWriter, WritableSamples};
use exr::math::RoundingMode;
use exr::meta::attribute::{AttributeValue, Chromaticities, IntegerBounds, LevelMode, LineOrder, SampleType, Text};
use exr::meta::header::{Header, ImageAttributes, LayerAttributes};
use exr::prelude::{AnyChannel, AnyChannels, Blocks, Encoding, Image, Layer, Vec2, WritableImage};

use super::ImageInfo;
use crate::error::{Error, Result};
use crate::film::{Film, PlaneData, write_atomically};

/// Older programs accept longer names only in files that announce them, which the exr crate forgets for channels.
const SHORT_NAME: usize = 31;
/// Where bits 8 to 15 of the version field stand; all are 0 in our single-part scanline files.
const VERSION_FLAGS: u64 = 5;
/// Bit 10 of the version field.
const LONG_NAMES: u8 = 4;

/// Lossless compression of an EXR file.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Compression {
    /// Deflate over blocks of 16 scanlines.
    #[default]
    Zip,
    /// Wavelets and Huffman codes over blocks of 32 scanlines; smaller for grainy pictures.
    Piz,
}

/// Writes every plane of `film` with its windows and the attributes of `info`, whole or not at all.
///
/// # Errors
/// [`Error::Usage`] for a film that breaks its invariants, has no plane, or is wider or higher than EXR allows
/// (2^30); [`Error::Io`] if the file cannot be written.
pub fn write(path: &Path, film: &Film, info: &ImageInfo, compression: Compression) -> Result<()> {
    film.validate()?;
    if film.planes.is_empty() {
        return Err(Error::Usage("a film without planes cannot be written".to_owned()));
    }
    let bounds = display_bounds(film)?;
    let channels = film
        .planes
        .iter()
        .map(|plane| AnyChannel {
            name: text(&plane.name),
            sample_data: Samples { data: &plane.data, width: film.window.width() as usize },
            quantize_linearly: false,
            sampling: Vec2(1, 1),
        })
        .collect();
    let encoding = Encoding {
        compression: match compression {
            Compression::Zip => exr::compression::Compression::ZIP16,
            Compression::Piz => exr::compression::Compression::PIZ,
        },
        blocks: Blocks::ScanLines,
        line_order: LineOrder::Increasing,
    };
    let size = Vec2(film.window.width() as usize, film.window.height() as usize);
    let layer = Layer::new(size, layer_attributes(film, info), encoding, AnyChannels::sort(channels));
    let image = Image { attributes: image_attributes(bounds), layer_data: layer };
    let has_long_name = film.planes.iter().any(|plane| plane.name.chars().count() > SHORT_NAME);
    write_atomically(path, |w| {
        image.write().to_buffered(&mut *w).map_err(io_error)?;
        if has_long_name {
            w.seek(SeekFrom::Start(VERSION_FLAGS))?;
            w.write_all(&[LONG_NAMES])?;
        }
        Ok(())
    })
}

fn io_error(e: exr::error::Error) -> io::Error {
    match e {
        exr::error::Error::Io(e) => e,
        other => io::Error::other(other.to_string()),
    }
}

fn display_bounds(film: &Film) -> Result<IntegerBounds> {
    let bounds = IntegerBounds::from_dimensions(Vec2(film.width as usize, film.height as usize));
    bounds
        .validate(None)
        .map_err(|_| Error::Usage(format!("a picture of {}x{} is too large for EXR", film.width, film.height)))?;
    Ok(bounds)
}

fn image_attributes(display: IntegerBounds) -> ImageAttributes {
    let mut attributes = ImageAttributes::new(display);
    // ITU-R BT.709 primaries and the white point D65.
    attributes.chromaticities = Some(Chromaticities {
        red: Vec2(0.64, 0.33),
        green: Vec2(0.30, 0.60),
        blue: Vec2(0.15, 0.06),
        white: Vec2(0.3127, 0.3290),
    });
    attributes
}

fn layer_attributes(film: &Film, info: &ImageInfo) -> LayerAttributes {
    let window = film.window;
    let mut attributes = LayerAttributes {
        // Inside the display window, whose size was checked against EXR's limit.
        layer_position: Vec2(window.x0 as i32, window.y0 as i32),
        software_name: Some(&info.software).filter(|name| !name.is_empty()).map(|name| text(name)),
        world_to_camera: info.world_to_camera.map(imath),
        world_to_normalized_device: info.world_to_ndc.map(imath),
        ..LayerAttributes::default()
    };
    let int = |x: u32| AttributeValue::I32(i32::try_from(x).unwrap_or(i32::MAX));
    let words = |s: &str| AttributeValue::Text(text(s));
    let (is_sampled, is_traced) = (info.spp > 0, info.rays > 0);
    for (name, value, is_known) in [
        ("revision", words(&info.revision), !info.revision.is_empty()),
        ("sceneHash", words(&info.scene_hash), !info.scene_hash.is_empty()),
        ("engine", words(&info.engine), !info.engine.is_empty()),
        ("isa", words(&info.isa), !info.isa.is_empty()),
        ("lanes", int(info.lanes), info.lanes > 0),
        ("batch", int(info.batch), info.batch > 0),
        ("spp", int(info.spp), is_sampled),
        ("seed", words(&info.seed.to_string()), is_sampled),
        ("renderSeconds", AttributeValue::F64(info.render_seconds), is_traced),
        ("rays", AttributeValue::F64(info.rays as f64), is_traced),
    ] {
        if is_known {
            attributes.other.insert(text(&format!("lanecast/{name}")), value);
        }
    }
    for (name, value) in &film.texts {
        attributes.other.insert(text(name), AttributeValue::Text(text(value)));
    }
    attributes
}

/// EXR text has one byte per character (Latin-1); other characters become `?`.
fn text(s: &str) -> Text {
    let bytes = s.chars().map(|c| u8::try_from(u32::from(c)).unwrap_or(b'?')).collect();
    Text::from_bytes_unchecked(bytes)
}

/// Column-vector matrix to Imath's: row vectors, stored row by row, so each column becomes a row.
fn imath(m: [[f64; 4]; 4]) -> [f32; 16] {
    std::array::from_fn(|i| m[i % 4][i / 4] as f32)
}

/// A plane lent to the encoder, which would otherwise want a copy of every plane.
struct Samples<'film> {
    data: &'film PlaneData,
    width: usize,
}

impl<'a, 'film: 'a> WritableSamples<'a> for Samples<'film> {
    type Writer = LineCopy<'a>;

    fn sample_type(&self) -> SampleType {
        match self.data {
            PlaneData::F32(_) | PlaneData::U8(_) => SampleType::F32,
            PlaneData::U32(_) => SampleType::U32,
        }
    }

    fn infer_level_modes(&self) -> (LevelMode, RoundingMode) {
        (LevelMode::Singular, RoundingMode::Down)
    }

    fn create_samples_writer(&'a self, _header: &Header) -> LineCopy<'a> {
        LineCopy { data: self.data, width: self.width }
    }
}

struct LineCopy<'a> {
    data: &'a PlaneData,
    width: usize,
}

impl SamplesWriter for LineCopy<'_> {
    fn extract_line(&self, line: LineRefMut<'_>) {
        let start = line.location.position.y() * self.width + line.location.position.x();
        let range = start..start + line.location.sample_count;
        match self.data {
            PlaneData::F32(v) => line.write_samples_from_slice(&v[range]),
            PlaneData::U32(v) => line.write_samples_from_slice(&v[range]),
            PlaneData::U8(v) => {
                let values: Vec<f32> = v[range].iter().map(|&level| f32::from(level) / 255.0).collect();
                line.write_samples_from_slice(&values)
            }
        }
        .expect("a line of memory takes exactly its own samples");
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_translation_stands_in_the_last_row_of_a_row_vector_matrix() {
        let mut m = [[0.0; 4]; 4];
        for i in 0..4 {
            m[i][i] = 1.0;
        }
        (m[0][3], m[1][3], m[2][3]) = (5.0, 6.0, 7.0);
        assert_eq!(imath(m), [1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 5.0, 6.0, 7.0, 1.0]);
    }

    #[test]
    fn text_is_latin_1() {
        assert_eq!(text("a\u{e9}\u{1f4f7}").bytes(), b"a\xe9?");
    }
}
