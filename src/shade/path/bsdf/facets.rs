//! Light that facets throw at each other: without it rough surfaces would be too dark.
//!
//! A lobe as wide as Lambert's, weighted by what is lost to both directions, holds it: (1 - E(wo)) (1 - E(wi)), E being
//! the albedo of single scattering. What a direction loses comes back, in metal coloured by the reflections between.
//! It is reciprocal, with the square of the index of refraction through glass.
//!
//! Source: C. Kulla, A. Conty, *Revisiting Physically Based Shading at Imageworks*, 2017. The colour of metal is as in
//! S. Hill, *A Multi-Faceted Exploration*, 2018: F^2 E / (1 - F (1 - E)) of the means F of Fresnel's term and E of the
//! albedo. Ours: the share of glass, so that reciprocity holds for any table.

use std::collections::HashMap;
use std::sync::{Arc, Mutex, PoisonError};

use rayon::prelude::*;

use super::curve::{Curve, by_facets, look_up, place};
use super::{fresnel, rows};
use crate::lanes::{Lanes, Lanes3, MAX_LANES, Real};

/// Tables that are kept from picture to picture.
const MOST_KEPT: usize = 1024;

/// What rough surface a material has; widths are GGX's alpha.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Rough {
    /// Metal of an index eta + i k of refraction.
    Metal {
        /// Width.
        alpha: f64,
        /// Real and imaginary part.
        index: [[f64; 3]; 2],
        /// Whether light that facets throw at each other is there.
        is_multiple: bool,
    },
    /// A boundary.
    Glass {
        /// Width.
        alpha: f64,
        /// Index of refraction behind it over that before it.
        eta: f64,
        /// As above.
        is_multiple: bool,
    },
    /// The coat of plastic.
    Coat {
        /// Width.
        alpha: f64,
        /// Index of refraction.
        eta: f64,
    },
}

/// Tables of a [`Rough`].
#[derive(Clone, Debug)]
pub struct Facets {
    /// Share that single scattering does not give back; of a coat what it does not mirror.
    front: Curve,
    /// The same from behind a boundary.
    back: Curve,
    /// Shares of what is lost that come back before and behind, over the mean loss there; of a coat only the latter.
    up: [f64; 3],
    down: f64,
    /// Chance that light thrown to and fro ends up before the surface; of a coat the share of light from below that
    /// comes back from it.
    chance: f64,
}

/// One of tables.
#[derive(Clone, Debug, Default)]
pub struct FacetsList(Vec<Arc<Facets>>);

impl Rough {
    /// Bits of all that a table depends on.
    fn key(&self) -> [u64; 9] {
        let mut key = [0; 9];
        match *self {
            Self::Metal { alpha, index: [eta, k], is_multiple } => {
                key[0] = u64::from(is_multiple);
                let numbers = [alpha].into_iter().chain(eta).chain(k);
                key[1..8].iter_mut().zip(numbers).for_each(|(bits, x)| *bits = x.to_bits());
            }
            Self::Glass { alpha, eta, is_multiple } => {
                (key[0], key[1], key[2]) = (2 + u64::from(is_multiple), alpha.to_bits(), eta.to_bits());
            }
            Self::Coat { alpha, eta } => (key[0], key[1], key[2]) = (4, alpha.to_bits(), eta.to_bits()),
        }
        key
    }
}

impl FacetsList {
    /// Those of `list`, in this order; also the tables for all widths, if `of_all_widths`.
    pub fn new(list: &[Rough], of_all_widths: bool) -> Self {
        if of_all_widths {
            rows::prepare();
        }
        static KEPT: Mutex<Option<HashMap<[u64; 9], Arc<Facets>>>> = Mutex::new(None);
        let kept = |key: &[u64; 9]| {
            let guard = KEPT.lock().unwrap_or_else(PoisonError::into_inner);
            guard.as_ref().and_then(|map| map.get(key).cloned())
        };
        let of = |rough: &Rough| kept(&rough.key()).unwrap_or_else(|| Arc::new(Facets::new(rough)));
        let all: Vec<Arc<Facets>> = list.par_iter().map(of).collect();
        let mut guard = KEPT.lock().unwrap_or_else(PoisonError::into_inner);
        let map = guard.get_or_insert_default();
        if map.len() + list.len() > MOST_KEPT {
            map.clear();
        }
        map.extend(list.iter().map(Rough::key).zip(all.iter().cloned()).take(MOST_KEPT));
        Self(all)
    }
}

impl Facets {
    fn new(rough: &Rough) -> Self {
        match *rough {
            Rough::Metal { alpha, is_multiple: false, .. } | Rough::Glass { alpha, is_multiple: false, .. } => {
                let none = Curve::zero(alpha);
                Self { front: none.clone(), back: none, up: [0.0; 3], down: 0.0, chance: 1.0 }
            }
            Rough::Metal { alpha, index: [eta, k], .. } => Self::metal(alpha, eta, k),
            Rough::Glass { alpha, eta, .. } => Self::glass(alpha, eta),
            Rough::Coat { alpha, eta } => Self::coat(alpha, eta),
        }
    }

    fn metal(alpha: f64, eta: [f64; 3], k: [f64; 3]) -> Self {
        let front = lost(alpha);
        let mean = front.mean();
        let up = [0, 1, 2].map(|c| {
            let f = fresnel::mean(|cos| fresnel::conductor(cos, eta[c], k[c]));
            repeated(f, mean) / mean
        });
        Self { back: Curve::zero(alpha), front, up, down: 0.0, chance: 1.0 }
    }

    fn glass(alpha: f64, eta: f64) -> Self {
        let side = |eta: f64| {
            Curve::new(alpha, move |cos| {
                let kept = by_facets(alpha, eta, cos, |met, up, down| {
                    let (r, _) = fresnel::dielectric(met, eta);
                    r * up + (1.0 - r) * down
                });
                (1.0 - kept).max(0.0)
            })
        };
        let (front, back) = (side(eta), side(1.0 / eta));
        // Let a share T be let through from the front, T' from the back: reciprocity asks that T over the mean loss
        // behind be eta^2 T' over the mean loss before. What a smooth boundary lets through has t = eta^2 t'.
        let (before, behind) = (front.mean(), back.mean());
        let outside = eta.max(1.0 / eta);
        let smooth = (1.0 - fresnel::dielectric_mean(outside)) * (eta / outside);
        let through = smooth * behind / before.max(behind);
        let up = (1.0 - through) / before;
        Self { front, back, up: [up; 3], down: through / behind, chance: 1.0 - through }
    }

    fn coat(alpha: f64, eta: f64) -> Self {
        let front = Curve::new(alpha, |cos| {
            1.0 - by_facets(alpha, eta, cos, |met, up, _| fresnel::dielectric(met, eta).0 * up)
        });
        let mean = front.mean();
        // As much light goes out through the coat as comes in, but for the square of the index.
        let inside = (1.0 - mean / (eta * eta)).clamp(0.0, 1.0);
        Self { back: Curve::zero(alpha), front, up: [0.0; 3], down: 1.0 / mean, chance: inside }
    }
}

/// Share of light that perfectly mirroring facets of width `alpha` do not give back at once, by the cosine.
fn lost(alpha: f64) -> Curve {
    Curve::new(alpha, |cos| (1.0 - by_facets(alpha, 1.5, cos, |_, up, _| up)).max(0.0))
}

/// Share of light lost to single scattering that comes back, if facets reflect the mean share `f` and lose the mean
/// share `loss`.
pub fn repeated<V: Lanes>(f: V, loss: V) -> V {
    let one = V::constant(1.0);
    f * f * (one - loss) / (one - f * loss)
}

/// A packet of [`Facets`].
pub struct PacketFacets<'t, V> {
    facets: [&'t Facets; MAX_LANES],
    /// Width of GGX.
    pub alpha: V,
    /// See [`Facets`].
    pub up: Lanes3<V>,
    /// See [`Facets`].
    pub down: V,
    /// See [`Facets`].
    pub chance: V,
}

impl<'t, V: Lanes> PacketFacets<'t, V> {
    /// Those of the numbers `index`.
    #[inline(always)]
    pub fn load(list: &'t FacetsList, index: V) -> Self {
        let mut numbers = [V::Scalar::ZERO; MAX_LANES];
        index.store(&mut numbers);
        let facets = numbers.map(|number| &*list.0[(number.to_f64() as usize).min(list.0.len() - 1)]);
        let load = |f: &dyn Fn(&Facets) -> f64| V::load(&facets.map(|facets| V::Scalar::from_f64(f(facets))));
        Self {
            facets,
            alpha: load(&|f| f.front.alpha()),
            up: [0, 1, 2].map(|c| load(&|f| f.up[c])),
            down: load(&|f| f.down),
            chance: load(&|f| f.chance),
        }
    }

    /// What is lost in a direction of cosine `cos` before the surface.
    #[inline(always)]
    pub fn lost(&self, cos: V) -> V {
        look_up(place(cos, self.alpha), |lane, cell, rest| self.facets[lane].front.at(cell, rest))
    }

    /// The same behind it.
    #[inline(always)]
    pub fn lost_behind(&self, cos: V) -> V {
        look_up(place(cos, self.alpha), |lane, cell, rest| self.facets[lane].back.at(cell, rest))
    }
}
