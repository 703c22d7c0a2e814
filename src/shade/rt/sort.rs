//! Tells the hits of a level apart: what goes on as it is, what is lit, what leaves the scene.

use glam::DVec3;

use super::level::{Found, Level};
use super::parameters::uv_of_direction;
use super::pattern::Pattern;
use super::{BACKGROUND, Carry, INSIDE, MAX_BOUNCES, Memory, Path, Rt, THIN, glass};
use crate::lanes::chosen::{lanes_of, packets};
use crate::lanes::{LaneMask, Lanes, Lanes3, Real, each, map3};
use crate::ray::Hits;
use crate::shade::sample::Samples;
use crate::shade::shader::{Shader, Workspace};

impl<S: Real> Shader<'_, S> {
    /// Paths of the level that meet nothing show what surrounds the scene, or become its lost ones, those that go on as they are go
    /// to the next one, those that enter regions to the meetings.
    pub(super) fn rt_sort(&self, rt: &Rt, memory: &mut Memory<S>, hits: &Hits<S>, out: &mut Samples) {
        let Memory { level, next, found, meetings, lost, dark, .. } = memory;
        let padded = level.rays.padded_len();
        meetings.open(padded);
        lost.clear();
        let mut sky = Sky::new(rt);
        for (k, first) in (0..padded).step_by(S::Wide::N).enumerate() {
            let [live, within] = level.lanes(k);
            lanes_of(within).for_each(|lane| glass::step(level, first + lane, found, next));
            let (free, hit, leaving) = (live & !within, found.hit[k], found.leaving[k]);
            let gone = free & !hit;
            let doubtful = rt.endless.may_hold(level.dir(first), gone);
            lost.push(doubtful);
            let gone = gone & !doubtful;
            if level.is_primary() {
                let color =
                    if gone == 0 { [S::Wide::constant(0.0); 3] } else { sky.color::<S>(level.dir(first), gone) };
                out.colors.start_lanes(first, gone, color);
            } else if gone != 0 {
                level.show(first, gone, sky.color::<S>(level.dir(first), gone), out);
            }
            for i in lanes_of(free & leaving).map(|lane| first + lane) {
                if level.is_primary() {
                    out.colors.make_opaque(i);
                    dark.push(i as u32);
                }
                leave(level, i, found, next, out);
            }
            meetings.add(rt, self.world, found, &hits.prim, first, free & hit & !leaving);
        }
    }

    /// Rays that nothing stops, but that may be inside a solid without end: they leave it when they look back, and show it, or what
    /// surrounds the scene.
    pub(super) fn rt_lost(&self, rt: &Rt, memory: &mut Memory<S>, work: &mut Workspace<S>, out: &mut Samples) {
        let Memory { level, lost, inside, back, shadow, .. } = memory;
        let doubtful: Vec<usize> =
            packets::<S::Wide>(lost).flat_map(|(first, lanes)| lanes_of(lanes).map(move |lane| first + lane)).collect();
        if doubtful.is_empty() {
            return;
        }
        let turned = |path: Path| Path { dir: -path.dir, ..path };
        back.open(doubtful.len());
        doubtful.iter().for_each(|&i| back.push(&turned(level.path(i))));
        back.close();
        self.intersect_all(&back.rays, work);
        shadow.set(self.world, back, &work.hits);
        inside.clear();
        inside.extend_from_slice(lost);
        for (k, &i) in doubtful.iter().enumerate() {
            let is_inside = shadow.is_leaving(k) && rt.endless.contains(shadow.region[k]);
            inside[i / S::Wide::N] &= !(u32::from(!is_inside) << (i % S::Wide::N));
        }
        let mut sky = Sky::new(rt);
        for (first, lanes) in packets::<S::Wide>(lost) {
            let within = inside[first / S::Wide::N];
            let color = sky.color::<S>(level.dir(first), lanes);
            level.show(first, lanes & !within, color, out);
            level.show(first, within, [S::Wide::constant(INSIDE.0); 3], out);
        }
    }
}

/// Path `i` of `level` meets a region from inside: it goes on if it has only just left glass, or shows the inside.
#[cold]
fn leave<S: Real>(level: &Level<S>, i: usize, found: &Found<S>, next: &mut Level<S>, out: &mut Samples) {
    let path = level.path(i);
    let carry = path.carry;
    if carry.left == Some(found.region[i]) && found.t[i].to_f64() < THIN {
        next.push(&Path { org: found.position(i), carry: Carry { left: None, ..carry }, ..path });
    } else {
        let color = INSIDE.0 * INSIDE.1.powi((MAX_BOUNCES + 1).saturating_sub(carry.level) as i32);
        out.colors.add(carry.pixel as usize, carry.throughput * color);
    }
}

/// What surrounds the scene.
pub(super) struct Sky<'a> {
    pattern: Option<&'a Pattern>,
    /// Rays of parallel projection all have one direction: the last one's colour.
    last: (DVec3, DVec3),
}

impl<'a> Sky<'a> {
    pub fn new(rt: &'a Rt) -> Self {
        Self { pattern: rt.surroundings.as_ref(), last: Default::default() }
    }

    /// What `lanes` of the rays along `dir` see.
    #[inline]
    pub fn color<S: Real>(&mut self, dir: Lanes3<S::Wide>, lanes: u32) -> Lanes3<S::Wide> {
        match self.pattern {
            None => each(|axis| S::Wide::constant(BACKGROUND[axis])),
            Some(pattern) => self.patterned::<S>(pattern, dir, lanes),
        }
    }

    /// The same of a pattern.
    #[inline(never)]
    fn patterned<S: Real>(&mut self, pattern: &Pattern, dir: Lanes3<S::Wide>, lanes: u32) -> Lanes3<S::Wide> {
        let splat = |v: DVec3| each(|axis| S::Wide::constant(v[axis]));
        let lead = lanes.trailing_zeros() as usize;
        let one = map3(dir, |x| x.lane(lead));
        let [x, y, z] = each(|axis| dir[axis].cmp_eq(S::Wide::splat(one[axis])));
        if (x & y & z).bits() & lanes != lanes {
            return pattern.color(uv_of_direction(dir));
        }
        let one = DVec3::from(map3(one, S::to_f64));
        if one != self.last.0 {
            self.last = (one, DVec3::from(pattern.color(uv_of_direction(one.to_array()))));
        }
        splat(self.last.1)
    }
}
