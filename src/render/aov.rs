//! The planes of a picture by name, and what of a pixel each shows.

use super::pixels::Pixel;
use crate::error::{Error, Result, nearest_name};
use crate::shade::Integrator;

/// One plane of a film.
#[derive(Clone, Copy, Debug)]
pub struct Channel {
    /// Name as image files know it.
    pub name: &'static str,
    /// What it shows of a pixel.
    pub get: Get,
}

/// Kind and source of a plane's values.
#[derive(Clone, Copy, Debug)]
pub enum Get {
    /// Rounded to f32.
    F32(fn(&Pixel) -> f64),
    /// As it is.
    U32(fn(&Pixel) -> u32),
    /// Its level, see [`crate::film::pix::level`].
    U8(fn(&Pixel) -> f64),
}

/// The planes of nearly every picture: linear colour and coverage.
pub const COLOR: [Channel; 4] = [
    Channel { name: "R", get: Get::F32(|p| p.color.radiance.x) },
    Channel { name: "G", get: Get::F32(|p| p.color.radiance.y) },
    Channel { name: "B", get: Get::F32(|p| p.color.radiance.z) },
    Channel { name: "A", get: Get::F32(|p| p.color.alpha) },
];

/// Linear colour as the bytes of `.pix` pictures, instead of [`COLOR`].
pub const LEVELS: [Channel; 3] = [
    Channel { name: "R", get: Get::U8(|p| p.color.radiance.x) },
    Channel { name: "G", get: Get::U8(|p| p.color.radiance.y) },
    Channel { name: "B", get: Get::U8(|p| p.color.radiance.z) },
];

/// A group of planes besides R, G, B and A.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Aov {
    /// `Z`: distance from the ray's origin to the hit, scene units; infinite where nothing was hit.
    Z,
    /// `N.X N.Y N.Z`: unit geometric normal in world space, turned towards the viewer; 0 where nothing was hit.
    Normal,
    /// `albedo.R albedo.G albedo.B`: diffuse reflectance; 0 where nothing was hit.
    Albedo,
    /// `id.instance`: instance number, u32; `INVALID_ID` where nothing was hit.
    Instance,
    /// `id.primitive`: primitive number, u32; `INVALID_ID` where nothing was hit.
    Primitive,
    /// `P.X P.Y P.Z`: hit point in world space; 0 where nothing was hit.
    Position,
    /// `Ns.X Ns.Y Ns.Z`: unit shading normal, on the side of the geometric one; 0 where nothing was hit.
    ShadingNormal,
    /// `direct.R direct.G direct.B`: light seen itself or scattered once ([`Integrator::Path`] only).
    Direct,
    /// `indirect.R indirect.G indirect.B`: the rest of the radiance (the same).
    Indirect,
    /// `id.material`: material number, u32; `INVALID_ID` where nothing was hit.
    Material,
    /// `variance`: of the pixel's mean brightness, estimated from its samples; 0 for one sample.
    Variance,
    /// `samples`: number of samples, u32.
    Samples,
    /// `cost.nodes`: node visits per primary ray (see [`crate::shade::FirstHit::nodes`]); not with [`Integrator::Path`] and
    /// [`Integrator::Rt`].
    Cost,
    /// `cryptoObject00.R` and so on, `cryptoMaterial00.R` and so on: ids and coverages of what a pixel shows
    /// ([`crate::film::cryptomatte`]).
    Cryptomatte,
}

impl Aov {
    /// All of them, in the order of the film's planes; `all` on the command line means those before the last, whose
    /// many planes are only for programs that know them.
    pub const ALL: [Self; 14] = [
        Self::Z,
        Self::Normal,
        Self::Albedo,
        Self::Instance,
        Self::Primitive,
        Self::Cost,
        Self::Position,
        Self::ShadingNormal,
        Self::Direct,
        Self::Indirect,
        Self::Material,
        Self::Variance,
        Self::Samples,
        Self::Cryptomatte,
    ];

    /// Name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Z => "Z",
            Self::Normal => "N",
            Self::Albedo => "albedo",
            Self::Instance => "id.instance",
            Self::Primitive => "id.primitive",
            Self::Cost => "cost.nodes",
            Self::Position => "P",
            Self::ShadingNormal => "Ns",
            Self::Direct => "direct",
            Self::Indirect => "indirect",
            Self::Material => "id.material",
            Self::Variance => "variance",
            Self::Samples => "samples",
            Self::Cryptomatte => "cryptomatte",
        }
    }

    /// Its planes that show one number of a pixel; those of [`Self::Cryptomatte`] are made otherwise.
    pub fn channels(self) -> &'static [Channel] {
        match self {
            Self::Z => &[Channel { name: "Z", get: Get::F32(|p| p.hit.distance) }],
            Self::Normal => &[
                Channel { name: "N.X", get: Get::F32(|p| p.hit.normal.x) },
                Channel { name: "N.Y", get: Get::F32(|p| p.hit.normal.y) },
                Channel { name: "N.Z", get: Get::F32(|p| p.hit.normal.z) },
            ],
            Self::Albedo => &[
                Channel { name: "albedo.R", get: Get::F32(|p| p.hit.albedo.x) },
                Channel { name: "albedo.G", get: Get::F32(|p| p.hit.albedo.y) },
                Channel { name: "albedo.B", get: Get::F32(|p| p.hit.albedo.z) },
            ],
            Self::Instance => &[Channel { name: "id.instance", get: Get::U32(|p| p.hit.inst) }],
            Self::Primitive => &[Channel { name: "id.primitive", get: Get::U32(|p| p.hit.prim) }],
            Self::Cost => &[Channel { name: "cost.nodes", get: Get::F32(|p| p.hit.nodes) }],
            Self::Position => &[
                Channel { name: "P.X", get: Get::F32(|p| p.hit.position.x) },
                Channel { name: "P.Y", get: Get::F32(|p| p.hit.position.y) },
                Channel { name: "P.Z", get: Get::F32(|p| p.hit.position.z) },
            ],
            Self::ShadingNormal => &[
                Channel { name: "Ns.X", get: Get::F32(|p| p.hit.shading_normal.x) },
                Channel { name: "Ns.Y", get: Get::F32(|p| p.hit.shading_normal.y) },
                Channel { name: "Ns.Z", get: Get::F32(|p| p.hit.shading_normal.z) },
            ],
            Self::Direct => &[
                Channel { name: "direct.R", get: Get::F32(|p| p.hit.direct.x) },
                Channel { name: "direct.G", get: Get::F32(|p| p.hit.direct.y) },
                Channel { name: "direct.B", get: Get::F32(|p| p.hit.direct.z) },
            ],
            Self::Indirect => &[
                Channel { name: "indirect.R", get: Get::F32(|p| p.color.radiance.x - p.hit.direct.x) },
                Channel { name: "indirect.G", get: Get::F32(|p| p.color.radiance.y - p.hit.direct.y) },
                Channel { name: "indirect.B", get: Get::F32(|p| p.color.radiance.z - p.hit.direct.z) },
            ],
            Self::Material => &[Channel { name: "id.material", get: Get::U32(|p| p.hit.material) }],
            Self::Variance => &[Channel { name: "variance", get: Get::F32(|p| p.variance) }],
            Self::Samples => &[Channel { name: "samples", get: Get::U32(|p| p.samples) }],
            Self::Cryptomatte => &[],
        }
    }

    /// Whether pictures of `integrator` have it: of others its planes would be zeros, or hold what is something else.
    pub fn is_of(self, integrator: Integrator) -> bool {
        match self {
            Self::Direct | Self::Indirect => integrator == Integrator::Path,
            Self::Cost => !matches!(integrator, Integrator::Path | Integrator::Rt),
            _ => true,
        }
    }

    /// [`Self::parse_list`] for a picture of `integrator`: `all` are those that it has.
    ///
    /// # Errors
    /// As [`Self::parse_list`], and one that it has not by its name.
    pub fn parse_list_of(list: &str, integrator: Integrator) -> Result<Vec<Self>> {
        let (has, lacks): (Vec<_>, Vec<_>) = Self::parse_list(list)?.into_iter().partition(|aov| aov.is_of(integrator));
        let is_named = |aov: &&Self| list.split(',').any(|name| name.trim() == aov.name());
        if let Some(aov) = lacks.iter().find(is_named) {
            let having = Integrator::ALL.into_iter().filter(|other| aov.is_of(*other)).map(Integrator::name);
            let (name, having) = (integrator.name(), having.collect::<Vec<_>>().join(", "));
            return Err(Error::Usage(format!("--aov {}: {name} has no such plane, only {having}", aov.name())));
        }
        Ok(has)
    }

    /// Reads a comma-separated list; `all` is all but [`Self::Cryptomatte`]. The result is in the order of [`Aov::ALL`], each once.
    ///
    /// # Errors
    /// A usage error that lists the names and the nearest one.
    pub fn parse_list(list: &str) -> Result<Vec<Self>> {
        let mut wanted = Vec::new();
        for name in list.split(',').map(str::trim).filter(|name| !name.is_empty()) {
            match Self::ALL.into_iter().find(|aov| aov.name() == name) {
                Some(aov) => wanted.push(aov),
                None if name == "all" => wanted.extend(Self::ALL.into_iter().filter(|&aov| aov != Self::Cryptomatte)),
                None => {
                    let names = Self::ALL.map(Self::name);
                    let near = nearest_name(name, names);
                    let hint = near.map_or(String::new(), |near| format!("; did you mean `{near}`?"));
                    let names = names.join(", ");
                    return Err(Error::Usage(format!("unknown AOV `{name}`, expected all or some of {names}{hint}")));
                }
            }
        }
        Ok(Self::ALL.into_iter().filter(|aov| wanted.contains(aov)).collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lists_are_sorted_and_misspellings_explained() {
        assert_eq!(Aov::parse_list("N, Z,N").unwrap(), [Aov::Z, Aov::Normal]);
        assert_eq!(Aov::parse_list("all,cryptomatte").unwrap(), Aov::ALL);
        assert_eq!(Aov::parse_list("all").unwrap(), Aov::ALL[..13]);
        assert_eq!(Aov::parse_list("").unwrap(), []);
        let message = Aov::parse_list("albdo").unwrap_err().to_string();
        assert!(message.contains("did you mean `albedo`?"), "{message}");
    }

    #[test]
    fn no_picture_has_planes_that_its_integrator_has_not() {
        use Integrator::{Ao, Path, Rt, Whitted};
        let of = Aov::parse_list_of;
        assert_eq!(of("Z,direct,indirect", Path).unwrap(), [Aov::Z, Aov::Direct, Aov::Indirect]);
        assert_eq!(of("cost.nodes", Ao).unwrap(), [Aov::Cost]);
        for (integrator, lacks) in [
            (Path, &[Aov::Cost][..]),
            (Whitted, &[Aov::Direct, Aov::Indirect]),
            (Rt, &[Aov::Cost, Aov::Direct, Aov::Indirect]),
        ] {
            let rest: Vec<Aov> = Aov::ALL[..13].iter().copied().filter(|aov| !lacks.contains(aov)).collect();
            assert_eq!(of("all", integrator).unwrap(), rest, "{integrator:?}");
            for aov in lacks {
                let message = of(&format!("all, {}", aov.name()), integrator).unwrap_err().to_string();
                assert!(message.contains("no such plane"), "{message}");
            }
        }
        assert!(of("direct", Whitted).unwrap_err().to_string().ends_with("whitted has no such plane, only path"));
    }
}
