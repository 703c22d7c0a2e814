//! Boolean expressions in postfix order, and the grouping that databases of version 4 mean.
//!
//! Source of the grouping: BRL-CAD's member lists follow GIFT (Geometric Information For Targets): unions bind
//! least, differences and intersections are taken from left to right within a term, and the operator of the first
//! member says nothing. `a u b - c + d u e` is `a u ((b - c) + d) u e`.

/// One step of an expression in postfix order.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Step {
    /// Puts member number so-and-so on the stack.
    Member(u32),
    /// Puts nothing on the stack: the empty set.
    Empty,
    /// Replaces two by what is in either.
    Union,
    /// Replaces two by what is in both.
    Intersection,
    /// Replaces two by what is in the lower one and not in the upper one.
    Difference,
    /// Replaces two by what is in exactly one.
    ExclusiveOr,
}

/// A well-formed expression: applied from the first step to the last it leaves exactly one value.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Expression(Vec<Step>);

impl Default for Expression {
    /// The empty set.
    fn default() -> Self {
        Self(vec![Step::Empty])
    }
}

impl Expression {
    /// `steps`, if they are well formed.
    pub fn new(steps: Vec<Step>) -> Option<Self> {
        let mut depth = 0usize;
        for step in &steps {
            match step {
                Step::Member(_) | Step::Empty => depth += 1,
                _ => depth = depth.checked_sub(1).filter(|&d| d > 0)?,
            }
        }
        (depth == 1).then_some(Self(steps))
    }

    /// The steps.
    pub fn steps(&self) -> &[Step] {
        &self.0
    }

    /// The expression that a list of members with their operators means. The members are numbered in order.
    pub(super) fn from_gift(operators: &[Step]) -> Self {
        let mut steps = Vec::with_capacity(2 * operators.len());
        // Whether a finished sum of terms lies below the current term.
        let mut sum = false;
        for (i, &operator) in operators.iter().enumerate() {
            let member = Step::Member(i as u32);
            match operator {
                _ if i == 0 => steps.push(member),
                Step::Union => {
                    if sum {
                        steps.push(Step::Union);
                    }
                    sum = true;
                    steps.push(member);
                }
                _ => steps.extend([member, operator]),
            }
        }
        if sum {
            steps.push(Step::Union);
        }
        Self::new(steps).unwrap_or_default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// The value of an expression where member i is set `sets[i]` of eight points.
    fn value(expression: &Expression, sets: &[u8]) -> u8 {
        let mut stack = Vec::new();
        for step in expression.steps() {
            let value = match *step {
                Step::Member(i) => sets[i as usize],
                Step::Empty => 0,
                operator => {
                    let (b, a): (u8, u8) = (stack.pop().unwrap(), stack.pop().unwrap());
                    match operator {
                        Step::Union => a | b,
                        Step::Intersection => a & b,
                        Step::Difference => a & !b,
                        _ => a ^ b,
                    }
                }
            };
            stack.push(value);
        }
        assert_eq!(stack.len(), 1);
        stack[0]
    }

    #[test]
    fn the_first_operator_is_ignored_and_nothing_is_the_empty_set() {
        assert_eq!(Expression::from_gift(&[]).steps(), [Step::Empty]);
        assert_eq!(Expression::from_gift(&[Step::Difference]).steps(), [Step::Member(0)]);
        assert_eq!(Expression::new(vec![Step::Member(0), Step::Union]), None);
        assert_eq!(Expression::new(vec![Step::Member(0), Step::Empty]), None);
        assert_eq!(Expression::new(vec![]), None);
    }

    proptest! {
        /// Independent of the postfix form: split at the unions, fold each term from the left, or them together.
        #[test]
        fn grouping_is_terms_of_a_union(members in prop::collection::vec((0..3usize, any::<u8>()), 1..12)) {
            const OPERATORS: [Step; 3] = [Step::Union, Step::Difference, Step::Intersection];
            let operators: Vec<Step> = members.iter().map(|m| OPERATORS[m.0]).collect();
            let sets: Vec<u8> = members.iter().map(|m| m.1).collect();
            let (mut sum, mut term) = (0, sets[0]);
            for (operator, set) in operators.iter().zip(&sets).skip(1) {
                match operator {
                    Step::Union => (sum, term) = (sum | term, *set),
                    Step::Difference => term &= !set,
                    _ => term &= set,
                }
            }
            prop_assert_eq!(value(&Expression::from_gift(&operators), &sets), sum | term);
        }
    }
}
