//! Where paths enter regions: what the regions look like there, in lanes.

use super::Rt;
use super::level::{Found, vector};
use super::material::RtMaterial;
use super::parameters::{uv, uv_of_arb};
use super::pattern::Pattern;
use crate::lanes::chosen::positions_in;
use crate::lanes::{Column, LaneMask, Lanes, Lanes3, MAX_LANES, Real, each, space};
use crate::scene::world::World;

/// What the paths of a level show where they enter regions, parallel to its rays.
#[derive(Clone, Debug, Default)]
pub(super) struct Meetings<S> {
    /// Of each vector of lanes.
    pub kinds: Vec<Kinds>,
    /// The regions' colours there.
    pub base: [Column<S>; 3],
    /// Shine, specular and diffuse of the regions' finishes, zeros without.
    pub finish: [Column<S>; 3],
    /// What they show.
    pub color: [Column<S>; 3],
    /// Unit directions to a light.
    pub to_light: [Column<S>; 3],
    /// Of each vector of lanes: those that it may light.
    pub facing: Vec<u32>,
    /// How much of it arrives.
    pub visible: Column<S>,
}

/// Lanes of a vector by what they have entered.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Kinds {
    /// A region.
    pub entering: u32,
    /// One with a finish.
    pub lit: u32,
    /// One that light from behind counts for.
    pub transmits: u32,
    /// One that sends mirrored or refracted rays on.
    pub sends: u32,
    /// One that shows its colour as it is.
    pub plain: u32,
    /// A light.
    pub shines: u32,
}

impl<S: Real> Meetings<S> {
    /// None yet, of a level of `padded` rays with its padding. Arrays by ray may be longer.
    pub fn open(&mut self, padded: usize) {
        self.kinds.clear();
        self.facing.resize(padded / S::Wide::N, 0);
        let lists = [&mut self.base, &mut self.finish, &mut self.color, &mut self.to_light];
        lists.into_iter().flatten().chain([&mut self.visible]).for_each(|array| array.at_least(padded));
    }

    /// The next vector of lanes, whose rays are those from `first` on: rays `entering` enter the regions of `found`, at the
    /// leaves `prims`.
    #[inline]
    pub fn add(&mut self, rt: &Rt, world: &World<S>, found: &Found<S>, prims: &[u32], first: usize, entering: u32) {
        if entering == 0 {
            return self.kinds.push(Kinds::default());
        }
        let mut kinds = Kinds { entering, ..Kinds::default() };
        let zero = [S::Wide::constant(0.0); 3];
        let (mut base, mut finishes) = (zero, zero);
        let regions = &found.region[first..];
        let mut rest = entering;
        while rest != 0 {
            let region = regions[rest.trailing_zeros() as usize % MAX_LANES];
            let same = positions_in::<S::Wide>(regions, region) & rest;
            rest &= !same;
            let mask = <S::Wide as Lanes>::Mask::from_bits(same);
            let material = &rt.materials[region as usize];
            let color = match &material.pattern {
                None => each(|axis| S::Wide::constant(material.base[axis])),
                Some(pattern) => patterned(pattern, material, world, found, prims, first, same),
            };
            base = space::choose(mask, color, base);
            let (shines, plain) = (material.is_light, material.is_light || material.finish.is_none());
            kinds.shines |= if shines { same } else { 0 };
            kinds.plain |= if plain { same } else { 0 };
            let Some(finish) = &material.finish else { continue };
            finishes =
                space::choose(mask, [finish.shine, finish.specular, finish.diffuse].map(Lanes::constant), finishes);
            let (transmits, reflects) = (finish.transmit > 0.0, finish.reflect > 0.0);
            kinds.lit |= same;
            kinds.transmits |= if transmits { same } else { 0 };
            kinds.sends |= if transmits || reflects { same } else { 0 };
        }
        for axis in 0..3 {
            base[axis].store(&mut self.base[axis][first..]);
            finishes[axis].store(&mut self.finish[axis][first..]);
        }
        self.kinds.push(kinds);
    }

    /// How many rays the level has, with its padding.
    pub fn padded(&self) -> usize {
        self.kinds.len() * S::Wide::N
    }
}

/// Colours of `pattern` on those of `lanes`, all in the region of `material`.
#[inline(never)]
fn patterned<S: Real>(
    pattern: &Pattern,
    material: &RtMaterial,
    world: &World<S>,
    found: &Found<S>,
    prims: &[u32],
    first: usize,
    lanes: u32,
) -> Lanes3<S::Wide> {
    let prims = &prims[first..];
    let (position, normal) = (vector(&found.position, first), vector(&found.normal, first));
    let mut colors = [S::Wide::constant(0.0); 3];
    let mut rest = lanes;
    while rest != 0 {
        let lead = rest.trailing_zeros() as usize % MAX_LANES;
        let same = positions_in::<S::Wide>(prims, prims[lead]) & rest;
        rest &= !same;
        let at = uv(world, found.region[first + lead], prims[lead], position, normal)
            .unwrap_or_else(|| uv_of_arb(material.faces(), position, normal));
        colors = space::choose(<S::Wide as Lanes>::Mask::from_bits(same), pattern.color(at), colors);
    }
    colors
}
