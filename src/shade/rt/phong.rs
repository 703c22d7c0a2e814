//! Lighting of surfaces in lanes, and the rays they send on.

use glam::DVec3;

use super::glass::{self, refract};
use super::lamp::Lamp;
use super::level::{Found, Level, vector};
use super::material::Finish;
use super::meetings::Meetings;
use super::shadow::Probes;
use super::{AIR, AMBIENT, DARK, MAX_BOUNCES, Memory, Path, Rt, TOLERANCE, Within};
use crate::lanes::chosen::{lanes_of, positions_in};
use crate::lanes::{Column, LaneMask, Lanes, Lanes3, MAX_LANES, Real, dot, each, space};
use crate::shade::sample::Samples;
use crate::shade::shader::{Shader, Workspace};

impl<S: Real> Shader<'_, S> {
    /// Lights the meetings of a level, adds what they show to the pixels and sends mirror and glass rays on.
    pub(super) fn rt_light(&self, rt: &Rt, memory: &mut Memory<S>, work: &mut Workspace<S>, out: &mut Samples) {
        let Memory { level, next, found, meetings, probes, next_probes, shadow, dark, .. } = memory;
        unlit(rt, level, found, meetings);
        for lamp in rt.lamps.iter().rev() {
            let padded = meetings.padded();
            face(lamp, found, meetings);
            if lamp.region.is_none() {
                meetings.visible[..padded].fill(S::ONE);
            } else {
                aim(found, meetings, probes);
                meetings.visible[..padded].fill(S::ZERO);
                self.rt_visible(rt, probes, next_probes, shadow, &mut meetings.visible, work);
            }
            light(lamp, level, found, meetings);
        }
        for k in 0..meetings.kinds.len() {
            let (first, kinds) = (k * S::Wide::N, meetings.kinds[k]);
            let mirrors =
                if kinds.sends == 0 { 0 } else { mirror(rt, level, found, meetings, first, kinds.sends, next) };
            for i in lanes_of(kinds.sends & !mirrors).map(|lane| first + lane) {
                let Some(finish) = &rt.materials[found.region[i] as usize].finish else { continue };
                let of = |list: &[Column<S>; 3]| DVec3::from(each(|axis| list[axis][i].to_f64()));
                let (base, color) = (of(&meetings.base), of(&meetings.color));
                let shown = send_on(level.path(i), found, i, finish, base, color, next);
                (0..3).for_each(|axis| meetings.color[axis][i] = S::from_f64(shown[axis]));
            }
            if kinds.entering != 0 {
                let color: Lanes3<S::Wide> = vector(&meetings.color, first);
                level.show(first, kinds.entering, color, out);
                if level.is_primary() {
                    // What comes back from mirrors and glass makes them no darker.
                    let [r, g, b] = color;
                    let is_dark = r.fast_max(g).fast_max(b).cmp_lt(S::Wide::constant(DARK)).bits();
                    dark.extend(lanes_of(is_dark & kinds.entering).map(|lane| (first + lane) as u32));
                }
            }
        }
    }
}

/// What surfaces show without lights: ambient light, their own light, or a pattern as it is.
#[inline(never)]
fn unlit<S: Real>(rt: &Rt, level: &Level<S>, found: &Found<S>, meetings: &mut Meetings<S>) {
    let Meetings { kinds, base, color, .. } = meetings;
    for (k, kinds) in kinds.iter().enumerate().filter(|(_, kinds)| kinds.entering != 0) {
        let first = k * S::Wide::N;
        let (normal, dir) = (vector(&found.normal, first), level.dir(first));
        let zero = S::Wide::constant(0.0);
        let facing = zero - dot(normal, dir);
        let ambient = zero.fast_max(facing) * S::Wide::constant(AMBIENT);
        let base: Lanes3<S::Wide> = vector(base, first);
        let plain = <S::Wide as Lanes>::Mask::from_bits(kinds.plain);
        let shown = space::choose(plain, base, space::scale(base, ambient));
        (0..3).for_each(|axis| shown[axis].store(&mut color[axis][first..]));
        for lane in lanes_of(kinds.shines) {
            let (i, region) = (first + lane, found.region[first + lane]);
            let Some(lamp) = rt.lamps.iter().find(|lamp| lamp.region == Some(region)) else { continue };
            let seen = lamp.seen(facing.lane(lane).to_f64(), found.normal(i));
            (0..3).for_each(|axis| color[axis][i] = S::from_f64(seen[axis]));
        }
    }
}

/// Finds the directions to `lamp`, and the lanes that it may light.
#[inline(never)]
fn face<S: Real>(lamp: &Lamp, found: &Found<S>, meetings: &mut Meetings<S>) {
    let splat = |v: DVec3| each(|axis| S::Wide::constant(v[axis]));
    let Meetings { kinds, to_light, facing, .. } = meetings;
    for (k, kinds) in kinds.iter().enumerate() {
        if kinds.lit == 0 {
            facing[k] = 0;
            continue;
        }
        let first = k * S::Wide::N;
        let dir = space::normalize(space::sub(splat(lamp.position), vector(&found.position, first)));
        let in_front = S::Wide::constant(0.0).cmp_le(dot(vector(&found.normal, first), dir)).bits();
        let in_cone = S::Wide::constant(lamp.cosine).cmp_le(S::Wide::constant(0.0) - dot(dir, splat(lamp.aim))).bits();
        facing[k] = (in_front | kinds.transmits) & in_cone & kinds.lit;
        (0..3).for_each(|axis| dir[axis].store(&mut to_light[axis][first..]));
    }
}

/// Shadow rays from the meetings to the light that they face.
#[inline(never)]
fn aim<S: Real>(found: &Found<S>, meetings: &Meetings<S>, probes: &mut Probes<S>) {
    probes.open(meetings.padded());
    for (k, &facing) in meetings.facing.iter().enumerate().filter(|(_, facing)| **facing != 0) {
        let first = k * S::Wide::N;
        let (position, dir) = (vector(&found.position, first), vector(&meetings.to_light, first));
        let org = each(|axis| dir[axis].mul_add(S::Wide::constant(TOLERANCE), position[axis]));
        probes.push(first, facing, org, dir);
    }
    probes.close();
}

/// Adds the light of `lamp`: diffuse, and the highlight.
///
/// Source of the highlight: Christophe Schlick, "A Fast Alternative to Phong's Specular Model", Graphics Gems IV, 1994.
#[inline(never)]
fn light<S: Real>(lamp: &Lamp, level: &Level<S>, found: &Found<S>, meetings: &mut Meetings<S>) {
    let zero = S::Wide::constant(0.0);
    let Meetings { base, finish, color, to_light, facing, visible, .. } = meetings;
    for (k, &facing) in facing.iter().enumerate().filter(|(_, facing)| **facing != 0) {
        let first = k * S::Wide::N;
        let visible = S::Wide::load(&visible[first..]);
        let lit = facing & zero.cmp_lt(visible).bits();
        if lit == 0 {
            continue;
        }
        let lit = <S::Wide as Lanes>::Mask::from_bits(lit);
        let to_light = vector(to_light, first);
        let (normal, dir) = (vector(&found.normal, first), level.dir(first));
        let cosine = dot(normal, to_light);
        let [shine, specular, diffuse] = vector(finish, first);
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

/// Sends on the mirror rays of those of `lanes`, rays `first + lane`, that meet plain mirrors, and leaves what remains of their own
/// colours, as [`send_on`] does. Which lanes these are.
#[inline(never)]
fn mirror<S: Real>(
    rt: &Rt,
    level: &Level<S>,
    found: &Found<S>,
    meetings: &mut Meetings<S>,
    first: usize,
    lanes: u32,
    next: &mut Level<S>,
) -> u32 {
    let regions = &found.region[first..];
    let is_far = S::Wide::constant(glass::AIR_GAP).cmp_le(S::Wide::load(&found.t[first..])).bits();
    let may_go_on = |lane: &usize| level.carry(first + lane).level <= MAX_BOUNCES;
    let plain = match level.is_primary() {
        true => lanes & is_far,
        false => lanes_of(lanes & is_far).filter(may_go_on).fold(0u32, |plain, lane| plain | 1 << lane),
    };
    let (mut rest, mut done) = (plain, 0);
    while rest != 0 {
        let region = regions[rest.trailing_zeros() as usize % MAX_LANES];
        let same = positions_in::<S::Wide>(regions, region) & rest;
        rest &= !same;
        let Some(finish) = rt.materials[region as usize].finish.as_ref().filter(|finish| finish.is_plain_mirror())
        else {
            continue;
        };
        done |= same;
        let (normal, dir) = (vector(&found.normal, first), level.dir(first));
        let along = normal[0] * dir[0] + normal[1] * dir[1] + normal[2] * dir[2];
        let twice = S::Wide::constant(2.0) * along;
        let mirrored = each(|axis| dir[axis] - normal[axis] * twice);
        next.put(same, [vector(&found.position, first), mirrored], |lane| {
            let carry = level.carry(first + lane);
            let throughput = carry.throughput * finish.reflect;
            super::Carry { level: carry.level + 1, throughput, left: None, ..carry }
        });
        let mask = <S::Wide as Lanes>::Mask::from_bits(same);
        for column in &mut meetings.color {
            let color = S::Wide::load(&column[first..]);
            let own = color * S::Wide::constant(1.0 - finish.reflect);
            S::Wide::select(mask, own, color).store(&mut column[first..]);
        }
    }
    done
}

/// Sends mirror and glass rays on from hit `i`; gives what remains of the surface's own colour.
fn send_on<S: Real>(
    path: Path,
    found: &Found<S>,
    i: usize,
    finish: &Finish,
    base: DVec3,
    color: DVec3,
    next: &mut Level<S>,
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
    let mut send = |dir: DVec3, carry| next.push(&Path { org: position, dir, carry });
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
