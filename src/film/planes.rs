//! A film is a set of named planes over one data window.

use crate::error::{Error, Result};

/// Names of the colour planes: linear, Rec. 709 primaries, premultiplied by [`ALPHA`] where that exists.
pub const COLOR: [&str; 3] = ["R", "G", "B"];
/// Name of the coverage plane, 0 to 1.
pub const ALPHA: &str = "A";
/// Name of the depth plane, scene units, infinity where nothing was hit.
pub const DEPTH: &str = "Z";
/// Names of the shading normal's planes, world space.
pub const NORMAL: [&str; 3] = ["N.X", "N.Y", "N.Z"];
/// Names of the surface colour's planes.
pub const ALBEDO: [&str; 3] = ["albedo.R", "albedo.G", "albedo.B"];
/// Name of the instance number's plane (u32; `INVALID_ID` where nothing was hit).
pub const INSTANCE_ID: &str = "id.instance";
/// Name of the primitive number's plane (u32; `INVALID_ID` where nothing was hit).
pub const PRIMITIVE_ID: &str = "id.primitive";
/// Name of the plane that counts tree nodes visited per pixel.
pub const NODE_COST: &str = "cost.nodes";

/// EXR's limit for names, in bytes.
const MAX_NAME: usize = 255;

/// A rectangle of pixels, half open: x0 <= x < x1, y0 <= y < y1; y points down.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Window {
    /// First column.
    pub x0: u32,
    /// First row.
    pub y0: u32,
    /// Column after the last.
    pub x1: u32,
    /// Row after the last.
    pub y1: u32,
}

impl Window {
    /// The whole picture.
    pub fn full(width: u32, height: u32) -> Self {
        Self { x0: 0, y0: 0, x1: width, y1: height }
    }

    /// Columns; 0 if the window is empty or inside out.
    pub fn width(&self) -> u32 {
        self.x1.saturating_sub(self.x0)
    }

    /// Rows; 0 if the window is empty or inside out.
    pub fn height(&self) -> u32 {
        self.y1.saturating_sub(self.y0)
    }

    /// Number of pixels.
    pub fn area(&self) -> u64 {
        u64::from(self.width()) * u64::from(self.height())
    }

    /// Index of pixel (x, y) in a plane over this window, if it is inside.
    pub fn index(&self, x: u32, y: u32) -> Option<usize> {
        let inside = (self.x0..self.x1).contains(&x) && (self.y0..self.y1).contains(&y);
        inside.then(|| (y - self.y0) as usize * self.width() as usize + (x - self.x0) as usize)
    }
}

/// The samples of a plane, row-major over the data window, top row first.
#[derive(Clone, Debug, PartialEq)]
pub enum PlaneData {
    /// Floating point.
    F32(Vec<f32>),
    /// Numbers (ids).
    U32(Vec<u32>),
    /// Levels of a `.pix` picture: linear values, 255 is one (see [`super::pix::level`]).
    U8(Vec<u8>),
}

impl PlaneData {
    /// Number of samples.
    pub fn len(&self) -> usize {
        match self {
            Self::F32(v) => v.len(),
            Self::U32(v) => v.len(),
            Self::U8(v) => v.len(),
        }
    }

    /// Whether there is no sample.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }
}

/// One channel of a film.
#[derive(Clone, Debug, PartialEq)]
pub struct Plane {
    /// Name as other programs expect it in an EXR file, e.g. `R`, `N.X`, `id.instance`.
    pub name: String,
    /// Samples.
    pub data: PlaneData,
}

/// Pixels of a picture, or of a crop of it.
///
/// Invariants (see [`Film::validate`]): the window is not empty and lies inside the picture; every plane covers the
/// window exactly; names are unique.
#[derive(Clone, Debug, PartialEq)]
pub struct Film {
    /// Width of the whole picture (EXR: display window) in pixels.
    pub width: u32,
    /// Height of the whole picture in pixels.
    pub height: u32,
    /// The part of the picture that the planes cover (EXR: data window).
    pub window: Window,
    /// The planes, in any order.
    pub planes: Vec<Plane>,
    /// What the planes mean, as names and values, for formats that keep such texts (EXR: attributes).
    pub texts: Vec<(String, String)>,
}

impl Film {
    /// A film without planes.
    ///
    /// # Errors
    /// [`Error::Usage`] if the window is empty or not inside the picture.
    pub fn new(width: u32, height: u32, window: Window) -> Result<Self> {
        let film = Self { width, height, window, planes: Vec::new(), texts: Vec::new() };
        film.validate()?;
        Ok(film)
    }

    /// A film without planes over the whole picture.
    ///
    /// # Errors
    /// [`Error::Usage`] if the picture has no pixel.
    pub fn full(width: u32, height: u32) -> Result<Self> {
        Self::new(width, height, Window::full(width, height))
    }

    /// Number of samples of each plane.
    pub fn pixels(&self) -> usize {
        self.window.width() as usize * self.window.height() as usize
    }

    /// Adds a plane.
    ///
    /// # Errors
    /// [`Error::Usage`] if its name is taken or unusable, or its length is not the window's area.
    pub fn push(&mut self, name: impl Into<String>, data: PlaneData) -> Result<()> {
        let plane = Plane { name: name.into(), data };
        if self.plane(&plane.name).is_some() {
            return Err(Error::Usage(format!("the film already has a plane `{}`", plane.name)));
        }
        self.check_plane(&plane)?;
        self.planes.push(plane);
        Ok(())
    }

    /// The plane called `name`.
    pub fn plane(&self, name: &str) -> Option<&Plane> {
        self.planes.iter().find(|p| p.name == name)
    }

    /// Samples of the float plane called `name`.
    pub fn f32_plane(&self, name: &str) -> Option<&[f32]> {
        match &self.plane(name)?.data {
            PlaneData::F32(v) => Some(v),
            PlaneData::U32(_) | PlaneData::U8(_) => None,
        }
    }

    /// Samples of the number plane called `name`.
    pub fn u32_plane(&self, name: &str) -> Option<&[u32]> {
        match &self.plane(name)?.data {
            PlaneData::U32(v) => Some(v),
            PlaneData::F32(_) | PlaneData::U8(_) => None,
        }
    }

    /// Samples of the plane of levels called `name`.
    pub fn u8_plane(&self, name: &str) -> Option<&[u8]> {
        match &self.plane(name)?.data {
            PlaneData::U8(v) => Some(v),
            PlaneData::F32(_) | PlaneData::U32(_) => None,
        }
    }

    /// Samples of the float plane called `name`, to be changed.
    pub fn f32_plane_mut(&mut self, name: &str) -> Option<&mut [f32]> {
        match &mut self.planes.iter_mut().find(|p| p.name == name)?.data {
            PlaneData::F32(v) => Some(v),
            PlaneData::U32(_) | PlaneData::U8(_) => None,
        }
    }

    /// Samples of the number plane called `name`, to be changed.
    pub fn u32_plane_mut(&mut self, name: &str) -> Option<&mut [u32]> {
        match &mut self.planes.iter_mut().find(|p| p.name == name)?.data {
            PlaneData::U32(v) => Some(v),
            PlaneData::F32(_) | PlaneData::U8(_) => None,
        }
    }

    /// The three colour planes.
    ///
    /// # Errors
    /// [`Error::Usage`] that names the first one missing.
    pub fn color(&self) -> Result<[&[f32]; 3]> {
        let get = |name: &str| {
            self.f32_plane(name).ok_or_else(|| Error::Usage(format!("the film has no float plane `{name}`")))
        };
        Ok([get(COLOR[0])?, get(COLOR[1])?, get(COLOR[2])?])
    }

    /// Checks the invariants; writers call it first.
    ///
    /// # Errors
    /// [`Error::Usage`] that says which one is broken.
    pub fn validate(&self) -> Result<()> {
        let w = self.window;
        if w.area() == 0 || w.x1 > self.width || w.y1 > self.height {
            return Err(Error::Usage(format!(
                "data window {},{} to {},{} is empty or not inside the picture of {}x{}",
                w.x0, w.y0, w.x1, w.y1, self.width, self.height
            )));
        }
        let mut names: Vec<&str> = self.planes.iter().map(|p| p.name.as_str()).collect();
        names.sort_unstable();
        if let Some(pair) = names.windows(2).find(|pair| pair[0] == pair[1]) {
            return Err(Error::Usage(format!("the film has two planes `{}`", pair[0])));
        }
        self.planes.iter().try_for_each(|plane| self.check_plane(plane))
    }

    fn check_plane(&self, plane: &Plane) -> Result<()> {
        let name = &plane.name;
        // EXR keeps names as zero-terminated bytes, one per character.
        let storable = |c: char| c != '\0' && u32::from(c) <= 0xff;
        if name.is_empty() || name.chars().count() > MAX_NAME || !name.chars().all(storable) {
            return Err(Error::Usage(format!("`{}` cannot name a plane", name.escape_debug())));
        }
        if plane.data.len() as u64 != self.window.area() {
            let (has, wants) = (plane.data.len(), self.window.area());
            return Err(Error::Usage(format!("plane `{name}` has {has} samples, expected {wants}")));
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn window_counts_and_indexes_half_open() {
        let w = Window { x0: 2, y0: 1, x1: 5, y1: 3 };
        assert_eq!((w.width(), w.height(), w.area()), (3, 2, 6));
        assert_eq!(w.index(2, 1), Some(0));
        assert_eq!(w.index(4, 2), Some(5));
        assert_eq!((w.index(5, 2), w.index(4, 3), w.index(1, 1), w.index(2, 0)), (None, None, None, None));
        let inside_out = Window { x0: 5, y0: 0, x1: 2, y1: 9 };
        assert_eq!((inside_out.area(), inside_out.index(3, 3)), (0, None));
        assert_eq!(Window::full(u32::MAX, u32::MAX).area(), u64::from(u32::MAX) * u64::from(u32::MAX));
    }

    #[test]
    fn broken_films_are_refused() {
        assert!(Film::full(0, 4).is_err());
        assert!(Film::new(4, 4, Window { x0: 2, y0: 0, x1: 5, y1: 4 }).is_err());
        assert!(Film::new(4, 4, Window { x0: 3, y0: 0, x1: 3, y1: 4 }).is_err());
        let mut film = Film::full(2, 2).unwrap();
        film.push("R", PlaneData::F32(vec![0.0; 4])).unwrap();
        assert!(film.push("R", PlaneData::F32(vec![0.0; 4])).unwrap_err().to_string().contains("already"));
        assert!(film.push("G", PlaneData::F32(vec![0.0; 3])).unwrap_err().to_string().contains("expected 4"));
        for name in ["", "a\0b", "\u{1f4f7}", &"x".repeat(256)] {
            assert!(film.push(name, PlaneData::U32(vec![0; 4])).is_err(), "{name:?}");
        }
        film.planes.push(film.planes[0].clone());
        assert!(film.validate().unwrap_err().to_string().contains("two planes `R`"));
    }

    #[test]
    fn planes_are_found_by_name_and_type() {
        let mut film = Film::full(2, 1).unwrap();
        film.push(DEPTH, PlaneData::F32(vec![1.0, 2.0])).unwrap();
        film.push(INSTANCE_ID, PlaneData::U32(vec![7, 8])).unwrap();
        assert_eq!(film.f32_plane(DEPTH), Some(&[1.0, 2.0][..]));
        assert_eq!(film.u32_plane(DEPTH), None);
        film.u32_plane_mut(INSTANCE_ID).unwrap()[1] = 9;
        film.f32_plane_mut(DEPTH).unwrap()[0] = 3.0;
        assert_eq!(film.u32_plane(INSTANCE_ID), Some(&[7, 9][..]));
        assert_eq!(film.f32_plane(DEPTH), Some(&[3.0, 2.0][..]));
        assert!(film.color().unwrap_err().to_string().contains("`R`"));
    }
}
