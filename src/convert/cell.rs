//! Which edges of one cell belong to one piece of the surface.
//!
//! Source: G. M. Nielson, "Dual Marching Cubes", 2004: a vertex for each closed loop that the surface's cut with the
//! cell's faces makes, not one for each cell. Loops come from the faces here, without a table: on each face the
//! crossed edges are joined in pairs, and a loop is what is joined. A face with four crossed edges can be joined in
//! two ways; which one is decided face by face, so that both cells at it agree.
//!
//! Corner `c` of a cell is at (c & 1, c >> 1 & 1, c >> 2). Edge `4 a + s` runs along axis `a`; bit 0 of `s` is its
//! place on the axis after `a`, bit 1 on the one after that. Face `2 a + s` is across axis `a`, at its lower (0) or
//! upper end.

/// "No crossing on this edge."
pub const NONE: u8 = u8::MAX;

/// The lower corner of an edge.
pub const fn lower_corner(edge: usize) -> usize {
    let (a, s) = (edge / 4, edge % 4);
    (s & 1) << ((a + 1) % 3) | (s >> 1) << ((a + 2) % 3)
}

/// The edge along `axis` that has `corner` at an end.
const fn edge_at(axis: usize, corner: usize) -> usize {
    4 * axis + (corner >> ((axis + 1) % 3) & 1) + 2 * (corner >> ((axis + 2) % 3) & 1)
}

/// The four corners of a face, in order around it.
pub fn face_corners(face: usize) -> [usize; 4] {
    let (a, s) = (face / 2, face % 2);
    let (b, c) = (1 << ((a + 1) % 3), 1 << ((a + 2) % 3));
    [0, b, b + c, c].map(|corner| corner + (s << a))
}

/// Whether a face has two inside corners across from each other, and two outside ones.
pub fn is_ambiguous(inside: u8, face: usize) -> bool {
    let [a, b, c, d] = face_corners(face).map(|corner| inside >> corner & 1);
    a == c && b == d && a != b
}

/// The two pairs of edges that an ambiguous face joins: each cuts off an inside corner or, where the face connects
/// its inside corners, an outside one.
pub fn face_pairs(inside: u8, face: usize, connects: bool) -> [[usize; 2]; 2] {
    let (b, c) = ((face / 2 + 1) % 3, (face / 2 + 2) % 3);
    let corners = face_corners(face);
    let first = usize::from((inside >> corners[0] & 1 != 0) == connects);
    [first, first + 2].map(|i| [edge_at(b, corners[i]), edge_at(c, corners[i])])
}

/// Number of the loop that each edge belongs to, [`NONE`] if it is not crossed, and how many loops there are.
/// `inside`: a bit for each corner; `connects`: a bit for each ambiguous face that connects its inside corners.
pub fn loops(inside: u8, connects: u8) -> ([u8; 12], u8) {
    let crossed = |edge: usize| {
        let low = lower_corner(edge);
        (inside >> low ^ inside >> (low + (1 << (edge / 4)))) & 1 != 0
    };
    let mut of = [NONE; 12];
    for edge in (0..12).filter(|&e| crossed(e)) {
        of[edge] = edge as u8;
    }
    let mut join = |[a, b]: [usize; 2]| {
        let (keep, drop) = (of[a].min(of[b]), of[a].max(of[b]));
        of.iter_mut().filter(|l| **l == drop).for_each(|l| *l = keep);
    };
    for face in 0..6 {
        if is_ambiguous(inside, face) {
            face_pairs(inside, face, connects >> face & 1 != 0).into_iter().for_each(&mut join);
            continue;
        }
        let (a, corners) = (face / 2, face_corners(face));
        let sides = [(a + 1) % 3, (a + 2) % 3, (a + 1) % 3, (a + 2) % 3];
        let mut met = (0..4).map(|i| edge_at(sides[i], corners[i])).filter(|&e| crossed(e));
        if let (Some(one), Some(other)) = (met.next(), met.next()) {
            join([one, other]);
        }
    }
    let mut count = 0;
    for edge in 0..12 {
        if of[edge] == edge as u8 {
            // The high bit keeps final numbers apart from names of loops, which are edges.
            of.iter_mut().filter(|l| **l == edge as u8).for_each(|l| *l = 0x80 | count);
            count += 1;
        }
    }
    (of.map(|l| if l == NONE { NONE } else { l & 0x7f }), count)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn edges_and_corners_by_hand() {
        assert_eq!([0, 1, 2, 3].map(lower_corner), [0, 2, 4, 6]);
        assert_eq!([4, 5, 6, 7].map(lower_corner), [0, 4, 1, 5]);
        assert_eq!([8, 9, 10, 11].map(lower_corner), [0, 1, 2, 3]);
        for edge in 0..12 {
            assert_eq!(edge_at(edge / 4, lower_corner(edge)), edge);
        }
    }

    #[test]
    fn loops_by_hand() {
        assert_eq!(loops(0, 0), ([NONE; 12], 0));
        assert_eq!(loops(0xff, 0).1, 0);
        // One corner; two across a face; two across the cell; a side.
        assert_eq!(loops(0b1, 0).1, 1);
        assert_eq!(loops(0b1001, 0).1, 2);
        assert_eq!(loops(0b1001, 0b01_0000).1, 1, "the face z = 0 connects them");
        assert_eq!(loops(0b1000_0001, 0).1, 2);
        assert_eq!(loops(0b1111, 0).1, 1);
        // Every second corner: each for itself, or all but the outside ones.
        assert_eq!(loops(0b0110_1001, 0).1, 4);
        assert_eq!(loops(0b0110_1001, 0x3f).1, 4);
    }

    /// Over all corners and all choices: every crossed edge is in a loop, loops have at least three edges, and
    /// changing the choice on a face that has one loop twice always parts that loop.
    #[test]
    fn all_cells() {
        for inside in 0..=255u8 {
            for connects in 0..64u8 {
                let (of, count) = loops(inside, connects);
                for number in 0..count {
                    assert!(of.iter().filter(|l| **l == number).count() >= 3, "{inside:b} {connects:b}");
                }
                assert!(of.iter().all(|l| *l == NONE || *l < count));
                for face in (0..6).filter(|&f| is_ambiguous(inside, f)) {
                    let pairs = face_pairs(inside, face, connects >> face & 1 != 0);
                    let more = loops(inside, connects ^ 1 << face).1;
                    let one = of[pairs[0][0]] == of[pairs[1][0]];
                    assert_eq!(more, if one { count + 1 } else { count - 1 }, "{inside:b} {connects:b} {face}");
                }
            }
        }
    }
}
