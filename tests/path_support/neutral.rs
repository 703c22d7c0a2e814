//! Scenes of tests/mitsuba: JSON files that both sides of a comparison read, each by its own code.
#![allow(dead_code, reason = "each program uses its own part of this module")]

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;

use glam::{DAffine3, DMat3, DVec3};
use lanecast::camera::Camera;
use lanecast::scene::description::{CameraDescription, Description, Item, ItemKind, Material, Projection, Shape};
use lanecast::scene::light::Environment;
use lanecast::scene::material::Scattering;
use lanecast::scene::mesh::Mesh;
use lanecast::scene::texture::{Texels, Texture};
use serde::Deserialize;

/// A scene file.
#[derive(Debug, Deserialize)]
pub struct Neutral {
    camera: Eye,
    /// Scatterings of a path at most.
    pub depth: u32,
    /// Radiance from all directions.
    environment: DVec,
    materials: BTreeMap<String, Stuff>,
    objects: Vec<Object>,
}

type DVec = [f64; 3];

#[derive(Debug, Deserialize)]
struct Eye {
    eye: DVec,
    look_at: DVec,
    up: DVec,
    /// Full vertical angle, degrees.
    fov: f64,
}

#[derive(Debug, Deserialize)]
#[serde(tag = "type", rename_all = "lowercase")]
enum Stuff {
    Matte { reflectance: DVec },
    Conductor { eta: DVec, k: DVec, roughness: f64 },
    Dielectric { ior: f64, roughness: f64 },
    Thin { ior: f64 },
    Plastic { ior: f64, reflectance: DVec },
    Lamp { radiance: DVec },
}

#[derive(Debug, Deserialize)]
struct Object {
    material: String,
    #[serde(default)]
    quads: Vec<[DVec; 4]>,
    sphere: Option<Ball>,
    #[serde(rename = "box")]
    brick: Option<Brick>,
}

#[derive(Debug, Deserialize)]
struct Ball {
    centre: DVec,
    radius: f64,
}

#[derive(Debug, Deserialize)]
struct Brick {
    centre: DVec,
    half: DVec,
    /// Degrees about the y axis.
    turn: f64,
}

impl Brick {
    /// Its sides, wound so that their normals point out.
    fn quads(&self) -> Vec<[DVec; 4]> {
        let (sin, cos) = self.turn.to_radians().sin_cos();
        let corner = |i: usize| {
            let [x, y, z] = [0, 1, 2].map(|axis| self.half[axis] * if i >> axis & 1 == 1 { 1.0 } else { -1.0 });
            [self.centre[0] + cos * x + sin * z, self.centre[1] + y, self.centre[2] - sin * x + cos * z]
        };
        let sides = [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
        sides.map(|side| side.map(corner)).to_vec()
    }
}

impl Stuff {
    fn material(&self, name: &str) -> Material {
        // Mitsuba's facets do not throw light at each other.
        let plain = Material { diffuse: DVec3::ZERO, multiple_scattering: false, ..Material::default() };
        let plain = Material { name: name.to_owned(), ..plain };
        let scattering = |scattering| Material { scattering, ..plain.clone() };
        match *self {
            Self::Matte { reflectance } => Material { diffuse: reflectance.into(), ..plain },
            Self::Conductor { eta, k, roughness } => {
                scattering(Scattering::Conductor { eta: eta.into(), k: k.into(), roughness })
            }
            Self::Dielectric { ior, roughness } => {
                scattering(Scattering::Dielectric { ior, roughness, tint: DVec3::ONE })
            }
            Self::Thin { ior } => scattering(Scattering::ThinGlass { ior, tint: DVec3::ONE }),
            Self::Plastic { ior, reflectance } => {
                let plastic = scattering(Scattering::Plastic { ior, roughness: 0.0 });
                Material { diffuse: reflectance.into(), ..plastic }
            }
            Self::Lamp { radiance } => Material { emission: radiance.into(), one_sided: true, ..plain },
        }
    }
}

impl Neutral {
    /// The scene in `file`.
    pub fn read(file: &Path) -> Self {
        let text = std::fs::read_to_string(file).unwrap_or_else(|e| panic!("{}: {e}", file.display()));
        serde_json::from_str(&text).unwrap_or_else(|e| panic!("{}: {e}", file.display()))
    }

    /// Its camera for square pictures.
    pub fn camera(&self) -> Camera {
        let Eye { eye, look_at, up, fov } = &self.camera;
        let projection = Projection::Perspective { theta: fov.to_radians() };
        let (eye, look_at, up) = ((*eye).into(), (*look_at).into(), (*up).into());
        Camera::new(&CameraDescription { name: "main".into(), eye, look_at, up, projection }, 1.0).unwrap()
    }

    /// The scene as the library knows it.
    pub fn description(&self) -> Description {
        let mut d = Description::new("neutral");
        d.ambient = DVec3::ZERO;
        let first = d.materials.len();
        d.materials.extend(self.materials.iter().map(|(name, stuff)| stuff.material(name)));
        for object in &self.objects {
            let at = self.materials.keys().position(|name| *name == object.material).expect("a material of the scene");
            let material = Some((first + at) as u32);
            if let Some(ball) = &object.sphere {
                let map = DMat3::from_diagonal(DVec3::splat(ball.radius));
                let transform = DAffine3::from_mat3_translation(map, ball.centre.into());
                d.groups[0].items.push(Item { transform, material, kind: ItemKind::Shape(Shape::Sphere) });
            }
            let sides = object.brick.as_ref().map(Brick::quads).unwrap_or_default();
            let quads: Vec<&[DVec; 4]> = object.quads.iter().chain(&sides).collect();
            if !quads.is_empty() {
                let mut mesh = Mesh::default();
                for (i, quad) in (0u32..).zip(&quads) {
                    mesh.positions.extend(quad.iter().map(|&p| DVec3::from(p)));
                    mesh.triangles.extend([[4 * i, 4 * i + 1, 4 * i + 2], [4 * i, 4 * i + 2, 4 * i + 3]]);
                }
                d.meshes.push(Arc::new(mesh));
                let kind = ItemKind::Mesh(d.meshes.len() as u32 - 1);
                d.groups[0].items.push(Item { transform: DAffine3::IDENTITY, material, kind });
            }
        }
        if self.environment != [0.0; 3] {
            let texels = Texels::Float(vec![[1.0; 4]; 8 * 4]);
            let texture = Arc::new(Texture { name: "sky".into(), width: 8, height: 4, texels });
            let scale = self.environment.into();
            d.environment = Some(Environment { texture, scale, to_world: DMat3::IDENTITY });
        }
        d
    }
}
