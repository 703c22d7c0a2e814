//! One bounce of the points of one model, packet by packet: a light is aimed at, a direction is chosen.

use super::Paths;
use super::bsdf::Bsdf;
use super::points::{PlaceLanes, Places, Points};
use super::wave::{Shadows, Wave};
use crate::camera::sobol::fraction;
use crate::lanes::chosen::{Chosen, Picked};
use crate::lanes::space::{Frame, choose, normalize};
use crate::lanes::{LaneMask, Lanes, Lanes3, MAX_LANES, Real, dot, map3};
use crate::shade::look_lanes::{LookLanes, LookNumbers};
use crate::shade::spot::Draw;

/// Bounces before paths may end by chance.
const FIRST_ROULETTE: u32 = 3;
/// The largest chance to go on.
const LARGEST_CHANCE: f64 = 0.95;
/// Pairs of dimensions of a bounce; those of the camera come first.
const PAIRS: u32 = 4;
/// Pairs of the camera: the place in the pixel.
const CAMERA_PAIRS: u32 = 1;

/// A column of lanes in memory.
pub type Column<S> = [S; MAX_LANES];

/// The random numbers of a packet: place and choice of the direction, place and choice of the light, roulette.
struct Numbers<S> {
    place: [Column<S>; 2],
    choice: Column<S>,
    light: [Column<S>; 2],
    /// All 32 bits: a fraction has too few digits to choose among many.
    light_choice: [u32; MAX_LANES],
    roulette: Column<S>,
}

/// What points know of their paths.
pub struct Chances<'a> {
    /// The random numbers of each path.
    pub draws: &'a [Draw],
    /// Number of the bounce, 0 at the first hit.
    pub bounce: u32,
}

impl Chances<'_> {
    /// Those of lights only where some `aims` at them.
    fn numbers<S: Real>(&self, path: &[u32], aims: bool) -> Numbers<S> {
        let zero = [S::ZERO; MAX_LANES];
        let light_choice = [0; MAX_LANES];
        let mut numbers = Numbers { place: [zero; 2], choice: zero, light: [zero; 2], light_choice, roulette: zero };
        let mut keys = [Draw::default(); MAX_LANES];
        for (key, &path) in keys.iter_mut().zip(path) {
            *key = self.draws[path as usize];
        }
        let first = CAMERA_PAIRS + self.bounce * PAIRS;
        let bits = |pair: u32| {
            let mut bits = [[0; MAX_LANES]; 2];
            for lane in 0..MAX_LANES {
                let both = keys[lane].points.bits(keys[lane].sample, first + pair);
                (bits[0][lane], bits[1][lane]) = (both[0], both[1]);
            }
            bits
        };
        let fractions = |bits: [u32; MAX_LANES]| bits.map(|bits| S::from_f64(fraction(bits)));
        numbers.place = bits(0).map(fractions);
        if aims {
            numbers.light = bits(1).map(fractions);
        }
        let [light_choice, choice] = bits(2);
        (numbers.light_choice, numbers.choice) = (light_choice, fractions(choice));
        if self.bounce >= FIRST_ROULETTE {
            numbers.roulette = fractions(bits(3)[0]);
        }
        numbers
    }
}

/// What a wave has arrived at.
pub struct Arrivals<'a, S> {
    /// Its rays.
    pub wave: &'a Wave<S>,
    /// Where they met surfaces.
    pub places: &'a Places<S>,
    /// What is scattered with there: two lists as one.
    pub looks: [&'a [LookNumbers<S>]; 2],
}

/// The points of a packet.
struct Packet<V> {
    place: PlaceLanes<V>,
    throughput: Lanes3<V>,
    squeeze: V,
    frame: Frame<V>,
    /// To where the light goes, local.
    out: Lanes3<V>,
}

impl<V: Lanes> Packet<V> {
    #[inline(always)]
    fn load<S: Real<Wide = V>>(arrivals: &Arrivals<'_, S>, rays: &Picked, bounce: u32) -> Self
    where
        V: Lanes<Scalar = S>,
    {
        let Arrivals { wave, places, .. } = arrivals;
        let place = places.of(rays);
        let frame = Frame::new(place.shading);
        let back = map3(rays.take3(wave.rays.dir.each_ref()), |d: V| -d);
        // Only the camera's directions are not unit.
        let [x, y, z] = frame.to_local(if bounce == 0 { normalize(back) } else { back });
        Self {
            place,
            throughput: rays.take3(wave.throughput.each_ref()),
            squeeze: rays.take(&wave.squeeze),
            frame,
            out: [x, y, z.fast_max(V::constant(1e-6))],
        }
    }

    /// Origin of a ray in world direction `dir`, and whether it is on the same side of the surface as `local` is of
    /// the shading normal's plane: where the two disagree light would leak.
    #[inline(always)]
    fn leave(&self, dir: Lanes3<V>, local: Lanes3<V>) -> (Lanes3<V>, V::Mask) {
        let zero = V::constant(0.0);
        let PlaceLanes { position, normal, offset, .. } = self.place;
        let side = dot(dir, normal);
        let step = V::select(zero.cmp_lt(side), offset, -offset);
        let org = [0, 1, 2].map(|i| normal[i].mul_add(step, position[i]));
        (org, zero.cmp_lt(side * local[2]))
    }
}

impl<S: Real> Paths<'_, S> {
    /// Scatters at all `points`: rays into `next`, shadow rays into `shadows`.
    pub(super) fn scatter<'t, B: Bsdf<'t, S::Wide>>(
        &'t self,
        points: &Points,
        arrivals: &Arrivals<'_, S>,
        chances: &Chances<'_>,
        next: &mut Wave<S>,
        shadows: &mut Shadows<S>,
    ) {
        let width = <S::Wide as Lanes>::N;
        let aims = !B::SMOOTH && !self.lights.is_empty();
        for chunk in points.list.chunks(width) {
            let [mut path, mut rays, mut looks] = [[0; MAX_LANES]; 3];
            for (lane, &[ray, look]) in chunk.iter().enumerate().take(MAX_LANES) {
                (path[lane], rays[lane], looks[lane]) = (arrivals.wave.path[ray as usize], ray, look);
            }
            let [path, rays] = [&path, &rays].map(|list| &list[..chunk.len()]);
            let numbers = chances.numbers::<S>(path, aims);
            let packet =
                Packet::load(arrivals, &Picked::of::<S::Wide>(rays, arrivals.wave.rays.padded_len()), chances.bounce);
            let bsdf = B::load(&LookLanes::of(arrivals.looks, (1 << chunk.len()) - 1, &looks), &self.facets);
            if aims {
                self.aim(&packet, &bsdf, path, &numbers, shadows);
            }
            go_on(&packet, &bsdf, path, &numbers, chances.bounce, next);
        }
    }

    /// One shadow ray for each point of the packet that a light may reach.
    #[inline(always)]
    fn aim<'t, B: Bsdf<'t, S::Wide>>(
        &self,
        packet: &Packet<S::Wide>,
        bsdf: &B,
        path: &[u32],
        numbers: &Numbers<S>,
        shadows: &mut Shadows<S>,
    ) {
        let target = self.targets(packet.place.position, path.len(), &numbers.light, &numbers.light_choice);
        let one = S::Wide::constant(1.0);
        let local = packet.frame.to_local(target.dir);
        let (org, is_consistent) = packet.leave(target.dir, local);
        let found = bsdf.eval(packet.out, local);
        let odds = found.pdf / target.pdf;
        let share = one / odds.mul_add(odds, one);
        let weight = S::Wide::select(target.is_point, one, share) / target.pdf;
        let light: Lanes3<S::Wide> =
            [0, 1, 2].map(|i| packet.throughput[i] * found.value[i] * (target.radiance[i] * weight));
        let sum = light[0] + light[1] + light[2];
        let wanted = is_consistent & S::Wide::constant(0.0).cmp_lt(sum) & sum.cmp_lt(S::Wide::splat(S::INFINITY));
        // To a place: from the ray's own origin, ending before t = 1.
        let dir = [0, 1, 2].map(|i| target.place[i] - org[i] * target.near);
        let far = target.near.cmp_lt(one);
        let t_max = S::Wide::select(far, S::Wide::splat(S::INFINITY), S::Wide::splat(self.shadow_end));
        shadows.push(&those(wanted, path), path, [org, dir, light], t_max);
    }
}

/// Those of the lanes `mask` that belong to a path.
#[inline(always)]
fn those(mask: impl LaneMask, path: &[u32]) -> Chosen {
    Chosen::of(mask.bits() & ((1 << path.len()) - 1))
}

/// The next ray of each path of the packet that goes on.
#[inline(always)]
fn go_on<'t, S: Real, B: Bsdf<'t, S::Wide>>(
    packet: &Packet<S::Wide>,
    bsdf: &B,
    path: &[u32],
    numbers: &Numbers<S>,
    bounce: u32,
    next: &mut Wave<S>,
) {
    let zero = S::Wide::constant(0.0);
    let place = [S::Wide::load(&numbers.place[0]), S::Wide::load(&numbers.place[1])];
    let sampled = bsdf.sample(packet.out, place, S::Wide::load(&numbers.choice));
    let dir = packet.frame.to_world(sampled.wi);
    let (org, is_consistent) = packet.leave(dir, sampled.wi);
    let mut throughput = [0, 1, 2].map(|i| packet.throughput[i] * sampled.weight[i]);
    let squeeze = packet.squeeze * sampled.squeeze;
    let largest = throughput[0].fast_max(throughput[1]).fast_max(throughput[2]);
    let mut alive = is_consistent & zero.cmp_lt(largest) & largest.cmp_lt(S::Wide::splat(S::INFINITY));
    if bounce >= FIRST_ROULETTE {
        let chance = (largest * squeeze).fast_min(S::Wide::constant(LARGEST_CHANCE));
        alive = alive & S::Wide::load(&numbers.roulette).cmp_lt(chance);
        throughput = choose(alive, throughput.map(|t| t / chance), throughput);
    }
    next.push_some(&those(alive, path), path, [org, dir, throughput], [sampled.pdf, squeeze]);
}
