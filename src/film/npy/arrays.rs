//! Files of rays, hits and occlusion flags.

use std::borrow::Borrow;
use std::fs::File;
use std::io::{BufReader, Read, Seek, SeekFrom, Write};
use std::path::Path;

use super::header::{self, Descr, Header};
use crate::error::{Error, Result};
use crate::film::{input, write_atomically};
use crate::lanes::Real;
use crate::ray::{Hits, Rays};
use crate::trace::Stretch;

/// Bytes read at a time.
const CHUNK: usize = 1 << 16;

/// What a ray file's rows are, for messages.
const RAY_DTYPE: &str = "'<f4' or '<f8': a ray file holds rows of ox oy oz t_min dx dy dz t_max";
const RAY_SHAPE: &str = "(N, 8): a ray file holds rows of ox oy oz t_min dx dy dz t_max";

const HIT_FIELDS: [(&str, &str); 5] = [("t", "<f4"), ("u", "<f4"), ("v", "<f4"), ("prim", "<u4"), ("inst", "<u4")];
const HIT_SIZE: usize = 20;

fn hit_descr() -> Descr {
    Descr::Record(HIT_FIELDS.iter().map(|(name, format)| ((*name).to_owned(), (*format).to_owned())).collect())
}

/// Reads a ray file: shape (N, 8), `<f4`, or `<f8` whose numbers are rounded to the nearest f32.
///
/// # Errors
/// [`Error::Io`]; [`Error::Input`] with a byte offset if the file is no such array or its length does not fit.
pub fn read_rays(path: &Path) -> Result<Rays<f32>> {
    let (reader, len) = open(path)?;
    rays(path, reader, len)
}

/// [`read_rays`] of bytes in memory; `file` is only for messages.
///
/// # Errors
/// As [`read_rays`].
pub fn parse_rays(file: &Path, bytes: &[u8]) -> Result<Rays<f32>> {
    rays(file, bytes, bytes.len() as u64)
}

fn rays(file: &Path, mut reader: impl Read, len: u64) -> Result<Rays<f32>> {
    let header = Header::read(file, &mut reader, len)?;
    let width = match &header.descr {
        Descr::Plain(format) if format == "<f4" => 4,
        Descr::Plain(format) if format == "<f8" => 8,
        _ => return Err(header.wrong_descr(file, RAY_DTYPE)),
    };
    if header.shape.len() != 2 || header.shape[1] != 8 {
        return Err(header.wrong_shape(file, RAY_SHAPE));
    }
    header.require_c_order(file)?;
    let count = header.count(file, width as u64, len)? / 8;
    let mut rays = Rays::new(count);
    each_record(file, reader, count, 8 * width, |i, record| {
        let x = |k: usize| match width {
            4 => f32::from_bits(u32_at(record, 4 * k)),
            _ => f64::from_bits(u64::from(u32_at(record, 8 * k)) | u64::from(u32_at(record, 8 * k + 4)) << 32) as f32,
        };
        rays.set(i, [x(0), x(1), x(2)], [x(4), x(5), x(6)], x(3), x(7));
        Ok(())
    })?;
    Ok(rays)
}

/// Reads a hit file: shape (N), fields t u v (`<f4`) prim inst (`<u4`).
///
/// # Errors
/// As [`read_rays`].
pub fn read_hits(path: &Path) -> Result<Hits<f32>> {
    let (reader, len) = open(path)?;
    hits(path, reader, len)
}

/// [`read_hits`] of bytes in memory; `file` is only for messages.
///
/// # Errors
/// As [`read_hits`].
pub fn parse_hits(file: &Path, bytes: &[u8]) -> Result<Hits<f32>> {
    hits(file, bytes, bytes.len() as u64)
}

fn hits(file: &Path, mut reader: impl Read, len: u64) -> Result<Hits<f32>> {
    let header = Header::read(file, &mut reader, len)?;
    let wanted = hit_descr();
    if header.descr != wanted {
        return Err(header.wrong_descr(file, &format!("{wanted}: a hit file")));
    }
    let count = vector_len(&header, file, HIT_SIZE as u64, len)?;
    let mut hits = Hits::new(count);
    each_record(file, reader, count, HIT_SIZE, |i, record| {
        hits.t[i] = f32::from_bits(u32_at(record, 0));
        hits.u[i] = f32::from_bits(u32_at(record, 4));
        hits.v[i] = f32::from_bits(u32_at(record, 8));
        hits.prim[i] = u32_at(record, 12);
        hits.inst[i] = u32_at(record, 16);
        Ok(())
    })?;
    Ok(hits)
}

/// Reads an occlusion file: shape (N), `|u1` or `|b1`, each 0 or 1.
///
/// # Errors
/// As [`read_rays`], and for a value other than 0 and 1.
pub fn read_occlusion(path: &Path) -> Result<Vec<u8>> {
    let (reader, len) = open(path)?;
    occlusion(path, reader, len)
}

/// [`read_occlusion`] of bytes in memory; `file` is only for messages.
///
/// # Errors
/// As [`read_occlusion`].
pub fn parse_occlusion(file: &Path, bytes: &[u8]) -> Result<Vec<u8>> {
    occlusion(file, bytes, bytes.len() as u64)
}

fn occlusion(file: &Path, mut reader: impl Read, len: u64) -> Result<Vec<u8>> {
    let header = Header::read(file, &mut reader, len)?;
    if !matches!(&header.descr, Descr::Plain(format) if format == "|u1" || format == "|b1") {
        return Err(header.wrong_descr(file, "'|u1' or '|b1': an occlusion file"));
    }
    let count = vector_len(&header, file, 1, len)?;
    let mut flags = Vec::with_capacity(count);
    each_record(file, reader, count, 1, |i, record| {
        if record[0] > 1 {
            let what = format!("expected 0 or 1, found {}", record[0]);
            return Err(Error::at_byte(file, header.data_at + i as u64, what));
        }
        flags.push(record[0]);
        Ok(())
    })?;
    Ok(flags)
}

fn vector_len(header: &Header, file: &Path, size: u64, len: u64) -> Result<usize> {
    if header.shape.len() != 1 {
        return Err(header.wrong_shape(file, "(N,)"));
    }
    header.count(file, size, len)
}

pub(super) fn open(path: &Path) -> Result<(BufReader<File>, u64)> {
    let (file, len) = input::open(path)?;
    Ok((BufReader::new(file), len))
}

/// Hands each of `count` records of `size` bytes to `use_record` with its number.
pub(super) fn each_record(
    file: &Path,
    mut reader: impl Read,
    count: usize,
    size: usize,
    mut use_record: impl FnMut(usize, &[u8]) -> Result<()>,
) -> Result<()> {
    let per_chunk = (CHUNK / size).max(1);
    let mut chunk = vec![0; per_chunk.min(count) * size];
    let mut first = 0;
    while first < count {
        let records = per_chunk.min(count - first);
        let part = &mut chunk[..records * size];
        reader.read_exact(part).map_err(|e| Error::io(file, e))?;
        for (i, record) in part.chunks_exact(size).enumerate() {
            use_record(first + i, record)?;
        }
        first += records;
    }
    Ok(())
}

pub(super) fn u32_at(record: &[u8], at: usize) -> u32 {
    u32::from_le_bytes([record[at], record[at + 1], record[at + 2], record[at + 3]])
}

/// Writes the rays of all batches, one after the other, as one ray file; says how many.
///
/// # Errors
/// [`Error::Io`].
pub fn write_rays<B: Borrow<Rays<f32>>>(path: &Path, batches: impl IntoIterator<Item = B>) -> Result<u64> {
    write_array(path, &Descr::Plain("<f4".to_owned()), &[8], batches, |batch: &B, bytes| {
        let rays = batch.borrow();
        for i in 0..rays.len() {
            let ([ox, oy, oz], [dx, dy, dz]) = (rays.org(i), rays.dir(i));
            for x in [ox, oy, oz, rays.t_min[i], dx, dy, dz, rays.t_max[i]] {
                bytes.extend(x.to_le_bytes());
            }
        }
        rays.len()
    })
}

/// Writes the hits of all batches, one after the other, as one hit file; says how many. Hits of f64 engines are
/// rounded to the nearest f32.
///
/// # Errors
/// [`Error::Io`].
pub fn write_hits<S: Real, B: Borrow<Hits<S>>>(path: &Path, batches: impl IntoIterator<Item = B>) -> Result<u64> {
    write_array(path, &hit_descr(), &[], batches, |batch: &B, bytes| {
        let hits = batch.borrow();
        for i in 0..hits.len() {
            for x in [hits.t[i], hits.u[i], hits.v[i]] {
                bytes.extend((x.to_f64() as f32).to_le_bytes());
            }
            bytes.extend(hits.prim[i].to_le_bytes());
            bytes.extend(hits.inst[i].to_le_bytes());
        }
        hits.len()
    })
}

/// Writes the flags of all batches (1 is occluded), one after the other, as one occlusion file; says how many.
///
/// # Errors
/// [`Error::Io`].
pub fn write_occlusion<B: AsRef<[u8]>>(path: &Path, batches: impl IntoIterator<Item = B>) -> Result<u64> {
    write_array(path, &Descr::Plain("|u1".to_owned()), &[], batches, |batch: &B, bytes| {
        bytes.extend_from_slice(batch.as_ref());
        batch.as_ref().len()
    })
}

/// Writes a file of stretches of rays inside solids: records `t_in f8, t_out f8, ray u4, inst u4, prim_in u4, prim_out u4`
/// in the order of `stretches`.
///
/// # Errors
/// [`Error::Io`].
pub fn write_stretches(path: &Path, stretches: &[Stretch]) -> Result<u64> {
    let numbers = ["t_in", "t_out"].map(|name| (name.to_owned(), "<f8".to_owned()));
    let ids = ["ray", "inst", "prim_in", "prim_out"].map(|name| (name.to_owned(), "<u4".to_owned()));
    let descr = Descr::Record(numbers.into_iter().chain(ids).collect());
    write_array(path, &descr, &[], stretches.chunks(4096), |chunk: &&[Stretch], bytes| {
        chunk.iter().for_each(|s| bytes.extend(stretch_record(s)));
        chunk.len()
    })
}

/// The bytes of a stretch in such a file.
pub fn stretch_record(s: &Stretch) -> impl Iterator<Item = u8> + use<> {
    let (ends, ids) = ([s.t_in, s.t_out], [s.ray, s.inst, s.prim_in, s.prim_out]);
    ends.into_iter().flat_map(f64::to_le_bytes).chain(ids.into_iter().flat_map(u32::to_le_bytes))
}

/// Writes flags of voxels as `|u1` of shape (nz, ny, nx): x runs fastest. `size` is nx, ny; `planes` have nx ny flags.
///
/// # Errors
/// [`Error::Io`].
pub fn write_voxels(path: &Path, size: [usize; 2], planes: impl IntoIterator<Item = Vec<u8>>) -> Result<u64> {
    let row = [size[1] as u64, size[0] as u64];
    write_array(path, &Descr::Plain("|u1".to_owned()), &row, planes, |plane, bytes| {
        bytes.extend_from_slice(plane);
        1
    })
}

/// Streams batches into an array of shape (N, `row`..). `encode` appends a batch's bytes and says how many rows they
/// are. N is known only at the end; the header has room for it, see [`header::bytes`].
fn write_array<B>(
    path: &Path,
    descr: &Descr,
    row: &[u64],
    batches: impl IntoIterator<Item = B>,
    encode: impl Fn(&B, &mut Vec<u8>) -> usize,
) -> Result<u64> {
    let shape = |count: u64| [&[count][..], row].concat();
    write_atomically(path, |w| {
        w.write_all(&header::bytes(descr, &shape(0)))?;
        let (mut count, mut bytes) = (0, Vec::new());
        for batch in batches {
            bytes.clear();
            count += encode(&batch, &mut bytes) as u64;
            w.write_all(&bytes)?;
        }
        w.seek(SeekFrom::Start(0))?;
        w.write_all(&header::bytes(descr, &shape(count)))?;
        Ok(count)
    })
}
