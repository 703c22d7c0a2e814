//! What shines evenly, as numbers for packets that aim at it.

use glam::DVec3;

use super::emitter::Emitter;
use crate::lanes::Real;
use crate::shade::look::Looks;
use crate::shade::offset::chosen_error;

/// Numbers of [`Form::Triangle`].
pub const FLAT: usize = 20;
/// Numbers of [`Form::Ball`].
pub const BALL: usize = 8;

/// What packets need to know of something that shines evenly, to aim at it in lanes.
#[derive(Clone, Copy, Debug)]
pub enum Form<S> {
    /// Of a triangle: corner, edge, edge, normal, radiance to the front, radiance to the back, three numbers each; area; see
    /// [`chosen_error`].
    Triangle([S; FLAT]),
    /// Of a sphere: centre, radius, radiance to the outside; see [`chosen_error`].
    Ball([S; BALL]),
    /// Of the sky: its radiance.
    Sky([S; 3]),
    /// One by one.
    Other,
}

/// Kinds of [`Form`]s.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// [`Form::Triangle`]
    Triangle,
    /// [`Form::Ball`]
    Ball,
    /// [`Form::Sky`]
    Sky,
    /// [`Form::Other`]
    Other,
}

impl<S> Form<S> {
    /// Its kind.
    pub fn kind(&self) -> Kind {
        match self {
            Self::Triangle(_) => Kind::Triangle,
            Self::Ball(_) => Kind::Ball,
            Self::Sky(_) => Kind::Sky,
            Self::Other => Kind::Other,
        }
    }

    /// The numbers of a triangle.
    pub fn triangle(&self) -> Option<&[S; FLAT]> {
        if let Self::Triangle(numbers) = self { Some(numbers) } else { None }
    }

    /// The numbers of a sphere.
    pub fn ball(&self) -> Option<&[S; BALL]> {
        if let Self::Ball(numbers) = self { Some(numbers) } else { None }
    }

    /// The radiance of the sky.
    pub fn sky(&self) -> Option<&[S; 3]> {
        if let Self::Sky(radiance) = self { Some(radiance) } else { None }
    }
}

impl Emitter {
    /// What packets need of it.
    pub fn form<S: Real>(&self, looks: &Looks<'_>) -> Form<S> {
        let is_even = |material: u32| !looks.has_pictured_emission(material) && !looks.is_holed(material);
        match *self {
            Self::Triangle { corner, edges, normal, area, magnitude, material, .. } if is_even(material) => {
                let [front, back] = [true, false].map(|side| looks.plain_emission(material, side));
                Form::Triangle(list(
                    &[corner, edges[0], edges[1], normal, front, back],
                    &[area, chosen_error::<S>(magnitude)],
                ))
            }
            Self::Sphere { centre, radius, magnitude, material, .. } if is_even(material) => {
                let [x, y, z] = centre.to_array();
                let [red, green, blue] = looks.plain_emission(material, true).to_array();
                let error = chosen_error::<S>(magnitude);
                Form::Ball([x, y, z, radius, red, green, blue, error].map(S::from_f64))
            }
            _ => Form::Other,
        }
    }
}

/// `vectors` and the `last` ones, number by number.
fn list<S: Real, const K: usize>(vectors: &[DVec3], last: &[f64]) -> [S; K] {
    let mut numbers = [S::ZERO; K];
    let all = vectors.iter().flat_map(|v| v.to_array()).chain(last.iter().copied());
    numbers.iter_mut().zip(all).for_each(|(to, from)| *to = S::from_f64(from));
    numbers
}
