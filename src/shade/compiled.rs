//! Where shading is compiled: here, once for each precision.
//!
//! A generic function is compiled by the program that calls it, with that program's settings, and integrators are large ones: a
//! minute's work for every program, and slow code where it is not optimised. So what a batch of rays sees is behind functions
//! that are not generic.

use super::sample::Samples;
use super::shader::{Shader, Workspace};
use super::spot::Spots;
use crate::camera::Range;
use crate::ray::Rays;
use crate::trace::Engines;

/// A scalar type that shading is compiled for.
pub trait Shades: Engines {
    #[doc(hidden)]
    fn batch(
        shader: &Shader<'_, Self>,
        rays: &mut Rays<Self>,
        live: u64,
        spots: Spots<'_>,
        work: &mut Workspace<Self>,
        out: &mut Samples,
    );

    #[doc(hidden)]
    fn nothing(
        shader: &Shader<'_, Self>,
        range: &Range<Self>,
        count: u64,
        work: &mut Workspace<Self>,
        out: &mut Samples,
    ) -> bool;
}

macro_rules! compiled_for {
    ($($scalar:ty)*) => {$(
        impl Shades for $scalar {
            #[inline(never)]
            fn batch(
                shader: &Shader<'_, Self>,
                rays: &mut Rays<Self>,
                live: u64,
                spots: Spots<'_>,
                work: &mut Workspace<Self>,
                out: &mut Samples,
            ) {
                shader.batch(rays, live, spots, work, out);
            }

            #[inline(never)]
            fn nothing(
                shader: &Shader<'_, Self>,
                range: &Range<Self>,
                count: u64,
                work: &mut Workspace<Self>,
                out: &mut Samples,
            ) -> bool {
                shader.nothing(range, count, work, out)
            }
        }
    )*};
}

compiled_for!(f32 f64);

impl<S: Shades> Shader<'_, S> {
    /// What each ray of the primary batch `rays`, of which `live` are, sees, into `out` (made as long as the batch). Ray `i` is sample
    /// `spots.at(i)`. Dead rays see nothing. What the batch is afterwards is unspecified.
    pub fn shade(&self, rays: &mut Rays<S>, live: u64, spots: Spots<'_>, work: &mut Workspace<S>, out: &mut Samples) {
        S::batch(self, rays, live, spots, work, out);
    }

    /// What all of `count` rays see whose origins and directions lie in `range`, into `out`, as [`Self::shade`] does; false where
    /// they may meet something, or need not see the same. They count as traced: that they meet nothing is known.
    pub fn shade_void(&self, range: &Range<S>, count: u64, work: &mut Workspace<S>, out: &mut Samples) -> bool {
        S::nothing(self, range, count, work, out)
    }
}
