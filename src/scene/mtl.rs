//! Wavefront MTL: the material libraries of OBJ files.
//!
//! Source: Alias|Wavefront, "MTL material format", 1995, and the PBR extension (Pr, Pm, norm) that exporters write
//! (Clara.io, 2014). Read are `newmtl`, `Kd`, `Ks`, `Ke`, `Tf`, `Ns`, `Ni`, `d`, `Tr`, `illum`, `Pr`, `Pm`, and the
//! maps `map_Kd`, `map_Ke`, `map_d`, `map_Pr`, `map_Pm`, `map_Bump` (or `bump`) and `norm` (or `map_norm`) with their options -s, -o,
//! -clamp and -bm; keywords in any case. What the model cannot use is passed over and counted: ambient colours, spectral files, other
//! maps.
//!
//! What a material becomes ([`Entry::material`]): with Pr or Pm or a map of them the metallic-roughness model; with illum 6 or 7 and
//! no map_d solid glass of index Ni; with illum 3, 5 or 8 matte with a mirror of Ks; with a Ks above 0, unless illum is 0 or 1, a coat
//! on a diffuse base; else matte. Ns becomes the roughness with the same width of highlight: alpha^2 = 2 / (Ns + 2)
//! (B. Walter et al., "Microfacet Models for Refraction through Rough Surfaces", EGSR 2007, section 5.1).

use std::path::Path;

use glam::DVec3;

use super::material::{Alpha, Material, Scattering};
use super::text::{Word, Words};
use crate::error::Result;

/// Index of refraction where a file has none above 1.
const IOR: f64 = 1.5;
/// Largest library, bytes; in memory it takes less than 128 times as much.
pub const MAX_BYTES: u64 = 8 << 20;
/// Longest name of a map, bytes; paths have fewer.
const MAX_PATH: usize = 4096;

/// What a library holds.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Library {
    /// Materials in their order.
    pub entries: Vec<Entry>,
    /// Statements and options that are not read.
    pub ignored: u64,
}

/// One material as written.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Entry {
    /// Name, cut to 255 bytes.
    pub name: String,
    diffuse: Option<DVec3>,
    specular: DVec3,
    emission: DVec3,
    filter: Option<DVec3>,
    exponent: Option<f64>,
    ior: Option<f64>,
    opacity: Option<f64>,
    transparency: Option<f64>,
    illumination: Option<i64>,
    roughness: Option<f64>,
    metallic: Option<f64>,
    /// Base colour.
    pub base_map: Option<Box<Map>>,
    /// Emitted radiance.
    pub emission_map: Option<Box<Map>>,
    /// Opacity.
    pub opacity_map: Option<Box<Map>>,
    /// Roughness.
    pub roughness_map: Option<Box<Map>>,
    /// Share of metal.
    pub metallic_map: Option<Box<Map>>,
    /// Heights, or normals as many files have there.
    pub bump_map: Option<Box<Map>>,
    /// Normals.
    pub normal_map: Option<Box<Map>>,
}

/// A map as written.
#[derive(Clone, Debug, PartialEq)]
pub struct Map {
    /// The file's name as written.
    pub file: String,
    /// -s: factors of u and v.
    pub scale: [f64; 2],
    /// -o: added to u and v after that.
    pub offset: [f64; 2],
    /// -clamp on: the outermost texels beyond the edges.
    pub clamp: bool,
    /// -bm: factor of heights, and of the x and y of normals.
    pub multiplier: f64,
}

impl Entry {
    /// The emission as written, without its map.
    pub fn emission(&self) -> DVec3 {
        self.emission.max(DVec3::ZERO)
    }

    /// The material, without textures.
    pub fn material(&self) -> Material {
        let mut diffuse = self.diffuse.unwrap_or(DVec3::splat(0.8)).clamp(DVec3::ZERO, DVec3::ONE);
        if self.base_map.is_some() && diffuse == DVec3::ZERO {
            // Exporters leave the factor of a map at zero; nobody means a black picture.
            diffuse = DVec3::ONE;
        }
        let specular = self.specular.clamp(DVec3::ZERO, DVec3::ONE);
        let ior = self.ior.filter(|&ior| ior > 1.0).unwrap_or(IOR);
        let from_exponent = |absent: f64| self.exponent.map_or(absent, |n| (2.0 / (n.max(0.0) + 2.0)).powf(0.25));
        let mut material = Material { name: self.name.clone(), diffuse, ..Material::default() };
        material.emission = self.emission();
        if self.emission_map.is_some() && material.emission == DVec3::ZERO {
            // The same: a picture of light alone is meant to shine.
            material.emission = DVec3::ONE;
        }
        let is_glass = matches!(self.illumination, Some(6 | 7)) && self.opacity_map.is_none();
        let (is_rough_map, is_metal_map) = (self.roughness_map.is_some(), self.metallic_map.is_some());
        if self.roughness.is_some() || self.metallic.is_some() || is_rough_map || is_metal_map {
            // As above: a map alone, or with a factor of zero, is meant as it is.
            let mapped = |factor: Option<f64>| factor.filter(|&x| x > 0.0).unwrap_or(1.0);
            let plain = || self.roughness.unwrap_or_else(|| from_exponent(0.5));
            let roughness = if is_rough_map { mapped(self.roughness) } else { plain() }.clamp(0.0, 1.0);
            let metallic = if is_metal_map { mapped(self.metallic) } else { self.metallic.unwrap_or(0.0) };
            let metallic = metallic.clamp(0.0, 1.0);
            let transmission = f64::from(u8::from(is_glass));
            material.scattering = Scattering::MetallicRoughness { metallic, roughness, ior, transmission };
        } else if is_glass {
            let tint = self.filter.unwrap_or(DVec3::ONE).clamp(DVec3::ZERO, DVec3::ONE);
            material.scattering =
                Scattering::Dielectric { ior: self.ior.unwrap_or(IOR).max(1.0), roughness: 0.0, tint };
        } else if matches!(self.illumination, Some(3 | 5 | 8)) {
            material.mirror = specular;
            material.diffuse = diffuse.min(DVec3::ONE - specular);
        } else if specular != DVec3::ZERO && !matches!(self.illumination, Some(0 | 1)) {
            material.scattering = Scattering::Plastic { ior, roughness: from_exponent(0.5) };
        }
        if !is_glass {
            // Where both are given they often contradict each other; `d` is the one that the format defines.
            material.opacity = self.opacity.or(self.transparency.map(|t| 1.0 - t)).unwrap_or(1.0).clamp(0.0, 1.0);
            if material.opacity < 1.0 || self.opacity_map.is_some() {
                material.alpha = Alpha::Blend;
            }
        }
        material
    }
}

/// Reads the bytes of a library; `file` is only for error messages.
///
/// # Errors
/// At line and column: a word that is not a finite number where one must be, a missing number or name, a
/// property before the first `newmtl`.
pub fn parse(file: &Path, bytes: &[u8]) -> Result<Library> {
    let mut reader = Reader { words: Words::new(file, bytes, 0), out: Library::default() };
    while let Some(keyword) = reader.words.next() {
        reader.statement(keyword)?;
    }
    Ok(reader.out)
}

struct Reader<'a> {
    words: Words<'a>,
    out: Library,
}

impl<'a> Reader<'a> {
    /// Reads one statement up to the end of its line.
    fn statement(&mut self, keyword: Word<'_>) -> Result<()> {
        if keyword.bytes[0] == b'#' {
            self.words.rest_of_line();
            return Ok(());
        }
        let name = keyword.bytes.to_ascii_lowercase();
        if name == b"newmtl" {
            let name = self.words.rest_as_name();
            if name.is_empty() {
                return Err(self.words.missing("expected the material's name"));
            }
            self.out.entries.push(Entry { name, ..Entry::default() });
            return Ok(());
        }
        match name.as_slice() {
            b"kd" => self.colour(keyword, |e, c| e.diffuse = Some(c)),
            b"ks" => self.colour(keyword, |e, c| e.specular = c),
            b"ke" => self.colour(keyword, |e, c| e.emission = c),
            b"tf" => self.colour(keyword, |e, c| e.filter = Some(c)),
            b"ns" => self.number(keyword, |e, x| e.exponent = Some(x)),
            b"ni" => self.number(keyword, |e, x| e.ior = Some(x)),
            b"d" => self.number(keyword, |e, x| e.opacity = Some(x)),
            b"tr" => self.number(keyword, |e, x| e.transparency = Some(x)),
            b"illum" => self.number(keyword, |e, x| e.illumination = Some(x as i64)),
            b"pr" => self.number(keyword, |e, x| e.roughness = Some(x)),
            b"pm" => self.number(keyword, |e, x| e.metallic = Some(x)),
            b"map_kd" => self.map(keyword, |e, m| e.base_map = Some(Box::new(m))),
            b"map_ke" => self.map(keyword, |e, m| e.emission_map = Some(Box::new(m))),
            b"map_d" => self.map(keyword, |e, m| e.opacity_map = Some(Box::new(m))),
            b"map_pr" => self.map(keyword, |e, m| e.roughness_map = Some(Box::new(m))),
            b"map_pm" => self.map(keyword, |e, m| e.metallic_map = Some(Box::new(m))),
            b"map_bump" | b"bump" => self.map(keyword, |e, m| e.bump_map = Some(Box::new(m))),
            b"norm" | b"map_norm" => self.map(keyword, |e, m| e.normal_map = Some(Box::new(m))),
            _ => {
                self.out.ignored += 1;
                self.words.rest_of_line();
                Ok(())
            }
        }
    }

    /// The material that the statement `keyword` belongs to.
    fn entry(&mut self, keyword: Word<'_>) -> Result<&mut Entry> {
        let help = "a material library is a list of materials, each begun by `newmtl`";
        let what = format!("expected `newmtl` and a name before {}", keyword.shown());
        let error = self.words.error(keyword.at, what).with_help(help);
        self.out.entries.last_mut().ok_or(error)
    }

    /// A finite number of this line.
    fn finite(&self, word: Word<'_>) -> Result<f64> {
        let number = self.words.number(word)?;
        match number.is_finite() {
            true => Ok(number),
            false => Err(self.words.error(word.at, format!("expected a finite number, found {}", word.shown()))),
        }
    }

    fn number(&mut self, keyword: Word<'_>, set: impl FnOnce(&mut Entry, f64)) -> Result<()> {
        let mut word = self.words.next_value();
        // `d -halo 0.5` fades towards the edges of a body; only the number is read.
        while word.is_some_and(|w| w.bytes == b"-halo") {
            self.out.ignored += 1;
            word = self.words.next_value();
        }
        let Some(word) = word else { return Err(self.words.missing("expected a number")) };
        let number = self.finite(word)?;
        self.words.rest_of_line();
        set(self.entry(keyword)?, number);
        Ok(())
    }

    /// One number (grey) or three.
    fn colour(&mut self, keyword: Word<'_>, set: impl FnOnce(&mut Entry, DVec3)) -> Result<()> {
        let mut numbers = [0.0; 3];
        let mut count = 0;
        while let Some(word) = self.words.next_value() {
            if count == 0 && matches!(word.bytes, b"spectral" | b"xyz") {
                self.out.ignored += 1;
                self.words.rest_of_line();
                return Ok(());
            }
            if count == 3 {
                return Err(self.words.error(word.at, "expected the end of the line: a colour has three numbers"));
            }
            numbers[count] = self.finite(word)?;
            count += 1;
        }
        let colour = match count {
            1 => DVec3::splat(numbers[0]),
            3 => DVec3::from_array(numbers),
            _ => return Err(self.words.missing(format!("expected one number or three, found {count}"))),
        };
        set(self.entry(keyword)?, colour);
        Ok(())
    }

    /// Options, then the file's name up to the end of the line.
    fn map(&mut self, keyword: Word<'_>, set: impl FnOnce(&mut Entry, Map)) -> Result<()> {
        let mut map = Map { file: String::new(), scale: [1.0; 2], offset: [0.0; 2], clamp: false, multiplier: 1.0 };
        let mut pending = self.words.next_in_line();
        while let Some(option) = pending.filter(|w| w.bytes[0] == b'-') {
            match option.bytes {
                b"-s" => (map.scale, pending) = self.vector(1.0)?,
                b"-o" => (map.offset, pending) = self.vector(0.0)?,
                b"-t" => (_, pending) = self.vector(0.0)?,
                b"-bm" | b"-boost" | b"-texres" => {
                    let Some(word) = self.words.next_in_line() else {
                        return Err(self.words.missing(format!("expected a number after {}", option.shown())));
                    };
                    let number = self.finite(word)?;
                    map.multiplier = if option.bytes == b"-bm" { number } else { map.multiplier };
                    pending = self.words.next_in_line();
                }
                b"-mm" => {
                    (_, pending) = self.vector(0.0)?;
                    self.out.ignored += 1;
                }
                b"-clamp" | b"-blendu" | b"-blendv" | b"-cc" | b"-imfchan" | b"-type" => {
                    let value = self.words.next_in_line();
                    if option.bytes == b"-clamp" {
                        map.clamp = value.is_some_and(|w| w.bytes == b"on");
                    } else {
                        self.out.ignored += 1;
                    }
                    pending = self.words.next_in_line();
                }
                _ => break,
            }
        }
        // Exporters leave the line where a map was removed.
        let Some(first) = pending else {
            self.out.ignored += 1;
            return Ok(());
        };
        let rest = self.words.rest_of_line();
        let gap = if rest.is_empty() { "" } else { " " };
        let name = [first.bytes, gap.as_bytes(), rest].concat();
        if name.len() > MAX_PATH {
            return Err(self.words.error(first.at, format!("the file's name is longer than {MAX_PATH} bytes")));
        }
        map.file = String::from_utf8_lossy(&name).into_owned();
        set(self.entry(keyword)?, map);
        Ok(())
    }

    /// One to three numbers, the first two of them (`absent` for the second if there is one), and the word after them.
    fn vector(&mut self, absent: f64) -> Result<([f64; 2], Option<Word<'a>>)> {
        let Some(first) = self.words.next_in_line() else { return Err(self.words.missing("expected a number")) };
        let mut vector = [self.finite(first)?, absent];
        for i in 1..4 {
            let word = self.words.next_in_line();
            match word.and_then(|w| w.float::<f64>()).filter(|x| i < 3 && x.is_finite()) {
                Some(number) if i == 1 => vector[1] = number,
                Some(_) => {}
                None => return Ok((vector, word)),
            }
        }
        Ok((vector, None))
    }
}

#[cfg(test)]
mod tests;
