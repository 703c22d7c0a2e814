//! OpenEXR pictures: R, G, B (or Y alone) and A of the first part, its data window.

use std::io::Cursor;

use exr::block::reader::Reader;
use exr::image::read::specific_channels::ReadSpecificChannel;
use exr::meta::header::Header as Part;
use exr::prelude::{ReadChannels, ReadLayers};

use super::header::Header;
use super::levels::clean;
use crate::scene::texture::Texels;

/// Width and height of the picture in `bytes`.
///
/// # Errors
/// What is wrong with the header.
pub(super) fn size(bytes: &[u8]) -> Result<(u32, u32), String> {
    let size = open(bytes)?.headers()[0].layer_size;
    let side = |n: usize| u32::try_from(n).map_err(|_| "too large".to_string());
    Ok((side(size.width())?, side(size.height())?))
}

/// The texels of the picture in `bytes`, whose header was found harmless.
///
/// # Errors
/// Damaged or truncated data.
pub(super) fn texels(bytes: &[u8], header: &Header) -> Result<Texels, String> {
    let reader = open(bytes)?;
    let grey = !has_channel(&reader.headers()[0], "R");
    let (width, count) = (header.width as usize, header.width as usize * header.height as usize);
    let image = exr::image::read::read()
        .no_deep_data()
        .largest_resolution_level()
        .specific_channels()
        .optional("R", 0.0_f32)
        .optional("G", 0.0_f32)
        .optional("B", 0.0_f32)
        .optional("Y", 0.0_f32)
        .optional("A", 1.0_f32)
        .collect_pixels(
            move |_, _| vec![[0.0_f32; 4]; count],
            move |texels: &mut Vec<[f32; 4]>, at, (r, g, b, y, a): (f32, f32, f32, f32, f32)| {
                texels[at.y() * width + at.x()] = clean(if grey { [y, y, y, a] } else { [r, g, b, a] });
            },
        )
        .first_valid_layer()
        .all_attributes()
        .from_chunks(reader)
        .map_err(|e| e.to_string())?;
    Ok(Texels::Float(image.layer_data.channel_data.pixels))
}

/// A reader behind the headers: the first part has R, G and B, or else Y.
fn open(bytes: &[u8]) -> Result<Reader<Cursor<&[u8]>>, String> {
    let reader = exr::block::read(Cursor::new(bytes), false).map_err(|e| e.to_string())?;
    let Some(first) = reader.headers().first() else { return Err("it has no parts".into()) };
    if first.deep {
        return Err("it holds deep data".into());
    }
    // Each chunk costs 8 bytes in the offset table, whatever it holds.
    if reader.headers().iter().any(|part| part.chunk_count as u64 > bytes.len() as u64 / 8) {
        return Err(format!("it claims more chunks than its {} bytes can hold", bytes.len()));
    }
    let coloured = ["R", "G", "B"].iter().all(|name| has_channel(first, name));
    // An R without the others would be taken for a colour.
    if !coloured && (has_channel(first, "R") || !has_channel(first, "Y")) {
        return Err("expected the channels R, G and B, or Y".into());
    }
    // Luminance and chroma: Y alone would be shown grey.
    if !coloured && ["RY", "BY"].iter().any(|name| has_channel(first, name)) {
        return Err(
            "expected the channels R, G and B, or Y alone: luminance with chroma (Y, RY, BY) is not read".into()
        );
    }
    Ok(reader)
}

fn has_channel(part: &Part, name: &str) -> bool {
    part.channels.list.iter().any(|channel| channel.name == *name)
}
