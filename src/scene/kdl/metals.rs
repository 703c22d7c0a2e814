//! Measured metals: complex indices of refraction for red, green and blue.
//!
//! Measured tables, read at the dominant wavelengths of the primaries of Rec.709 (611.4, 549.1 and 464.2 nm; linear
//! between the nearest measured ones). Sources: gold, silver, copper: P. B. Johnson and R. W. Christy, "Optical
//! Constants of the Noble Metals", Physical Review B 6, 1972; chromium, iron, nickel, titanium: the same, "Optical
//! Constants of Transition Metals", Physical Review B 9, 1974; aluminium: A. D. Rakić, "Algorithm for the
//! Determination of Intrinsic Optical Constants of Metal Films", Applied Optics 34, 1995.

use glam::{DVec3, dvec3};

/// A metal's name, eta and k.
type Metal = (&'static str, DVec3, DVec3);

/// The metals.
const METALS: [Metal; 8] = [
    ("aluminium", dvec3(1.322, 1.011, 0.683), dvec3(7.311, 6.617, 5.625)),
    ("chromium", dvec3(3.178, 3.180, 2.449), dvec3(3.300, 3.330, 3.206)),
    ("copper", dvec3(0.362, 1.015, 1.246), dvec3(3.127, 2.579, 2.453)),
    ("gold", dvec3(0.222, 0.428, 1.335), dvec3(3.208, 2.461, 1.872)),
    ("iron", dvec3(2.890, 2.950, 2.643), dvec3(3.040, 2.930, 2.803)),
    ("nickel", dvec3(1.985, 1.920, 1.763), dvec3(3.985, 3.611, 3.042)),
    ("silver", dvec3(0.058, 0.060, 0.046), dvec3(4.106, 3.590, 2.795)),
    ("titanium", dvec3(2.659, 2.540, 2.303), dvec3(3.698, 3.430, 3.080)),
];

/// Real and imaginary part of the index of the metal called `name`.
pub fn index_of(name: &str) -> Option<(DVec3, DVec3)> {
    METALS.iter().find(|metal| metal.0 == name).map(|&(_, eta, k)| (eta, k))
}

/// The names that [`index_of`] knows.
pub fn names() -> impl Iterator<Item = &'static str> {
    METALS.iter().map(|metal| metal.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn metals_have_their_colours() {
        // Reflectance at normal incidence (Fresnel's equations) as sRGB-linear colour.
        let reflectance = |name: &str| {
            let (eta, k) = index_of(name).unwrap();
            let square = |x: DVec3| x * x;
            (square(eta - 1.0) + square(k)) / (square(eta + 1.0) + square(k))
        };
        let gold = reflectance("gold");
        assert!(gold.x > 0.9 && gold.y > 0.7 && gold.z < 0.45, "{gold}");
        let copper = reflectance("copper");
        assert!(copper.x > 0.85 && (0.5..0.7).contains(&copper.y) && copper.z < copper.y, "{copper}");
        // Textbooks give silver 98 %, aluminium 91 % in the visible.
        assert!(reflectance("silver").min_element() > 0.95);
        assert!((reflectance("aluminium") - 0.915).abs().max_element() < 0.02);
        assert!(
            names().all(|name| reflectance(name).cmpgt(DVec3::ZERO).all() && reflectance(name).max_element() < 1.0)
        );
    }
}
