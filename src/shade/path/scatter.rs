//! One bounce of the points of one model, packet by packet: a light is aimed at, a direction is chosen.

use glam::DVec3;

use super::Paths;
use super::bsdf::Bsdf;
use super::points::{NORMAL, OFFSET, OUT, POSITION, Points, SHADING, SQUEEZE, THROUGHPUT};
use super::wave::{Shadows, Wave};
use crate::camera::sobol::{PixelPoints, fraction};
use crate::lanes::space::{Frame, choose};
use crate::lanes::{LaneMask, Lanes, Lanes3, MAX_LANES, Real, dot};

/// Bounces before paths may end by chance.
const FIRST_ROULETTE: u32 = 3;
/// The largest chance to go on.
const LARGEST_CHANCE: f64 = 0.95;
/// Pairs of dimensions of a bounce; those of the camera come first.
const PAIRS: u32 = 4;
/// Pairs of the camera: the place in the pixel.
const CAMERA_PAIRS: u32 = 1;

/// A column of lanes in memory.
type Column<S> = [S; MAX_LANES];

/// The random numbers of a packet: place and choice of the direction, place and choice of the light, roulette.
struct Numbers<S> {
    place: [Column<S>; 2],
    choice: Column<S>,
    light: [Column<S>; 2],
    light_choice: Column<S>,
    roulette: Column<S>,
}

/// What points know of their paths.
pub struct Chances<'a> {
    /// Points of each path's pixel.
    pub points: &'a [PixelPoints],
    /// Number of the sample.
    pub sample: u32,
    /// Number of the bounce, 0 at the first hit.
    pub bounce: u32,
}

impl Chances<'_> {
    fn numbers<S: Real>(&self, path: &[u32]) -> Numbers<S> {
        let zero = [S::ZERO; MAX_LANES];
        let mut numbers =
            Numbers { place: [zero; 2], choice: zero, light: [zero; 2], light_choice: zero, roulette: zero };
        let mut keys = [PixelPoints::default(); MAX_LANES];
        for (key, &path) in keys.iter_mut().zip(path) {
            *key = self.points[path as usize];
        }
        let first = CAMERA_PAIRS + self.bounce * PAIRS;
        let fill = |pair: u32, x: &mut Column<S>, y: &mut Column<S>| {
            let mut bits = [[0; MAX_LANES]; 2];
            for lane in 0..MAX_LANES {
                let both = keys[lane].bits(self.sample, first + pair);
                (bits[0][lane], bits[1][lane]) = (both[0], both[1]);
            }
            for lane in 0..MAX_LANES {
                x[lane] = S::from_f64(fraction(bits[0][lane]));
                y[lane] = S::from_f64(fraction(bits[1][lane]));
            }
        };
        let [x, y] = &mut numbers.place;
        fill(0, x, y);
        let [x, y] = &mut numbers.light;
        fill(1, x, y);
        fill(2, &mut numbers.light_choice, &mut numbers.choice);
        if self.bounce >= FIRST_ROULETTE {
            fill(3, &mut numbers.roulette, &mut [S::ZERO; MAX_LANES]);
        }
        numbers
    }
}

/// The points of a packet.
struct Packet<V> {
    position: Lanes3<V>,
    normal: Lanes3<V>,
    offset: V,
    throughput: Lanes3<V>,
    squeeze: V,
    frame: Frame<V>,
    /// To where the light goes, local.
    out: Lanes3<V>,
}

impl<V: Lanes> Packet<V> {
    #[inline(always)]
    fn load(points: &Points<V::Scalar>, first: usize) -> Self {
        let frame = Frame::new(points.vector(SHADING, first));
        let [x, y, z] = frame.to_local(points.vector(OUT, first));
        Self {
            position: points.vector(POSITION, first),
            normal: points.vector(NORMAL, first),
            offset: points.scalar(OFFSET, first),
            throughput: points.vector(THROUGHPUT, first),
            squeeze: points.scalar(SQUEEZE, first),
            frame,
            out: [x, y, z.fast_max(V::constant(1e-6))],
        }
    }

    /// Origin of a ray in world direction `dir`, and whether it is on the same side of the surface as `local` is of
    /// the shading normal's plane: where the two disagree light would leak.
    #[inline(always)]
    fn leave(&self, dir: Lanes3<V>, local: Lanes3<V>) -> (Lanes3<V>, V::Mask) {
        let zero = V::constant(0.0);
        let side = dot(dir, self.normal);
        let step = V::select(zero.cmp_lt(side), self.offset, -self.offset);
        let org = [0, 1, 2].map(|i| self.normal[i].mul_add(step, self.position[i]));
        (org, zero.cmp_lt(side * local[2]))
    }
}

#[inline(always)]
fn spill<V: Lanes>(v: Lanes3<V>) -> [Column<V::Scalar>; 3] {
    v.map(|x| {
        let mut column = [V::Scalar::ZERO; MAX_LANES];
        x.store(&mut column);
        column
    })
}

#[inline(always)]
fn at<S: Copy>(columns: &[Column<S>; 3], lane: usize) -> [S; 3] {
    [columns[0][lane], columns[1][lane], columns[2][lane]]
}

impl<S: Real> Paths<'_, S> {
    /// Scatters at all `points`: rays into `next`, shadow rays into `shadows`.
    pub(super) fn scatter<B: Bsdf<S::Wide>>(
        &self,
        points: &Points<S>,
        chances: &Chances<'_>,
        next: &mut Wave<S>,
        shadows: &mut Shadows<S>,
    ) {
        let width = <S::Wide as Lanes>::N;
        for first in (0..points.len()).step_by(width) {
            let path = &points.path[first..points.len().min(first + width)];
            let numbers = chances.numbers::<S>(path);
            let packet = Packet::<S::Wide>::load(points, first);
            let bsdf = B::load(points, first);
            if !B::SMOOTH && !self.lights.is_empty() {
                self.aim(&packet, &bsdf, path, &numbers, shadows);
            }
            go_on(&packet, &bsdf, path, &numbers, chances.bounce, next);
        }
    }

    /// One shadow ray for each point of the packet that a light may reach.
    #[inline(always)]
    fn aim<B: Bsdf<S::Wide>>(
        &self,
        packet: &Packet<S::Wide>,
        bsdf: &B,
        path: &[u32],
        numbers: &Numbers<S>,
        shadows: &mut Shadows<S>,
    ) {
        let zero = [S::ZERO; MAX_LANES];
        let (mut dir, mut radiance, mut target) = ([zero; 3], [zero; 3], [zero; 3]);
        // Without light the density is 1 and the radiance 0.
        let (mut pdf, mut near, mut points) = ([S::ONE; MAX_LANES], zero, 0);
        let position = spill(packet.position);
        for lane in 0..path.len() {
            let from = DVec3::from(at(&position, lane).map(S::to_f64));
            let place = [numbers.light[0][lane].to_f64(), numbers.light[1][lane].to_f64()];
            let choice = numbers.light_choice[lane].to_f64();
            let Some(aim) = self.lights.aim(from, choice, place, self.world, &self.looks) else { continue };
            for axis in 0..3 {
                dir[axis][lane] = S::from_f64(aim.dir[axis]);
                radiance[axis][lane] = S::from_f64(aim.radiance[axis]);
                target[axis][lane] = S::from_f64(aim.target[axis]);
            }
            pdf[lane] = S::from_f64(aim.pdf);
            near[lane] = if aim.is_far { S::ZERO } else { S::ONE };
            points |= u32::from(aim.is_point) << lane;
        }
        type Mask<S> = <<S as Real>::Wide as Lanes>::Mask;
        let load = |columns: &[Column<S>; 3]| [0, 1, 2].map(|i| S::Wide::load(&columns[i]));
        let (one, pdf, near) = (S::Wide::constant(1.0), S::Wide::load(&pdf), S::Wide::load(&near));
        let dir = load(&dir);
        let local = packet.frame.to_local(dir);
        let (org, is_consistent) = packet.leave(dir, local);
        let found = bsdf.eval(packet.out, local);
        let share = one / (one + (found.pdf / pdf) * (found.pdf / pdf));
        let weight = S::Wide::select(Mask::<S>::from_bits(points), one, share) / pdf;
        let arriving = load(&radiance);
        let light: Lanes3<S::Wide> = [0, 1, 2].map(|i| packet.throughput[i] * found.value[i] * (arriving[i] * weight));
        let sum = light[0] + light[1] + light[2];
        let wanted = is_consistent & S::Wide::constant(0.0).cmp_lt(sum) & sum.cmp_lt(S::Wide::splat(S::INFINITY));
        // To a place: from the ray's own origin, ending at t = 1.
        let target = load(&target);
        let dir = [0, 1, 2].map(|i| target[i] - org[i] * near);
        let (org, dir, light) = (spill(org), spill(dir), spill(light));
        let mut far = zero;
        near.store(&mut far);
        let mut bits = wanted.bits() & ((1u32 << path.len()) - 1);
        while bits != 0 {
            let lane = bits.trailing_zeros() as usize;
            bits &= bits - 1;
            let t_max = if far[lane] == S::ZERO { S::INFINITY } else { self.shadow_end };
            shadows.push(path[lane], at(&org, lane), at(&dir, lane), t_max, at(&light, lane));
        }
    }
}

/// The next ray of each path of the packet that goes on.
#[inline(always)]
fn go_on<S: Real, B: Bsdf<S::Wide>>(
    packet: &Packet<S::Wide>,
    bsdf: &B,
    path: &[u32],
    numbers: &Numbers<S>,
    bounce: u32,
    next: &mut Wave<S>,
) {
    let (zero, one) = (S::Wide::constant(0.0), S::Wide::constant(1.0));
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
    let (org, dir, throughput) = (spill(org), spill(dir), spill(throughput));
    let [pdf, squeeze, _] = spill([sampled.pdf, squeeze, one]);
    let mut bits = alive.bits() & ((1u32 << path.len()) - 1);
    while bits != 0 {
        let lane = bits.trailing_zeros() as usize;
        bits &= bits - 1;
        next.push(path[lane], at(&org, lane), at(&dir, lane), at(&throughput, lane), pdf[lane], squeeze[lane]);
    }
}
