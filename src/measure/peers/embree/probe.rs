//! Which layout of hits a library was compiled with.
//!
//! The headers let whoever builds Embree choose how many instance numbers a hit has (`RTC_MAX_INSTANCE_LEVEL_COUNT`,
//! `RTC_GEOMETRY_INSTANCE_ARRAY`), and no property of the device tells. So one triangle is hit by packets whose hit
//! rows, and many rows after them, hold a pattern; the rows that lose it are the rows this library writes. What it
//! writes for a scene without instances is the same for every such scene.

use super::api::{Arguments, Handle};
use super::layout::{self, DIR, GEOM, HIT_ROWS, MASK, ORG, PRIM, Packets, T_FAR, U, V, row};
use super::session::Session;
use crate::measure::peers::triangles::Triangles;

/// Rows behind the known ones that are watched.
const WATCHED: usize = 64;
/// Most rows of instance numbers that are made room for: number and array element, one level each.
const MOST: usize = 2;
/// Neither a number Embree writes for a missing instance (all ones) nor one of this scene's answers.
const PATTERN: u32 = 0xa5c3_96e1;

/// Rows of a packet with hits, [`HIT_ROWS`] + 1 or more.
///
/// # Errors
/// If the library does not answer as the headers say, at any packet width.
pub fn hit_rows(session: &Session) -> Result<usize, String> {
    let triangle = Triangles {
        vertices: vec![[0.0, 0.0, 0.0, 0.0], [4.0, 0.0, 0.0, 0.0], [0.0, 4.0, 0.0, 0.0]],
        indices: vec![[0, 1, 2]],
        ids: vec![[0, 0]],
    };
    let scene = session.build(&triangle, &[], false)?;
    let rows = [shoot::<1>, shoot::<4>, shoot::<8>, shoot::<16>].map(|shoot| shoot(session, scene));
    session.release(scene);
    let mut most = HIT_ROWS + 1;
    for rows in rows {
        most = most.max(rows?);
    }
    match most {
        rows if rows <= HIT_ROWS + MOST => Ok(rows),
        rows => Err(format!("its hits have {} rows of instance numbers, at most {MOST} expected", rows - HIT_ROWS)),
    }
}

/// Hits the triangle at (1, 2, 0) from a distance of 3 and returns one more than the last row written.
fn shoot<const N: usize>(session: &Session, scene: Handle) -> Result<usize, String> {
    let (mut packets, mut valid) = (Packets::<N>::new(1, HIT_ROWS + WATCHED), Packets::<N>::new(1, 1));
    let packet = packets.get_mut(0);
    packet.fill(PATTERN);
    let mut set = |row: usize, bits: u32| packet[row * N..(row + 1) * N].fill(bits);
    (0..layout::RAY_ROWS).for_each(|row| set(row, 0));
    for (row, x) in [(ORG, 1.0f32), (ORG + 1, 2.0), (ORG + 2, 3.0), (DIR + 2, -1.0), (T_FAR, 100.0)] {
        set(row, x.to_bits());
    }
    set(MASK, u32::MAX);
    set(GEOM, u32::MAX);
    valid.get_mut(0).fill(u32::MAX);
    session.query_in::<N, false>(scene, valid.get(0), packet, &mut Arguments::new(false));
    session.check()?;
    // u and v weigh the second and third corner: (1, 2) = 1/4 (4, 0) + 1/2 (0, 4).
    let reals = [(T_FAR, 3.0), (U, 0.25), (V, 0.5)];
    let right =
        |&(r, x): &(usize, f32)| row::<N>(packet, r).iter().all(|&bits| (f32::from_bits(bits) - x).abs() < 1e-5);
    let numbers = [PRIM, GEOM].iter().all(|&r| row::<N>(packet, r).iter().all(|&n| n == 0));
    if !reals.iter().all(right) || !numbers {
        return Err(format!("its {N}-wide hits are not laid out as Embree 4's headers say"));
    }
    let last = packet.iter().rposition(|&word| word != PATTERN).unwrap_or(0);
    Ok(last / N + 1)
}
