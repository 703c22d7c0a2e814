//! Planes of a film as 2-D arrays.

use std::io::{Read, Write};
use std::path::Path;

use super::arrays::{each_record, open, u32_at};
use super::header::{self, Descr, Header};
use crate::error::{Error, Result};
use crate::film::{Film, PlaneData, write_atomically};

/// Reads a 2-D array of `<f4`, `<u4` or `|u1` as (width, height, samples).
///
/// # Errors
/// [`Error::Io`]; [`Error::Input`] with a byte offset if the file is no such array or its length does not fit.
pub fn read_plane(path: &Path) -> Result<(u32, u32, PlaneData)> {
    let (reader, len) = open(path)?;
    plane(path, reader, len)
}

/// [`read_plane`] of bytes in memory; `file` is only for messages.
///
/// # Errors
/// As [`read_plane`].
pub fn parse_plane(file: &Path, bytes: &[u8]) -> Result<(u32, u32, PlaneData)> {
    plane(file, bytes, bytes.len() as u64)
}

fn plane(file: &Path, mut reader: impl Read, len: u64) -> Result<(u32, u32, PlaneData)> {
    let header = Header::read(file, &mut reader, len)?;
    let axis = |i: usize| header.shape.get(i).and_then(|&n| u32::try_from(n).ok());
    let (2, Some(height), Some(width)) = (header.shape.len(), axis(0), axis(1)) else {
        return Err(header.wrong_shape(file, "(height, width), each below 2^32"));
    };
    Ok((width, height, samples(file, reader, &header, len)?))
}

/// The numbers of an array of `<f4`, `<u4` or `|u1`, in C order.
fn samples(file: &Path, reader: impl Read, header: &Header, len: u64) -> Result<PlaneData> {
    let format = match &header.descr {
        Descr::Plain(format) if ["<f4", "<u4", "|u1"].contains(&format.as_str()) => format,
        _ => return Err(header.wrong_descr(file, "'<f4', '<u4' or '|u1': a plane")),
    };
    header.require_c_order(file)?;
    if format == "|u1" {
        let count = header.count(file, 1, len)?;
        let mut levels = Vec::with_capacity(count);
        each_record(file, reader, count, 1, |_, record| {
            levels.extend(record);
            Ok(())
        })?;
        return Ok(PlaneData::U8(levels));
    }
    let count = header.count(file, 4, len)?;
    let mut bits = Vec::with_capacity(count);
    each_record(file, reader, count, 4, |_, record| {
        bits.push(u32_at(record, 0));
        Ok(())
    })?;
    Ok(match format.as_str() {
        "<f4" => PlaneData::F32(bits.into_iter().map(f32::from_bits).collect()),
        _ => PlaneData::U32(bits),
    })
}

/// Most planes in one array.
const MAX_PLANES: u64 = 256;

/// Reads a 2-D array of `<f4`, `<u4` or `|u1` as a film of the plane `Y`, or a 3-D one, whose last axis is planes, as `R G B` (three),
/// `R G B A` (four) or `0 1 2 ...`.
///
/// # Errors
/// As [`read_plane`].
pub fn read_film(path: &Path) -> Result<Film> {
    let (reader, len) = open(path)?;
    film(path, reader, len)
}

/// [`read_film`] of bytes in memory; `file` is only for messages.
///
/// # Errors
/// As [`read_plane`].
pub fn parse_film(file: &Path, bytes: &[u8]) -> Result<Film> {
    film(file, bytes, bytes.len() as u64)
}

fn film(file: &Path, mut reader: impl Read, len: u64) -> Result<Film> {
    let header = Header::read(file, &mut reader, len)?;
    let axis = |i: usize| header.shape.get(i).and_then(|&n| u32::try_from(n).ok());
    let (height, width, planes) = match (header.shape.len(), axis(0), axis(1), header.shape.get(2)) {
        (2, Some(height), Some(width), None) => (height, width, 1),
        (3, Some(height), Some(width), Some(&planes)) if (1..=MAX_PLANES).contains(&planes) => (height, width, planes),
        _ => return Err(header.wrong_shape(file, "(height, width) or (height, width, planes), at most 256 planes")),
    };
    let mut film = Film::full(width, height).map_err(|_| header.wrong_shape(file, "at least one pixel"))?;
    let data = samples(file, reader, &header, len)?;
    let names: Vec<String> = match planes {
        1 => vec!["Y".into()],
        3 | 4 => ["R", "G", "B", "A"].iter().take(planes as usize).map(|&name| name.into()).collect(),
        _ => (0..planes).map(|i| i.to_string()).collect(),
    };
    for (i, name) in names.into_iter().enumerate() {
        let step = planes as usize;
        let plane = match &data {
            PlaneData::F32(v) => PlaneData::F32(v.iter().skip(i).step_by(step).copied().collect()),
            PlaneData::U32(v) => PlaneData::U32(v.iter().skip(i).step_by(step).copied().collect()),
            PlaneData::U8(v) => PlaneData::U8(v.iter().skip(i).step_by(step).copied().collect()),
        };
        film.push(name, plane)?;
    }
    Ok(film)
}

/// Writes several float planes as one array of shape (height, width, planes).
///
/// # Errors
/// [`Error::Usage`] if the sizes do not fit; [`Error::Io`].
pub fn write_stack(path: &Path, width: u32, height: u32, planes: &[&[f32]]) -> Result<()> {
    let area = u64::from(width) * u64::from(height);
    if let Some(plane) = planes.iter().find(|plane| plane.len() as u64 != area) {
        return Err(Error::Usage(format!("a plane of {} samples is not {width}x{height}", plane.len())));
    }
    let shape = [u64::from(height), u64::from(width), planes.len() as u64];
    let head = header::bytes(&Descr::Plain("<f4".to_owned()), &shape);
    write_atomically(path, |w| {
        w.write_all(&head)?;
        (0..area as usize).try_for_each(|i| planes.iter().try_for_each(|plane| w.write_all(&plane[i].to_le_bytes())))
    })
}

/// Writes one plane as an array of shape (height, width).
///
/// # Errors
/// [`Error::Usage`] if the sizes do not fit; [`Error::Io`].
pub fn write_plane(path: &Path, width: u32, height: u32, data: &PlaneData) -> Result<()> {
    if u64::from(width) * u64::from(height) != data.len() as u64 {
        return Err(Error::Usage(format!("a plane of {} samples is not {width}x{height}", data.len())));
    }
    let format = match data {
        PlaneData::F32(_) => "<f4",
        PlaneData::U32(_) => "<u4",
        PlaneData::U8(_) => "|u1",
    };
    let head = header::bytes(&Descr::Plain(format.to_owned()), &[u64::from(height), u64::from(width)]);
    write_atomically(path, |w| {
        w.write_all(&head)?;
        match data {
            PlaneData::F32(v) => v.iter().try_for_each(|x| w.write_all(&x.to_le_bytes())),
            PlaneData::U32(v) => v.iter().try_for_each(|x| w.write_all(&x.to_le_bytes())),
            PlaneData::U8(v) => w.write_all(v),
        }
    })
}
