//! How Embree lays out rays and hits in memory: rows of `N` four-byte numbers, `N` being 1, 4, 8 or 16.
//!
//! Source: `RTCRay`, `RTCHit` and their accessors `RTCRayN_*` and `RTCHitN_*` in rtcore_ray.h of Embree 4. The twelve
//! rows of the ray and the first seven of the hit are the same in every build; how many rows of instance numbers
//! follow depends on how the library was compiled, and [`super::probe`] finds out.

use bytemuck::{Pod, Zeroable};

use crate::ray::{INVALID_ID, Rays};

/// Row of `org_x`; y, z and `tnear` follow.
pub const ORG: usize = 0;
/// Row of `tnear`.
pub const T_NEAR: usize = 3;
/// Row of `dir_x`; y, z and `time` follow.
pub const DIR: usize = 4;
/// Row of `tfar`: end of the segment, then t of the hit, or minus infinity where a segment is occluded.
pub const T_FAR: usize = 8;
/// Row of the ray mask; id and flags follow.
pub const MASK: usize = 9;
/// Rows of a ray without hit.
pub const RAY_ROWS: usize = 12;
/// Row of u; v follows. The normal's three rows come before.
pub const U: usize = 15;
/// Row of v.
pub const V: usize = 16;
/// Row of the primitive number.
pub const PRIM: usize = 17;
/// Row of the geometry number.
pub const GEOM: usize = 18;
/// Rows of a ray with a hit, without instance numbers.
pub const HIT_ROWS: usize = 19;
/// Row of the (outermost) instance number, all ones outside of instances.
pub const INST: usize = HIT_ROWS;

/// Memory aligned as the largest packet wants it.
#[repr(C, align(64))]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
struct Line([u32; 16]);

/// Packets of `N` lanes with a fixed number of rows, each aligned as Embree asks: 16 bytes, 32 for `N` = 8, 64 for
/// `N` = 16.
#[derive(Debug)]
pub struct Packets<const N: usize> {
    lines: Vec<Line>,
    stride: usize,
}

impl<const N: usize> Packets<N> {
    /// `count` packets of `rows` rows, zeros.
    pub fn new(count: usize, rows: usize) -> Self {
        let stride = (rows * N).next_multiple_of(N.max(4));
        Self { lines: vec![Line([0; 16]); (count * stride).div_ceil(16)], stride }
    }

    /// Packet `k`, row after row.
    pub fn get(&self, k: usize) -> &[u32] {
        &bytemuck::cast_slice(&self.lines)[k * self.stride..(k + 1) * self.stride]
    }

    /// Packet `k` to write to.
    pub fn get_mut(&mut self, k: usize) -> &mut [u32] {
        &mut bytemuck::cast_slice_mut(&mut self.lines)[k * self.stride..(k + 1) * self.stride]
    }
}

/// One row of a packet.
#[inline(always)]
pub fn row<const N: usize>(packet: &[u32], row: usize) -> &[u32; N] {
    packet[row * N..].first_chunk().expect("a packet has all rows of its layout")
}

/// Fills the ray rows (and, if there are any, the hit rows with a miss) of `packet` with the rays `first..first + N`;
/// sets `valid` to -1 for live rays, else to 0. Returns whether any is live.
pub fn fill<const N: usize>(packet: &mut [u32], valid: &mut [u32], rays: &Rays<f32>, first: usize) -> bool {
    let with_hit = packet.len() > HIT_ROWS * N;
    for lane in 0..N {
        let i = first + lane;
        let live = i < rays.len() && rays.is_live(i);
        valid[lane] = if live { u32::MAX } else { 0 };
        let mut set = |row: usize, bits: u32| packet[row * N + lane] = bits;
        if live {
            for axis in 0..3 {
                set(ORG + axis, rays.org[axis][i].to_bits());
                set(DIR + axis, rays.dir[axis][i].to_bits());
            }
            set(T_NEAR, rays.t_min[i].to_bits());
            set(T_FAR, rays.t_max[i].to_bits());
        } else {
            // A direction, and a segment that ends before it starts: also without a mask it hits nothing.
            set(DIR, 1f32.to_bits());
            set(T_NEAR, 1f32.to_bits());
        }
        set(MASK, u32::MAX);
        if with_hit {
            set(PRIM, INVALID_ID);
            set(GEOM, INVALID_ID);
            set(INST, INVALID_ID);
        }
    }
    valid[..N].iter().any(|&lane| lane != 0)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn aligned<const N: usize>(rows: usize) {
        let packets = Packets::<N>::new(3, rows);
        for k in 0..3 {
            let at = packets.get(k).as_ptr() as usize;
            assert_eq!(at % (4 * N.max(4)), 0, "N {N} rows {rows} packet {k}");
            assert!(packets.get(k).len() >= rows * N);
        }
    }

    #[test]
    fn packets_are_aligned_as_the_headers_ask() {
        for rows in [1, RAY_ROWS, 20, 21] {
            aligned::<1>(rows);
            aligned::<4>(rows);
            aligned::<8>(rows);
            aligned::<16>(rows);
        }
    }

    /// The rows of a packet of four, counted through RTCRay4 and RTCHit4 by hand.
    #[test]
    fn rays_stand_where_the_headers_say() {
        let mut rays = Rays::<f32>::new(6);
        rays.set(5, [1.0, 2.0, 3.0], [4.0, 5.0, 6.0], 0.5, 9.0);
        let (mut packets, mut valid) = (Packets::<4>::new(1, 20), Packets::<4>::new(1, 1));
        assert!(fill::<4>(packets.get_mut(0), valid.get_mut(0), &rays, 4));
        assert_eq!(valid.get(0), [0, u32::MAX, 0, 0]);
        let lane: Vec<u32> = (0..20).map(|row| packets.get(0)[4 * row + 1]).collect();
        let reals: Vec<f32> = lane.iter().map(|&bits| f32::from_bits(bits)).collect();
        assert_eq!(reals[..9], [1.0, 2.0, 3.0, 0.5, 4.0, 5.0, 6.0, 0.0, 9.0]);
        assert_eq!(lane[9..], [u32::MAX, 0, 0, 0, 0, 0, 0, 0, INVALID_ID, INVALID_ID, INVALID_ID]);
        let dead = packets.get(0);
        assert!(f32::from_bits(dead[4 * T_FAR]) < f32::from_bits(dead[4 * T_NEAR]));
        assert!(!fill::<4>(packets.get_mut(0), valid.get_mut(0), &rays, 0));
    }
}
