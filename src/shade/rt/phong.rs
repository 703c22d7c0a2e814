//! Lighting of surfaces in lanes, and the rays they send on.

use glam::DVec3;

use super::glass::{self, refract};
use super::lamp::Lamp;
use super::level::{Found, Level};
use super::material::Finish;
use super::shadow::Probes;
use super::{AIR, AMBIENT, MAX_BOUNCES, Memory, Path, Rt, TOLERANCE, Within};
use crate::lanes::chosen::{at, lanes_of, packets, spill};
use crate::lanes::{LaneMask, Lanes, Lanes3, MAX_LANES, Real, dot, each, space};
use crate::shade::sample::Samples;
use crate::shade::shader::{Shader, Workspace};

/// What the paths of a level show where they enter regions, parallel to its rays.
#[derive(Clone, Debug, Default)]
pub(super) struct Meetings<S> {
    /// Of each vector of lanes: those that enter a region.
    pub lanes: Vec<u32>,
    /// The regions' colours there.
    pub base: [Vec<S>; 3],
    /// What they show.
    color: [Vec<S>; 3],
    /// How much of a light arrives.
    visible: Vec<S>,
}

impl<S: Real> Meetings<S> {
    /// None yet, of a level of `padded` rays with its padding.
    pub fn open(&mut self, padded: usize) {
        self.lanes.clear();
        self.lanes.resize(padded / S::Wide::N, 0);
        for array in self.base.iter_mut().chain(&mut self.color).chain([&mut self.visible]) {
            array.resize(padded, S::ZERO);
        }
    }

    /// Ray `i` enters a region of colour `base`.
    #[inline]
    pub fn add(&mut self, i: usize, base: DVec3) {
        self.lanes[i / S::Wide::N] |= 1 << (i % S::Wide::N);
        (0..3).for_each(|axis| self.base[axis][i] = S::from_f64(base[axis]));
    }
}

#[inline(always)]
fn vector<S: Real>(from: &[Vec<S>; 3], first: usize) -> Lanes3<S::Wide> {
    [S::Wide::load(&from[0][first..]), S::Wide::load(&from[1][first..]), S::Wide::load(&from[2][first..])]
}

/// Finishes of the regions of `lanes`; of other lanes and unlit regions zeros.
struct Finishes<V> {
    shine: V,
    specular: V,
    diffuse: V,
    /// Whether light from behind counts.
    transmits: u32,
    /// Lanes with a finish.
    lanes: u32,
}

impl<V: Lanes> Finishes<V> {
    #[inline(always)]
    fn of(rt: &Rt, region: &[u32], lanes: u32) -> Self {
        let mut columns = [[V::Scalar::ZERO; MAX_LANES]; 3];
        let (mut transmits, mut with) = (0, 0);
        for lane in lanes_of(lanes) {
            let Some(finish) = &rt.materials[region[lane] as usize].finish else { continue };
            with |= 1 << lane;
            transmits |= u32::from(finish.transmit > 0.0) << lane;
            for (column, x) in columns.iter_mut().zip([finish.shine, finish.specular, finish.diffuse]) {
                column[lane] = V::Scalar::from_f64(x);
            }
        }
        let [shine, specular, diffuse] = columns.map(|column| V::load(&column));
        Self { shine, specular, diffuse, transmits, lanes: with }
    }
}

impl<S: Real> Shader<'_, S> {
    /// Lights the meetings of a level, adds what they show to the pixels and puts mirror and glass rays into `next`.
    pub(super) fn rt_light(
        &self,
        rt: &Rt,
        memory: &mut Memory<S>,
        next: &mut Vec<Path>,
        work: &mut Workspace<S>,
        out: &mut Samples,
    ) {
        let Memory { level, found, meetings, probes, next_probes, shadow, .. } = memory;
        unlit(rt, level, found, meetings);
        for lamp in rt.lamps.iter().rev() {
            if lamp.region.is_none() {
                meetings.visible.fill(S::ONE);
            } else {
                aim(rt, lamp, found, meetings, probes);
                meetings.visible.fill(S::ZERO);
                self.rt_visible(rt, probes, next_probes, shadow, &mut meetings.visible, work);
            }
            light(rt, lamp, level, found, meetings);
        }
        for (first, lanes) in packets::<S::Wide>(&meetings.lanes) {
            for lane in lanes_of(lanes) {
                let i = first + lane;
                let color = DVec3::from(each(|axis| meetings.color[axis][i].to_f64()));
                let shown = match &rt.materials[found.region[i] as usize].finish {
                    Some(finish) if finish.reflect > 0.0 || finish.transmit > 0.0 => {
                        let base = DVec3::from(each(|axis| meetings.base[axis][i].to_f64()));
                        send_on(level.path(i), found, i, finish, base, color, next)
                    }
                    _ => color,
                };
                let carry = level.carry(i);
                out.colors[carry.pixel as usize].radiance += carry.throughput * shown;
            }
        }
    }
}

/// What surfaces show without lights: ambient light, their own light, or a pattern as it is.
fn unlit<S: Real>(rt: &Rt, level: &Level<S>, found: &Found<S>, meetings: &mut Meetings<S>) {
    let Meetings { lanes, base, color, .. } = meetings;
    for (first, lanes) in packets::<S::Wide>(lanes) {
        let (normal, dir) = (vector(&found.normal, first), vector(&level.rays.dir, first));
        let zero = S::Wide::constant(0.0);
        let facing = zero - dot(normal, dir);
        let ambient = zero.fast_max(facing) * S::Wide::constant(AMBIENT);
        for axis in 0..3 {
            (S::Wide::load(&base[axis][first..]) * ambient).store(&mut color[axis][first..]);
        }
        for lane in lanes_of(lanes) {
            let (i, region) = (first + lane, found.region[first + lane]);
            let material = &rt.materials[region as usize];
            if !material.is_light && material.finish.is_some() {
                continue;
            }
            let lamp = rt.lamps.iter().find(|lamp| material.is_light && lamp.region == Some(region));
            let seen = lamp.map(|lamp| lamp.seen(facing.lane(lane).to_f64(), found.normal(i)));
            for axis in 0..3 {
                color[axis][i] = seen.map_or(base[axis][i], |seen| S::from_f64(seen[axis]));
            }
        }
    }
}

/// Unit directions to the light, and the lanes that it may light.
#[inline(always)]
fn towards<S: Real>(
    lamp: &Lamp,
    found: &Found<S>,
    finishes: &Finishes<S::Wide>,
    first: usize,
) -> (Lanes3<S::Wide>, u32) {
    let splat = |v: DVec3| v.to_array().map(S::Wide::constant);
    let to_light = space::normalize(space::sub(splat(lamp.position), vector(&found.position, first)));
    let in_front = S::Wide::constant(0.0).cmp_le(dot(vector(&found.normal, first), to_light)).bits();
    let in_cone = S::Wide::constant(lamp.cosine).cmp_le(S::Wide::constant(0.0) - dot(to_light, splat(lamp.aim))).bits();
    (to_light, (in_front | finishes.transmits) & in_cone & finishes.lanes)
}

/// Shadow rays from the meetings to `lamp`.
fn aim<S: Real>(rt: &Rt, lamp: &Lamp, found: &Found<S>, meetings: &Meetings<S>, probes: &mut Probes<S>) {
    probes.open(found.t.len());
    for (first, lanes) in packets::<S::Wide>(&meetings.lanes) {
        let finishes = Finishes::of(rt, &found.region[first..], lanes);
        let (to_light, lit) = towards(lamp, found, &finishes, first);
        let position = vector(&found.position, first);
        let org = spill(each(|axis| to_light[axis].mul_add(S::Wide::constant(TOLERANCE), position[axis])));
        let dir = spill(to_light);
        lanes_of(lit).for_each(|lane| probes.push((first + lane) as u32, at(&org, lane), at(&dir, lane)));
    }
}

/// Adds the light of `lamp`: diffuse, and the highlight.
///
/// Source of the highlight: Christophe Schlick, "A Fast Alternative to Phong's Specular Model", Graphics Gems IV, 1994.
fn light<S: Real>(rt: &Rt, lamp: &Lamp, level: &Level<S>, found: &Found<S>, meetings: &mut Meetings<S>) {
    let zero = S::Wide::constant(0.0);
    let Meetings { lanes, base, color, visible } = meetings;
    for (first, lanes) in packets::<S::Wide>(lanes) {
        let visible = S::Wide::load(&visible[first..]);
        let lanes = lanes & zero.cmp_lt(visible).bits();
        if lanes == 0 {
            continue;
        }
        let finishes = Finishes::of(rt, &found.region[first..], lanes);
        let (to_light, lit) = towards(lamp, found, &finishes, first);
        let lit = <S::Wide as Lanes>::Mask::from_bits(lit);
        let (normal, dir) = (vector(&found.normal, first), vector(&level.rays.dir, first));
        let cosine = dot(normal, to_light);
        let Finishes { shine, specular, diffuse, .. } = finishes;
        let diffuse = zero.fast_max(diffuse * cosine);
        let mirrored = space::sub(space::scale(normal, cosine + cosine), to_light);
        let s = zero - dot(mirrored, dir);
        let highlight = specular * s / (shine - shine * s + s);
        let highlight = S::Wide::select(zero.cmp_lt(s), highlight, zero);
        let strength = visible * S::Wide::constant(lamp.fraction);
        for axis in 0..3 {
            let light = strength * S::Wide::constant(lamp.color[axis]);
            let base = S::Wide::load(&base[axis][first..]);
            let color = &mut color[axis][first..];
            let before = S::Wide::load(color);
            let after = (base * diffuse + highlight).mul_add(light, before);
            S::Wide::select(lit, after, before).store(color);
        }
    }
}

/// Sends mirror and glass rays on from hit `i`; gives what remains of the surface's own colour.
fn send_on<S: Real>(
    path: Path,
    found: &Found<S>,
    i: usize,
    finish: &Finish,
    base: DVec3,
    color: DVec3,
    next: &mut Vec<Path>,
) -> DVec3 {
    let carry = path.carry;
    if carry.level > MAX_BOUNCES {
        return base;
    }
    let (t, position, normal) = (found.t[i].to_f64(), found.position(i), found.normal(i));
    let (mut reflect, mut transmit) = (finish.reflect, finish.transmit);
    if t < glass::AIR_GAP && carry.index == finish.index {
        (transmit, reflect) = (transmit + reflect, 0.0);
    }
    let own = (1.0 - (reflect + transmit)).max(0.0);
    if own >= 1.0 {
        return color;
    }
    let mut send = |dir: DVec3, carry| next.push(Path { org: position, dir, carry });
    if transmit > 0.0 {
        let outside = if t > glass::AIR_GAP { AIR } else { carry.index };
        match refract(path.dir, normal, outside, finish.index) {
            Ok(dir) => {
                let within = Within { region: found.region[i], index: finish.index, reflections: 0 };
                let throughput = carry.throughput * base * transmit;
                send(dir, super::Carry { throughput, within: Some(within), left: None, ..carry });
            }
            Err(_) => reflect += transmit,
        }
    }
    if reflect > 0.0 {
        let dir = path.dir - normal * (2.0 * path.dir.dot(normal));
        let throughput = carry.throughput * reflect;
        send(dir, super::Carry { level: carry.level + 1, throughput, left: None, ..carry });
    }
    color * own
}
