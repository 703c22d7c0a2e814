//! Light from an environment picture, sampled by its brightness.

use std::f64::consts::{FRAC_1_PI, PI, TAU};

use glam::DVec3;

use crate::scene::light::Environment;

/// An environment made ready.
#[derive(Debug)]
pub struct Sky<'a> {
    environment: &'a Environment,
    columns: usize,
    rows: usize,
    /// Per row: sums of brightness times solid angle up to and with each column, the last one 1.
    in_row: Vec<f32>,
    /// The same of whole rows.
    of_rows: Vec<f32>,
    /// Cosines of the latitudes between rows.
    edges: Vec<f64>,
    /// Integral of brightness over all directions.
    brightness: f64,
    /// The radiance from all directions, if it is the same.
    even: Option<DVec3>,
}

impl<'a> Sky<'a> {
    /// `environment` made ready.
    pub fn new(environment: &'a Environment) -> Self {
        let (columns, rows) = (environment.texture.width as usize, environment.texture.height as usize);
        let (mut in_row, mut of_rows) = (Vec::with_capacity(columns * rows), Vec::with_capacity(rows));
        let mut total = 0.0;
        let edges: Vec<f64> = (0..=rows).map(|i| (PI * i as f64 / rows as f64).cos()).collect();
        let texel = |column: usize, row: usize| {
            environment.radiance_at([(column as f64 + 0.5) / columns as f64, (row as f64 + 0.5) / rows as f64])
        };
        let mut even = Some(texel(0, 0));
        for row in 0..rows {
            let solid_angle = TAU / columns as f64 * (edges[row] - edges[row + 1]);
            let weights: Vec<f64> = (0..columns)
                .map(|column| {
                    let radiance = texel(column, row);
                    even = even.filter(|first| *first == radiance);
                    radiance.element_sum() / 3.0 * solid_angle
                })
                .collect();
            let sum: f64 = weights.iter().sum();
            total += sum;
            of_rows.push(total);
            let mut up_to = 0.0;
            in_row.extend(weights.iter().map(|w| {
                up_to += w;
                (if sum > 0.0 { up_to / sum } else { 1.0 }) as f32
            }));
        }
        let of_rows = of_rows.iter().map(|sum| (if total > 0.0 { sum / total } else { 1.0 }) as f32).collect();
        Self { environment, columns, rows, in_row, of_rows, edges, brightness: total, even }
    }

    /// Integral of the radiance's brightness over all directions.
    pub fn brightness(&self) -> f64 {
        self.brightness
    }

    /// The radiance from all directions, if it is the same.
    pub fn even(&self) -> Option<DVec3> {
        self.even
    }

    /// Radiance from direction `dir` (where one looks; need not be unit) and the density of [`Self::sample`] there.
    pub fn seen(&self, dir: DVec3) -> (DVec3, f64) {
        if let Some(radiance) = self.even {
            return (radiance, if self.brightness > 0.0 { 0.25 * FRAC_1_PI } else { 0.0 });
        }
        let place = self.environment.place(dir);
        (self.environment.radiance_at(place), self.pdf(place))
    }

    /// A direction by brightness, unit, world space, the radiance from there, and the density per solid angle.
    pub fn sample(&self, place: [f64; 2]) -> Option<(DVec3, DVec3, f64)> {
        if self.brightness <= 0.0 {
            return None;
        }
        let toward = |longitude: f64, cos: f64| {
            let sin = (1.0 - cos * cos).max(0.0).sqrt();
            let (x, z) = longitude.sin_cos();
            self.environment.to_world * DVec3::new(sin * x, cos, -sin * z)
        };
        if let Some(radiance) = self.even {
            let dir = toward((place[0] - 0.5) * TAU, 1.0 - 2.0 * place[1]);
            return Some((dir, radiance, 0.25 * FRAC_1_PI));
        }
        let (row, y) = invert(&self.of_rows, place[1]);
        let (column, x) = invert(&self.in_row[row * self.columns..][..self.columns], place[0]);
        let longitude = ((column as f64 + x) / self.columns as f64 - 0.5) * TAU;
        // Uniform in the cosine of the latitude within the row.
        let cos = self.edges[row] + (self.edges[row + 1] - self.edges[row]) * y;
        let dir = toward(longitude, cos);
        Some((dir, self.environment.radiance(dir), self.cell_pdf(row, column)))
    }

    /// Density of [`Self::sample`] at a place of the picture.
    fn pdf(&self, [u, v]: [f64; 2]) -> f64 {
        if self.brightness <= 0.0 {
            return 0.0;
        }
        let cell = |x: f64, count: usize| ((x * count as f64) as usize).min(count - 1);
        self.cell_pdf(cell(v, self.rows), cell(u, self.columns))
    }

    fn cell_pdf(&self, row: usize, column: usize) -> f64 {
        let step = |sums: &[f32], i: usize| f64::from(sums[i]) - if i > 0 { f64::from(sums[i - 1]) } else { 0.0 };
        let solid_angle = TAU / self.columns as f64 * (self.edges[row] - self.edges[row + 1]);
        let in_row = &self.in_row[row * self.columns..][..self.columns];
        step(&self.of_rows, row) * step(in_row, column) / solid_angle
    }
}

/// The cell of `sums` in which `u` falls, and where inside.
fn invert(sums: &[f32], u: f64) -> (usize, f64) {
    let cell = sums.partition_point(|&sum| f64::from(sum) <= u).min(sums.len() - 1);
    let below = if cell > 0 { f64::from(sums[cell - 1]) } else { 0.0 };
    let width = f64::from(sums[cell]) - below;
    (cell, if width > 0.0 { ((u - below) / width).clamp(0.0, 1.0) } else { 0.5 })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::sampling::PixelRandom;
    use crate::scene::texture::{Texels, Texture};
    use glam::DMat3;

    fn environment() -> Environment {
        // Dim, with one bright texel up and to the right.
        let texel = |i: u32| if i == 8 + 6 { [90.0, 60.0, 30.0, 1.0] } else { [0.5, 0.6, 0.7, 1.0] };
        let texels = Texels::Float((0..32).map(texel).collect());
        let texture = Texture { name: String::new(), width: 8, height: 4, texels };
        let to_world = DMat3::from_rotation_y(0.7);
        Environment { texture: texture.into(), scale: DVec3::splat(2.0), to_world }
    }

    #[test]
    fn directions_have_the_density_they_say_and_integrate_to_the_radiance() {
        let environment = environment();
        let sky = Sky::new(&environment);
        let (n, random) = (200_000, PixelRandom::new(1, 2, 3));
        let (mut by_light, mut uniform, mut area) = (DVec3::ZERO, DVec3::ZERO, 0.0);
        for k in 0..n {
            let u = random.spread(k, 0);
            let (dir, radiance, pdf) = sky.sample(u).unwrap();
            assert!((dir.length() - 1.0).abs() < 1e-9 && (sky.seen(dir).1 / pdf - 1.0).abs() < 1e-2 || k % 97 != 0);
            by_light += radiance / pdf / f64::from(n);
            area += 1.0 / pdf / f64::from(n);
            let z = 1.0 - 2.0 * u[0];
            let s = (1.0 - z * z).sqrt();
            let any = DVec3::new(s * (TAU * u[1]).cos(), z, s * (TAU * u[1]).sin());
            uniform += sky.seen(any).0 * 4.0 * PI / f64::from(n);
        }
        assert!((area / (4.0 * PI) - 1.0).abs() < 0.01, "densities integrate to one: {area}");
        assert!(((by_light - uniform) / uniform).abs().max_element() < 0.01, "{by_light} {uniform}");
    }

    #[test]
    fn an_even_sky_is_what_its_picture_says() {
        let uneven = environment();
        let texels = Texels::Float(vec![[0.5, 0.6, 0.7, 1.0]; 32]);
        let texture = Texture { name: String::new(), width: 8, height: 4, texels };
        let environment = Environment { texture: texture.into(), ..uneven };
        let (sky, uneven) = (Sky::new(&environment), Sky::new(&uneven));
        assert!(sky.even.is_some() && uneven.even.is_none());
        assert!((sky.brightness() / (4.0 * PI * 1.2) - 1.0).abs() < 1e-6);
        let by_cells = Sky { even: None, ..Sky::new(&environment) };
        let random = PixelRandom::new(4, 5, 6);
        for k in 0..1000 {
            let u = random.spread(k, 0);
            let ((dir, radiance, pdf), (other, other_radiance, other_pdf)) =
                (sky.sample(u).unwrap(), by_cells.sample(u).unwrap());
            assert!((dir - other).length() < 1e-5, "{k}: {dir} {other}");
            assert!((radiance - other_radiance).length() < 1e-6 && (pdf / other_pdf - 1.0).abs() < 1e-5, "{k}");
            assert_eq!(sky.seen(dir), (radiance, pdf));
        }
    }
}
