//! Reading EXR files.

use std::io::Cursor;
use std::path::Path;

use exr::image::read::image::ReadLayers;
use exr::image::read::layers::ReadChannels;
use exr::image::{AnyChannels, FlatSamples, Image, Layer};
use exr::meta::header::Header;

use crate::error::{Error, Result};
use crate::film::{Film, PlaneData, Window, input};

/// Deflate grows data at most 1032 times, half floats twice that when read. A header that claims more pixels per byte
/// of file lies, unless it is lossy DWA of a blank picture, which is refused with the liars.
const MAX_GROWTH: u64 = 2200;
/// Every tiny picture is fine.
const ALWAYS_ALLOWED: u64 = 1 << 16;

/// Reads a single-part EXR file with any channels: half and float become f32, UINT stays u32, names as in the file
/// in alphabetic order, only the largest resolution level. Coordinates are counted from the display window's corner;
/// pixels outside the display window (overscan) are dropped.
///
/// # Errors
/// [`Error::Io`], or [`Error::Input`] for a file that is damaged, deep, multi-part, subsampled, or whose header
/// claims more pixels than its length can hold.
pub fn read(path: &Path) -> Result<Film> {
    parse(path, &input::read(path)?)
}

/// [`read`] of bytes in memory; `file` is only for messages.
///
/// # Errors
/// [`Error::Input`] as [`read`].
pub fn parse(file: &Path, bytes: &[u8]) -> Result<Film> {
    let bad = |e: exr::error::Error| Error::whole(file, format!("not a readable EXR picture: {e}"));
    let reader = exr::block::read(Cursor::new(bytes), false).map_err(bad)?;
    let [header] = reader.headers() else {
        let parts = reader.headers().len();
        return Err(Error::whole(file, format!("has {parts} parts, expected one")));
    };
    if header.deep {
        return Err(Error::whole(file, "holds deep data, expected one sample per pixel"));
    }
    check_claims(file, header, bytes.len() as u64)?;
    let image = exr::image::read::read()
        .no_deep_data()
        .largest_resolution_level()
        .all_channels()
        .first_valid_layer()
        .all_attributes()
        .from_chunks(reader)
        .map_err(bad)?;
    to_film(image).map_err(|e| Error::whole(file, e.to_string()))
}

/// Compares what the header claims with the file's length, before any memory is taken for pixels.
fn check_claims(file: &Path, header: &Header, len: u64) -> Result<()> {
    let (w, h) = (header.layer_size.width() as u64, header.layer_size.height() as u64);
    // Four bytes per sample in memory, whatever the file has.
    let claimed = w.saturating_mul(h).saturating_mul(4 * header.channels.list.len() as u64);
    let possible = len.saturating_mul(MAX_GROWTH).saturating_add(ALWAYS_ALLOWED);
    // Each chunk costs 8 bytes in the offset table, whatever it holds.
    if claimed > possible || header.chunk_count as u64 > len / 8 {
        let channels = header.channels.list.len();
        let what = format!("claims {w}x{h} pixels of {channels} channels, more than {len} bytes of file can hold");
        return Err(Error::whole(file, what));
    }
    Ok(())
}

/// One axis of the data window inside the display window: (samples to skip, first, last + 1 from the display corner).
fn overlap(data: i32, size: usize, display: i32, limit: usize) -> Option<(usize, u32, u32)> {
    let start = i64::from(data) - i64::from(display);
    let end = (start + i64::try_from(size).ok()?).min(i64::try_from(limit).ok()?);
    let first = start.max(0);
    let skip = usize::try_from(first - start).ok()?;
    (first < end).then_some(())?;
    Some((skip, u32::try_from(first).ok()?, u32::try_from(end).ok()?))
}

fn to_film(image: Image<Layer<AnyChannels<FlatSamples>>>) -> Result<Film> {
    let display = image.attributes.display_window;
    let (layer, limit) = (image.layer_data, display.size);
    let corner = layer.attributes.layer_position;
    let columns = overlap(corner.x(), layer.size.x(), display.position.x(), limit.x());
    let rows = overlap(corner.y(), layer.size.y(), display.position.y(), limit.y());
    let (Some((skip_x, x0, x1)), Some((skip_y, y0, y1))) = (columns, rows) else {
        return Err(Error::Usage("no pixel of the data window lies inside the display window".to_owned()));
    };
    let size = |n: usize| u32::try_from(n).map_err(|_| Error::Usage("picture too large".to_owned()));
    let mut film = Film::new(size(limit.x())?, size(limit.y())?, Window { x0, y0, x1, y1 })?;
    let crop = Crop { stride: layer.size.x(), skip_x, skip_y, window: film.window };
    for channel in layer.channel_data.list {
        let data = match channel.sample_data {
            FlatSamples::F16(v) => PlaneData::F32(crop.of(v).into_iter().map(|x| x.to_f32()).collect()),
            FlatSamples::F32(v) => PlaneData::F32(crop.of(v)),
            FlatSamples::U32(v) => PlaneData::U32(crop.of(v)),
        };
        film.push(channel.name.to_string(), data)?;
    }
    Ok(film)
}

/// Where the kept window lies in a plane of the file.
struct Crop {
    stride: usize,
    skip_x: usize,
    skip_y: usize,
    window: Window,
}

impl Crop {
    fn of<T: Copy>(&self, all: Vec<T>) -> Vec<T> {
        let (w, h) = (self.window.width() as usize, self.window.height() as usize);
        if all.len() == w * h {
            return all;
        }
        let rows = all.chunks_exact(self.stride).skip(self.skip_y).take(h);
        rows.flat_map(|row| row[self.skip_x..self.skip_x + w].iter().copied()).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn axes_overlap() {
        assert_eq!(overlap(2, 3, 0, 10), Some((0, 2, 5)));
        assert_eq!(overlap(-2, 5, 0, 10), Some((2, 0, 3)));
        assert_eq!(overlap(8, 5, 0, 10), Some((0, 8, 10)));
        assert_eq!(overlap(7, 2, 5, 10), Some((0, 2, 4)));
        assert_eq!(overlap(-5, 5, 0, 10), None);
        assert_eq!(overlap(10, 5, 0, 10), None);
        assert_eq!(overlap(i32::MIN, 4, i32::MAX, 10), None);
    }

    #[test]
    fn a_crop_takes_its_rows_and_columns() {
        let crop = Crop { stride: 4, skip_x: 1, skip_y: 1, window: Window { x0: 0, y0: 0, x1: 2, y1: 2 } };
        assert_eq!(crop.of((0..12).collect::<Vec<_>>()), [5, 6, 9, 10]);
    }
}
