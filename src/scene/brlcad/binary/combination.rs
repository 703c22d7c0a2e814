//! The body of a combination: matrices, then members, then operators in postfix order.

use super::cursor::Cursor;
use crate::error::Result;
use crate::scene::brlcad::boolean::{Expression, Step};
use crate::scene::brlcad::matrix;
use crate::scene::brlcad::model::{Combination, Member};

/// Reads a body: the code of the width of all numbers; how many matrices, members, bytes of members and operators
/// there are, and how deep a stack they need; then those. A member is a name, a zero byte and the number of its
/// matrix, -1 for none. Without operators, it is the union of the members.
pub(super) fn read(mut body: Cursor<'_>) -> Result<Combination> {
    let start = body.clone();
    let width = body.byte("the width of a combination's numbers")?;
    if width > 3 {
        return Err(start.error(format!("expected the width of a combination's numbers, 0 to 3, found {width}")));
    }
    let mut count = |what: &str| body.length(width, what);
    let (matrices, leaves) = (count("the number of matrices")?, count("the number of members")?);
    let (leaf_bytes, operators) = (count("the length of the members")?, count("the length of the expression")?);
    count("the depth of the expression")?;
    let mut table = body.part(matrices.saturating_mul(128), "matrices")?;
    let mut maps = Vec::with_capacity(table.left() / 128);
    while table.left() > 0 {
        let at = table.clone();
        let mut m = [0.0; 16];
        for number in &mut m {
            *number = table.number("a number of a matrix")?;
        }
        maps.push(matrix::affine(&m).map_err(|what| at.error(what))?);
    }
    let mut list = body.part(leaf_bytes, "members")?;
    let mut members = Vec::new();
    while list.left() > 0 {
        let at = list.clone();
        let name = list.text("the name of a member")?;
        let index = list.signed(width, "the number of a matrix")?;
        let transform = match usize::try_from(index).ok().map(|i| maps.get(i)) {
            None => None,
            Some(Some(map)) => map.clone(),
            Some(None) => {
                let what = format!("expected the number of a matrix below {}, found {index}", maps.len());
                return Err(at.error(what));
            }
        };
        members.push(Member { name, transform });
    }
    if members.len() as u64 != leaves {
        return Err(start.error(format!("expected {leaves} members, found {}", members.len())));
    }
    let expression = if operators == 0 {
        union_of(members.len())
    } else {
        expression(body.part(operators, "an expression")?, members.len())?
    };
    Ok(Combination { expression, members, ..Combination::default() })
}

/// The operators as steps: each member is used once, in order.
fn expression(mut list: Cursor<'_>, members: usize) -> Result<Expression> {
    let start = list.clone();
    let mut steps = Vec::with_capacity(list.left());
    let mut next = 0;
    while list.left() > 0 {
        let at = list.clone();
        steps.push(match list.byte("an operator")? {
            1 => {
                next += 1;
                Step::Member(next - 1)
            }
            2 => Step::Union,
            3 => Step::Intersection,
            4 => Step::Difference,
            5 => Step::ExclusiveOr,
            6 => return Err(at.error("expected an operator with two operands: complements are not supported")),
            other => return Err(at.error(format!("expected a member or an operator, 1 to 5, found {other}"))),
        });
    }
    let whole = Expression::new(steps).filter(|_| next as usize == members);
    whole.ok_or_else(|| start.error(format!("expected an expression that makes one solid of {members} members")))
}

/// The union of all members, as BRL-CAD builds it when it reads such a body: of pairs, then of pairs of pairs, and
/// so on, one that is left over going on as it is.
fn union_of(members: usize) -> Expression {
    let mut steps = Vec::with_capacity(2 * members);
    for i in 0..members {
        steps.push(Step::Member(i as u32));
        steps.extend((0..i.trailing_ones()).map(|_| Step::Union));
    }
    let left_over = members.count_ones().saturating_sub(1);
    steps.extend((0..left_over).map(|_| Step::Union));
    Expression::new(steps).unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The same by its definition: rows of expressions, paired until one is left.
    fn paired(members: usize) -> Vec<Step> {
        let mut row: Vec<Vec<Step>> = (0..members).map(|i| vec![Step::Member(i as u32)]).collect();
        while row.len() > 1 {
            row = row
                .chunks(2)
                .map(|pair| match pair {
                    [a, b] => [a.as_slice(), b, &[Step::Union]].concat(),
                    alone => alone.concat(),
                })
                .collect();
        }
        row.pop().unwrap_or_else(|| vec![Step::Empty])
    }

    #[test]
    fn unions_are_of_pairs() {
        for members in 0..200 {
            assert_eq!(union_of(members).steps(), paired(members), "{members}");
        }
    }
}
