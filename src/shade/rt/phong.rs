//! Lighting of surfaces, and the rays they send on.

use glam::DVec3;

use super::glass::{self, refract};
use super::material::Finish;
use super::{AIR, AMBIENT, MAX_BOUNCES, Meeting, Path, Rt, Within};
use crate::lanes::Real;
use crate::shade::sample::Sample;
use crate::shade::shader::{Shader, Workspace};

impl<S: Real> Shader<'_, S> {
    /// Lights `meetings`, adds what they show to the pixels and puts mirror and glass rays into `next`.
    pub(super) fn rt_light(
        &self,
        rt: &Rt,
        meetings: &[Meeting],
        next: &mut Vec<Path>,
        work: &mut Workspace<S>,
        out: &mut [Sample],
    ) {
        let mut colors: Vec<DVec3> = meetings.iter().map(|meeting| unlit(rt, meeting)).collect();
        for lamp in rt.lamps.iter().rev() {
            let lit: Vec<usize> = (0..meetings.len())
                .filter(|&i| {
                    let finish = &rt.materials[meetings[i].region as usize].finish;
                    finish.is_some_and(|finish| {
                        let to_light = lamp.position - meetings[i].position;
                        meetings[i].normal.dot(to_light) >= 0.0 || finish.transmit > 0.0
                    })
                })
                .filter(|&i| {
                    let to_light = (lamp.position - meetings[i].position).normalize();
                    -to_light.dot(lamp.aim) >= lamp.cosine
                })
                .collect();
            let visible = self.rt_visible(rt, lamp, &lit, meetings, work);
            for (&i, intensity) in lit.iter().zip(visible) {
                let Some(finish) = rt.materials[meetings[i].region as usize].finish else { continue };
                if intensity > 0.0 {
                    let to_light = (lamp.position - meetings[i].position).normalize();
                    let light = lamp.color * (intensity * lamp.fraction);
                    colors[i] += phong(&finish, &meetings[i], to_light, light);
                }
            }
        }
        for (meeting, color) in meetings.iter().zip(colors) {
            let shown = match rt.materials[meeting.region as usize].finish {
                Some(finish) if finish.reflect > 0.0 || finish.transmit > 0.0 => send_on(meeting, &finish, color, next),
                _ => color,
            };
            out[meeting.path.pixel as usize].radiance += meeting.path.throughput * shown;
        }
    }
}

/// What a surface shows without lights: ambient light, its own light, or a pattern as it is.
fn unlit(rt: &Rt, meeting: &Meeting) -> DVec3 {
    let material = &rt.materials[meeting.region as usize];
    let facing = -meeting.normal.dot(meeting.path.dir);
    if material.is_light {
        let lamp = rt.lamps.iter().find(|lamp| lamp.region == Some(meeting.region));
        return lamp.map_or(meeting.base, |lamp| lamp.seen(facing, meeting.normal));
    }
    if material.finish.is_none() {
        return meeting.base;
    }
    meeting.base * (facing.max(0.0) * AMBIENT)
}

/// Diffuse light and the highlight from the unit direction `to_light`, where `light` arrives.
///
/// Source of the highlight: Christophe Schlick, "A Fast Alternative to Phong's Specular Model", Graphics Gems IV, 1994.
fn phong(finish: &Finish, meeting: &Meeting, to_light: DVec3, light: DVec3) -> DVec3 {
    let cosine = meeting.normal.dot(to_light);
    let mut color = DVec3::ZERO;
    if cosine > 0.0 {
        color += meeting.base * light * (finish.diffuse * cosine);
    }
    let mirrored = meeting.normal * (2.0 * cosine) - to_light;
    let s = -mirrored.dot(meeting.path.dir);
    if s > 0.0 {
        color += light * (finish.specular * s / (finish.shine - finish.shine * s + s));
    }
    color
}

/// Sends mirror and glass rays on; gives what remains of the surface's own colour.
fn send_on(meeting: &Meeting, finish: &Finish, color: DVec3, next: &mut Vec<Path>) -> DVec3 {
    let path = meeting.path;
    if path.level > MAX_BOUNCES {
        return meeting.base;
    }
    let (mut reflect, mut transmit) = (finish.reflect, finish.transmit);
    if meeting.t < glass::AIR_GAP && path.index == finish.index {
        (transmit, reflect) = (transmit + reflect, 0.0);
    }
    let own = (1.0 - (reflect + transmit)).max(0.0);
    if own >= 1.0 {
        return color;
    }
    if transmit > 0.0 {
        let outside = if meeting.t > glass::AIR_GAP { AIR } else { path.index };
        match refract(path.dir, meeting.normal, outside, finish.index) {
            Ok(dir) => next.push(Path {
                org: meeting.position,
                dir,
                throughput: path.throughput * meeting.base * transmit,
                within: Some(Within { region: meeting.region, index: finish.index, reflections: 0 }),
                left: None,
                ..path
            }),
            Err(_) => reflect += transmit,
        }
    }
    if reflect > 0.0 {
        next.push(Path {
            org: meeting.position,
            dir: path.dir - meeting.normal * (2.0 * path.dir.dot(meeting.normal)),
            level: path.level + 1,
            throughput: path.throughput * reflect,
            left: None,
            ..path
        });
    }
    color * own
}
