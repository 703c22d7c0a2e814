//! Finished tiles kept in a file, so that a render that was killed goes on where it was.
//!
//! The file is a head (a mark, and a digest of all that decides about the picture) and a record for each tile: its number, how long
//! its note is, the note (JSON: what the tile took), its pixels plane by plane as they are in memory, and a digest of all that. What a
//! killed process has left half written ends the file there.

use std::collections::{BTreeMap, BTreeSet};
use std::fs::{File, OpenOptions, TryLockError};
use std::io::{BufReader, Read, Seek, SeekFrom, Write};
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, OnceLock};

use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

use super::tally::Tally;
use crate::camera::Tiling;
use crate::error::{Error, Place, Result, locked};
use crate::film::{Film, Plane, PlaneData, Window};

/// What such a file begins with.
const MARK: &[u8; 8] = b"LCtiles1";
/// Bytes of a digest.
const DIGEST: usize = 32;
/// Bytes of a tile's number and of its note's length.
const NUMBERS: usize = 8;

/// Names and ids of what was seen, by layer of the mattes.
pub(super) type Names = [BTreeMap<String, u32>; 2];

/// Where finished tiles of a picture are kept.
#[derive(Debug)]
pub struct Keeper {
    path: PathBuf,
    /// The mark and the digest.
    head: Vec<u8>,
    found: OnceLock<usize>,
    trouble: OnceLock<String>,
}

impl Keeper {
    /// In the file `path`, for the picture that `of` tells apart from all others: whatever decides about its bits.
    pub fn new(path: PathBuf, of: &str) -> Self {
        let head = [&MARK[..], &Sha256::digest(of)[..]].concat();
        Self { path, head, found: OnceLock::new(), trouble: OnceLock::new() }
    }

    /// The file.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// How many tiles the file held.
    pub fn found(&self) -> usize {
        self.found.get().copied().unwrap_or(0)
    }

    /// Why tiles could not be kept any more, if so. The picture is none the worse.
    pub fn trouble(&self) -> Option<&str> {
        self.trouble.get().map(String::as_str)
    }

    /// Removes the file: the picture is finished.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub fn remove(&self) -> Result<()> {
        std::fs::remove_file(&self.path).map_err(|e| Error::io(&self.path, e))
    }

    /// Opens the file, makes it if there is none, and paints the tiles that it holds.
    pub(super) fn open(&self, film: &mut Film, tiling: &Tiling, tiles: &[u32]) -> Result<Kept<'_>> {
        let io = |e| Error::io(&self.path, e);
        let mut file =
            OpenOptions::new().read(true).write(true).create(true).truncate(false).open(&self.path).map_err(io)?;
        // Where files cannot be locked nobody is kept out.
        if let Err(TryLockError::WouldBlock) = file.try_lock() {
            return Err(Error::Usage(format!("{}: another render is writing it", self.path.display())));
        }
        let length = file.metadata().map_err(io)?.len();
        let mut kept = Kept { keeper: self, file: Mutex::new(None), done: BTreeSet::new(), note: Note::default() };
        let mut end = self.check_head(&file, length)?;
        if end == 0 {
            file.set_len(0).and_then(|()| file.rewind()).and_then(|()| file.write_all(&self.head)).map_err(io)?;
            end = self.head.len() as u64;
        }
        file.seek(SeekFrom::Start(end)).map_err(io)?;
        let mut wanted: BTreeSet<u32> = tiles.iter().copied().collect();
        let mut reader = BufReader::new(&file);
        while let Some((number, record)) = read_record(&mut reader, length.saturating_sub(end), film, tiling, &wanted) {
            let (note, pixels) = record.split();
            let Ok(note) = serde_json::from_slice::<Note>(note) else { break };
            paint(film, &part(film.window, tiling, number), pixels);
            kept.note.add(note);
            wanted.remove(&number);
            kept.done.insert(number);
            end += record.0.len() as u64;
        }
        file.set_len(end).and_then(|()| file.seek(SeekFrom::Start(end))).map_err(io)?;
        self.found.set(kept.done.len()).ok();
        kept.file = Mutex::new(Some(file));
        Ok(kept)
    }

    /// Where records begin; 0 if there is no whole head.
    fn check_head(&self, file: &File, length: u64) -> Result<u64> {
        let mut head = Vec::new();
        file.take(self.head.len() as u64).read_to_end(&mut head).map_err(|e| Error::io(&self.path, e))?;
        if head == self.head {
            return Ok(head.len() as u64);
        }
        let is_torn = length < self.head.len() as u64 && MARK.starts_with(&head[..head.len().min(MARK.len())]);
        if is_torn {
            return Ok(0);
        }
        if !head.starts_with(MARK) {
            return Err(Error::input(
                &self.path,
                Place::Whole,
                "expected the finished tiles of a picture, which --resume keeps there",
            ));
        }
        Err(Error::Usage(format!(
            "{} holds tiles of another picture: another scene, other options, or another build of the program. Remove it, or \
             give --resume with what it was made by",
            self.path.display()
        )))
    }
}

/// What a tile took, or all together.
#[derive(Default, Serialize, Deserialize)]
struct Note {
    /// Since the beginning of the picture, without the time in between.
    seconds: f64,
    tally: Tally,
    names: Names,
}

impl Note {
    fn add(&mut self, other: Self) {
        self.seconds = self.seconds.max(other.seconds);
        self.tally = std::mem::take(&mut self.tally).plus(other.tally);
        self.names.iter_mut().zip(other.names).for_each(|(all, more)| all.extend(more));
    }
}

/// The open file, and what it held.
pub(super) struct Kept<'a> {
    keeper: &'a Keeper,
    /// None any more after it could not be written.
    file: Mutex<Option<File>>,
    /// Tiles that are painted.
    pub done: BTreeSet<u32>,
    note: Note,
}

impl Kept<'_> {
    /// What the painted tiles took: seconds, and all else.
    pub fn before(&mut self) -> (f64, Tally, Names) {
        let Note { seconds, tally, names } = std::mem::take(&mut self.note);
        (seconds, tally, names)
    }

    /// Keeps tile `number` as it is in `film`.
    pub fn keep(
        &self,
        (number, tiling): (u32, &Tiling),
        film: &Mutex<Film>,
        (seconds, tally, names): (f64, &Tally, Names),
    ) {
        let note = serde_json::json!({ "seconds": seconds, "tally": tally, "names": names }).to_string();
        let mut record = number.to_le_bytes().to_vec();
        record.extend((note.len() as u32).to_le_bytes());
        record.extend(note.as_bytes());
        {
            let film = locked(film);
            let part = part(film.window, tiling, number);
            film.planes
                .iter()
                .for_each(|plane| rows(film.window, &part).for_each(|row| record.extend(bytes(plane, row))));
        }
        record.extend(Sha256::digest(&record));
        let mut file = locked(&self.file);
        if let Some(Err(e)) = file.as_mut().map(|file| file.write_all(&record)) {
            self.keeper.trouble.set(format!("{}: {e}", self.keeper.path.display())).ok();
            *file = None;
        }
    }
}

/// A whole record, with its digest.
struct Record(Vec<u8>, usize);

impl Record {
    /// The note and the pixels.
    fn split(&self) -> (&[u8], &[u8]) {
        self.0[NUMBERS..self.0.len() - DIGEST].split_at(self.1)
    }
}

/// The next record of a `wanted` tile, and its number; `None` if there is no whole one in the `rest` bytes that are left.
fn read_record(
    reader: &mut impl Read,
    rest: u64,
    film: &Film,
    tiling: &Tiling,
    wanted: &BTreeSet<u32>,
) -> Option<(u32, Record)> {
    let mut record = vec![0; NUMBERS];
    reader.read_exact(&mut record).ok()?;
    let [number, note] =
        [0, 4].map(|at| u32::from_le_bytes([record[at], record[at + 1], record[at + 2], record[at + 3]]));
    if !wanted.contains(&number) {
        return None;
    }
    let pixels =
        part(film.window, tiling, number).area() * film.planes.iter().map(|plane| size(plane) as u64).sum::<u64>();
    let length = NUMBERS as u64 + u64::from(note) + pixels + DIGEST as u64;
    if length > rest {
        return None;
    }
    record.resize(length as usize, 0);
    reader.read_exact(&mut record[NUMBERS..]).ok()?;
    let (content, digest) = record.split_at(record.len() - DIGEST);
    (Sha256::digest(content)[..] == *digest).then_some((number, Record(record, note as usize)))
}

/// The part of a window that a tile covers.
fn part(window: Window, tiling: &Tiling, number: u32) -> Window {
    let ((x, y), edge) = (tiling.origin(number), tiling.edge());
    let end = |from: u32, to: u32| from.saturating_add(edge).min(to);
    Window { x0: x.max(window.x0), y0: y.max(window.y0), x1: end(x, window.x1), y1: end(y, window.y1) }
}

/// Places of the rows of a part of a window.
fn rows(window: Window, part: &Window) -> impl Iterator<Item = Range<usize>> {
    let (x0, width) = (part.x0, part.width() as usize);
    (part.y0..part.y1).filter_map(move |y| window.index(x0, y)).map(move |first| first..first + width)
}

/// Bytes of a sample.
fn size(plane: &Plane) -> usize {
    match plane.data {
        PlaneData::F32(_) | PlaneData::U32(_) => 4,
        PlaneData::U8(_) => 1,
    }
}

fn bytes(plane: &Plane, row: Range<usize>) -> &[u8] {
    match &plane.data {
        PlaneData::F32(data) => bytemuck::cast_slice(&data[row]),
        PlaneData::U32(data) => bytemuck::cast_slice(&data[row]),
        PlaneData::U8(data) => &data[row],
    }
}

/// Puts the pixels of a part, as many as it has, into a film.
fn paint(film: &mut Film, part: &Window, mut pixels: &[u8]) {
    let window = film.window;
    for plane in &mut film.planes {
        for row in rows(window, part) {
            let to: &mut [u8] = match &mut plane.data {
                PlaneData::F32(data) => bytemuck::cast_slice_mut(&mut data[row]),
                PlaneData::U32(data) => bytemuck::cast_slice_mut(&mut data[row]),
                PlaneData::U8(data) => &mut data[row],
            };
            let (own, others) = pixels.split_at(to.len());
            to.copy_from_slice(own);
            pixels = others;
        }
    }
}
