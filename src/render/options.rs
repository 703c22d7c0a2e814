//! What to render, and who watches.

use super::aov::Aov;
use super::mattes;
use crate::camera::{Filter, MAX_PIXELS, PixelRect, SubPixel, Tiling};
use crate::error::{Error, Result};
use crate::film::Window;
use crate::shade::{Integrator, Settings};

/// Most pixels whose sums are all kept in memory (2 GiB).
const MAX_ADAPTIVE: u64 = 1 << 23;
/// Most samples per pixel and occlusion rays per hit; more is a slip of the keyboard.
const MAX_SAMPLES: u32 = 1 << 20;
/// Most mirrors of a path.
const MAX_DEPTH: u32 = 1 << 10;

/// What to render. Precision is the type parameter of [`super::render`], threads are those of the current rayon
/// pool.
#[derive(Clone, Debug, PartialEq)]
pub struct RenderOptions {
    /// Width of the whole picture, pixels.
    pub width: u32,
    /// Height of the whole picture, pixels.
    pub height: u32,
    /// Part of it to render (y down, half open); `None` is all.
    pub crop: Option<Window>,
    /// Samples per pixel, at most: 1 goes through the centre (not of paths), more are spread over the pixel. Unless told otherwise,
    /// `lanecast render` takes 64 with [`Integrator::Path`] and 1 with others; the default here is 1.
    pub spp: u32,
    /// How samples are placed around the pixel's centre.
    pub filter: Filter,
    /// Stop adding samples after that many seconds (not before the first one of each pixel).
    pub time_limit: Option<f64>,
    /// Stop adding samples to a tile when the error of its mean brightness, relative, is estimated below this; of paths, those
    /// of the tiles around it too, and not before there are samples enough to tell.
    pub noise: Option<f64>,
    /// Seed of the random numbers.
    pub seed: u64,
    /// What is shown.
    pub integrator: Integrator,
    /// Name of the engine.
    pub engine: String,
    /// Tile edge: 8, 16 or 32 pixels. With the generic engines it changes no bit of the picture.
    pub tile: u32,
    /// Levels of mirrored and refracted rays that are followed; scatterings of a path. Unless told otherwise, `lanecast render` takes
    /// [`Integrator::depth`] of the integrator; the default here is that of the default integrator, which is little for paths.
    pub depth: u32,
    /// Occlusion rays per hit.
    pub ao_samples: u32,
    /// Length of occlusion rays as a fraction of the diagonal of the scene's bounds.
    pub ao_radius: f64,
    /// Extra planes.
    pub aovs: Vec<Aov>,
    /// If set, colours are levels ([`crate::film::PlaneData::U8`]) of radiance times two to this power instead of floats, and
    /// there is no coverage: all that a `.pix` picture holds, in a fifth of the memory.
    pub levels: Option<f32>,
    /// Whether the engine counts its work (slower).
    pub count: bool,
}

impl Default for RenderOptions {
    fn default() -> Self {
        Self {
            width: 960,
            height: 540,
            crop: None,
            spp: 1,
            filter: Filter::Box,
            time_limit: None,
            noise: None,
            seed: 0,
            integrator: Integrator::default(),
            engine: "auto".into(),
            tile: 32,
            depth: Integrator::default().depth(),
            ao_samples: 16,
            ao_radius: 0.2,
            aovs: Vec::new(),
            levels: None,
            count: false,
        }
    }
}

impl RenderOptions {
    /// Names of the picture's planes besides the colours, in the order of the film's.
    pub fn planes(&self) -> Vec<String> {
        let planes = |aov: Aov| -> Vec<String> {
            match aov {
                Aov::Cryptomatte => mattes::planes().collect(),
                _ => aov.channels().iter().map(|channel| channel.name.into()).collect(),
            }
        };
        Aov::ALL.into_iter().filter(|aov| self.aovs.contains(aov)).flat_map(planes).collect()
    }

    /// The tiles of the picture, and the window to render, checked.
    ///
    /// # Errors
    /// A usage error that names the option: sizes, crop and counts out of range.
    pub fn check(&self) -> Result<(Tiling, Window)> {
        let fail = |what: String| Err(Error::Usage(what));
        let tiling = Tiling::new(self.width, self.height, self.tile)?;
        let window = self.crop.unwrap_or(Window::full(self.width, self.height));
        let Window { x0, y0, x1, y1 } = window;
        if x0 >= x1 || y0 >= y1 || x1 > self.width || y1 > self.height {
            let (width, height) = (self.width, self.height);
            return fail(format!("crop {x0},{y0},{x1},{y1} is empty or leaves the picture of {width}x{height}"));
        }
        if window.area() > MAX_PIXELS {
            return fail(format!("more than {MAX_PIXELS} pixels in one film; render crops"));
        }
        if self.spp == 0 || self.spp > MAX_SAMPLES {
            return fail(format!("{} samples per pixel: expected 1 to {MAX_SAMPLES}", self.spp));
        }
        if self.ao_samples == 0 || self.ao_samples > MAX_SAMPLES {
            return fail(format!("{} occlusion rays per hit: expected 1 to {MAX_SAMPLES}", self.ao_samples));
        }
        for (name, number) in [("time limit", self.time_limit), ("noise", self.noise)] {
            if number.is_some_and(|x| x.is_nan() || x <= 0.0) {
                return fail(format!("{name} {}: expected a positive number", number.unwrap_or_default()));
            }
        }
        if self.is_adaptive() && window.area() > MAX_ADAPTIVE {
            return fail(format!("more than {MAX_ADAPTIVE} pixels with a time limit or a noise level; render crops"));
        }
        if self.depth > MAX_DEPTH {
            return fail(format!("depth {}: expected at most {MAX_DEPTH}", self.depth));
        }
        if self.ao_radius.is_nan() || self.ao_radius <= 0.0 {
            return fail(format!("occlusion radius {}: expected a positive number", self.ao_radius));
        }
        Ok((tiling, window))
    }

    /// Whether the number of samples is found while rendering.
    pub(super) fn is_adaptive(&self) -> bool {
        self.time_limit.is_some() || self.noise.is_some()
    }

    /// Where in its pixel sample number `sample` goes.
    pub fn sub_pixel(&self, sample: u32) -> SubPixel {
        let (seed, filter) = (self.seed, self.filter);
        if self.integrator == Integrator::Path || filter != Filter::Box {
            SubPixel::Filtered { sample, seed, filter }
        } else if self.spp == 1 {
            SubPixel::Anchor
        } else {
            SubPixel::Sample { sample, seed }
        }
    }

    pub(super) fn settings(&self) -> Settings {
        Settings {
            integrator: self.integrator,
            depth: self.depth,
            ao_samples: self.ao_samples,
            ao_radius: self.ao_radius,
            seed: self.seed,
            cost: self.integrator == Integrator::Cost || self.aovs.contains(&Aov::Cost),
            first_hits: !self.aovs.is_empty(),
            count: self.count,
            rays: u64::from(self.width) * u64::from(self.height) * u64::from(self.spp),
        }
    }
}

/// The same rectangle as the camera floor knows it.
pub(super) fn rect_of(window: Window) -> PixelRect {
    PixelRect { x0: window.x0, y0: window.y0, x1: window.x1, y1: window.y1 }
}

/// Who watches a render; called from all threads.
pub trait Progress: Sync {
    /// One more of `total` tiles is finished.
    fn tile_done(&self, total: u64);
    /// Whether to stop; asked before each tile and each further sample of it.
    fn stopped(&self) -> bool {
        false
    }
}

/// Nobody watches, nobody stops.
#[derive(Clone, Copy, Debug, Default)]
pub struct Silent;

impl Progress for Silent {
    fn tile_done(&self, _: u64) {}
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn options_out_of_range_are_refused() {
        let good = RenderOptions { width: 10, height: 10, ..Default::default() };
        assert!(good.check().is_ok());
        let window = |x0, y0, x1, y1| Some(Window { x0, y0, x1, y1 });
        let bad = [
            RenderOptions { width: 0, ..good.clone() },
            RenderOptions { width: 65536, height: 65536, ..good.clone() },
            RenderOptions { tile: 12, ..good.clone() },
            RenderOptions { spp: 0, ..good.clone() },
            RenderOptions { ao_samples: 0, ..good.clone() },
            RenderOptions { ao_radius: f64::NAN, ..good.clone() },
            RenderOptions { depth: u32::MAX, ..good.clone() },
            RenderOptions { crop: window(0, 0, 11, 10), ..good.clone() },
            RenderOptions { crop: window(5, 5, 5, 6), ..good.clone() },
        ];
        assert!(bad.iter().all(|options| options.check().is_err()));
        assert!(RenderOptions { crop: window(9, 9, 10, 10), ..good }.check().is_ok());
    }
}
