//! The order of pixels: square tiles row by row, Morton order inside.
//!
//! With tiles of 32 this is the order of ray files: 4, 16, 64, 256 and 1024 aligned consecutive rays are square
//! blocks of pixels. Tiles at the right and lower edge reach over the picture; what lies outside has an index but
//! no pixel (its ray is dead), so all tiles have the same number of rays.

use crate::error::{Error, Result};

/// Tile edge of ray files, pixels.
pub const FILE_TILE: u32 = 32;

/// Largest picture edge, pixels.
const MAX_EDGE: u32 = 1 << 16;

/// Most pixels that are held at once: a film of 12 planes then takes 12 GiB, the primary rays of a view and their hits some more.
pub const MAX_PIXELS: u64 = 1 << 28;

/// A rectangle of pixels, half open: x0 <= x < x1, y0 <= y < y1; y down.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PixelRect {
    /// First column.
    pub x0: u32,
    /// First row.
    pub y0: u32,
    /// Column after the last.
    pub x1: u32,
    /// Row after the last.
    pub y1: u32,
}

impl PixelRect {
    /// Whether pixel (x, y) is inside.
    pub fn contains(&self, x: u32, y: u32) -> bool {
        x >= self.x0 && x < self.x1 && y >= self.y0 && y < self.y1
    }
}

/// A picture cut into square tiles.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Tiling {
    width: u32,
    height: u32,
    edge: u32,
}

impl Tiling {
    /// A picture of `width` x `height` pixels in tiles of `edge` x `edge`.
    ///
    /// # Errors
    /// A usage error if a side is 0 or above 65536 pixels, or `edge` is not 8, 16 or 32.
    pub fn new(width: u32, height: u32, edge: u32) -> Result<Self> {
        if width == 0 || height == 0 || width > MAX_EDGE || height > MAX_EDGE {
            return Err(Error::Usage(format!("a picture of {width}x{height} pixels: sides must be 1 to {MAX_EDGE}")));
        }
        if ![8, 16, 32].contains(&edge) {
            return Err(Error::Usage(format!("tiles of {edge} pixels: expected 8, 16 or 32")));
        }
        Ok(Self { width, height, edge })
    }

    /// Width of the picture in pixels.
    pub fn width(&self) -> u32 {
        self.width
    }

    /// Height of the picture in pixels.
    pub fn height(&self) -> u32 {
        self.height
    }

    /// Tile edge in pixels.
    pub fn edge(&self) -> u32 {
        self.edge
    }

    /// Tiles in a row.
    pub fn columns(&self) -> u32 {
        self.width.div_ceil(self.edge)
    }

    /// Rows of tiles.
    pub fn rows(&self) -> u32 {
        self.height.div_ceil(self.edge)
    }

    /// Number of tiles.
    pub fn tiles(&self) -> u32 {
        self.columns() * self.rows()
    }

    /// Indices per tile, dead ones included.
    pub fn rays_per_tile(&self) -> u32 {
        self.edge * self.edge
    }

    /// Number of indices, dead ones included.
    pub fn rays(&self) -> u64 {
        u64::from(self.tiles()) * u64::from(self.rays_per_tile())
    }

    /// Upper left pixel of tile number `tile`.
    pub fn origin(&self, tile: u32) -> (u32, u32) {
        (tile % self.columns() * self.edge, tile / self.columns() * self.edge)
    }

    /// The pixel with this index, `None` if it lies outside the picture.
    pub fn pixel(&self, index: u64) -> Option<(u32, u32)> {
        if index >= self.rays() {
            return None;
        }
        let tile = (index / u64::from(self.rays_per_tile())) as u32;
        let (x0, y0) = self.origin(tile);
        let (dx, dy) = morton_decode((index % u64::from(self.rays_per_tile())) as u32);
        let (x, y) = (x0 + dx, y0 + dy);
        (x < self.width && y < self.height).then_some((x, y))
    }

    /// The index of a pixel of the picture.
    pub fn index(&self, x: u32, y: u32) -> u64 {
        let tile = u64::from(y / self.edge) * u64::from(self.columns()) + u64::from(x / self.edge);
        tile * u64::from(self.rays_per_tile()) + u64::from(morton_encode(x % self.edge, y % self.edge))
    }

    /// Numbers of the tiles that share a pixel with `rect`, in order.
    pub fn tiles_in(&self, rect: PixelRect) -> Vec<u32> {
        let (x1, y1) = (rect.x1.min(self.width), rect.y1.min(self.height));
        if rect.x0 >= x1 || rect.y0 >= y1 {
            return Vec::new();
        }
        let columns = rect.x0 / self.edge..x1.div_ceil(self.edge);
        let rows = rect.y0 / self.edge..y1.div_ceil(self.edge);
        rows.flat_map(|row| columns.clone().map(move |column| row * self.columns() + column)).collect()
    }
}

/// Position (x, y) of number `i` on the Morton curve: x from the even bits, y from the odd ones.
#[inline]
pub fn morton_decode(i: u32) -> (u32, u32) {
    (even_bits(i), even_bits(i >> 1))
}

/// Number of (x, y) on the Morton curve, x and y below 2^16. Source: G. M. Morton, *A Computer Oriented Geodetic
/// Data Base and a New Technique in File Sequencing*, 1966.
#[inline]
pub fn morton_encode(x: u32, y: u32) -> u32 {
    spread_bits(x) | spread_bits(y) << 1
}

#[inline]
fn even_bits(i: u32) -> u32 {
    let mut x = i & 0x5555_5555;
    x = (x | x >> 1) & 0x3333_3333;
    x = (x | x >> 2) & 0x0f0f_0f0f;
    x = (x | x >> 4) & 0x00ff_00ff;
    (x | x >> 8) & 0x0000_ffff
}

#[inline]
fn spread_bits(i: u32) -> u32 {
    let mut x = i & 0x0000_ffff;
    x = (x | x << 8) & 0x00ff_00ff;
    x = (x | x << 4) & 0x0f0f_0f0f;
    x = (x | x << 2) & 0x3333_3333;
    (x | x << 1) & 0x5555_5555
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn indices_and_pixels_are_a_bijection() {
        for (width, height) in [(1, 1), (17, 31), (1920, 1080)] {
            for edge in [8, 16, 32] {
                let tiling = Tiling::new(width, height, edge).unwrap();
                let mut seen = vec![false; (width * height) as usize];
                for index in 0..tiling.rays() {
                    let Some((x, y)) = tiling.pixel(index) else { continue };
                    assert_eq!(tiling.index(x, y), index);
                    let cell = &mut seen[(y * width + x) as usize];
                    assert!(!*cell, "pixel {x},{y} has two indices");
                    *cell = true;
                }
                assert!(seen.iter().all(|&s| s));
                assert_eq!((tiling.pixel(tiling.rays()), tiling.pixel(u64::MAX)), (None, None));
            }
        }
    }

    #[test]
    fn aligned_runs_are_square_blocks() {
        let tiling = Tiling::new(96, 64, FILE_TILE).unwrap();
        for (run, edge) in [(4, 2), (16, 4), (64, 8), (256, 16), (1024, 32)] {
            for first in (0..tiling.rays()).step_by(run) {
                let (x0, y0) = tiling.pixel(first).unwrap();
                assert_eq!((x0 % edge, y0 % edge), (0, 0));
                let pixels: Vec<_> = (first..first + run as u64).map(|i| tiling.pixel(i).unwrap()).collect();
                assert!(pixels.iter().all(|&(x, y)| x - x0 < edge && y - y0 < edge));
            }
        }
    }

    #[test]
    fn morton_numbers_by_hand() {
        assert_eq!([0, 1, 2, 3, 4, 8].map(morton_decode), [(0, 0), (1, 0), (0, 1), (1, 1), (2, 0), (0, 2)]);
        assert_eq!(morton_encode(5, 3), 0b01_1011);
        assert_eq!(morton_decode(0b01_1011), (5, 3));
    }

    #[test]
    fn tiles_of_a_crop() {
        let tiling = Tiling::new(100, 70, 32).unwrap();
        assert_eq!((tiling.columns(), tiling.rows()), (4, 3));
        assert_eq!(tiling.tiles_in(PixelRect { x0: 31, y0: 32, x1: 33, y1: 64 }), [4, 5]);
        assert_eq!(tiling.tiles_in(PixelRect { x0: 0, y0: 0, x1: u32::MAX, y1: u32::MAX }).len(), 12);
        assert!(tiling.tiles_in(PixelRect { x0: 5, y0: 5, x1: 5, y1: 9 }).is_empty());
        assert!(Tiling::new(0, 1, 32).is_err() && Tiling::new(1, 1, 12).is_err() && Tiling::new(70000, 1, 8).is_err());
    }
}
