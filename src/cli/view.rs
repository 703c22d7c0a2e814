//! Which rays look at the scene: cameras by name or place, and BRL-CAD's views.

use std::path::PathBuf;

use glam::DVec3;

use crate::camera::{Camera, CameraOverrides, framing};
use crate::error::{Error, Result, nearest_name};
use crate::measure::eye::Eye;
use crate::scene::brlcad::describe::DEFAULT_VIEW;
use crate::scene::brlcad::view::{self, View};
use crate::scene::description::{CameraDescription, Description};

/// Largest width or height of a picture.
const MAX_SIDE: u32 = 1 << 16;

/// Which rays look at the scene.
#[derive(Clone, Debug, Default, clap::Args)]
pub struct CameraArgs {
    /// Picture size in pixels
    #[arg(long, value_name = "WxH", value_parser = size, help_heading = "Camera")]
    pub size: Option<(u32, u32)>,
    /// A camera of the scene file [default: its first; without one, a view that frames the scene]
    #[arg(long, value_name = "NAME", help_heading = "Camera")]
    pub camera: Option<String>,
    /// Eye point
    #[arg(long, value_name = "X,Y,Z", value_parser = point, allow_hyphen_values = true, help_heading = "Camera")]
    pub eye: Option<DVec3>,
    /// Point looked at
    #[arg(long, value_name = "X,Y,Z", value_parser = point, allow_hyphen_values = true, help_heading = "Camera")]
    pub look_at: Option<DVec3>,
    /// Up vector
    #[arg(long, value_name = "X,Y,Z", value_parser = direction, allow_hyphen_values = true, help_heading = "Camera")]
    pub up: Option<DVec3>,
    /// Vertical field of view
    #[arg(long, value_name = "DEGREES", value_parser = field_of_view, help_heading = "Camera")]
    pub fov: Option<f64>,
    /// A view script of BRL-CAD's rt, or one that MGED saved: pixels are sampled where rt samples them
    #[arg(long, value_name = "FILE.rt", conflicts_with_all = ["camera", "eye", "look_at", "up", "fov", "az", "el"],
        help_heading = "Camera")]
    pub view: Option<PathBuf>,
    /// Azimuth of a parallel view that frames the scene as BRL-CAD's rt does, z up [default with --el: 35]
    #[arg(long, value_name = "DEGREES", value_parser = angle, allow_hyphen_values = true,
        conflicts_with_all = ["camera", "eye", "look_at", "up", "fov"], help_heading = "Camera")]
    pub az: Option<f64>,
    /// Elevation of such a view [default with --az: 25]
    #[arg(long, value_name = "DEGREES", value_parser = angle, allow_hyphen_values = true,
        conflicts_with_all = ["camera", "eye", "look_at", "up", "fov"], help_heading = "Camera")]
    pub el: Option<f64>,
}

impl CameraArgs {
    /// The camera asked for: a view, the named one, else the scene's first, else one that frames `bounds` (lower and
    /// upper corner) in a picture of `size`; then `--eye`, `--look-at`, `--up` and `--fov` change it.
    ///
    /// # Errors
    /// A usage error for an unknown name and for an `--up` along the view; a view script that cannot be read.
    pub fn choose(
        &self,
        description: &Description,
        bounds: Option<(DVec3, DVec3)>,
        size: (u32, u32),
    ) -> Result<CameraDescription> {
        let aspect = f64::from(size.0) / f64::from(size.1);
        if let Some(view) = self.rt_view(description, bounds)? {
            return Ok(view.camera("view", aspect));
        }
        let camera = match (&self.camera, description.cameras.first()) {
            (Some(name), _) => named(description, name)?,
            (None, Some(first)) => first.clone(),
            (None, None) => framing(bounds, aspect),
        };
        let theta = self.fov.map(f64::to_radians);
        let camera = CameraOverrides { eye: self.eye, look_at: self.look_at, up: self.up, theta }.apply(&camera);
        // As in scene files: another direction would be taken, and nobody would know.
        if self.up.is_some() && CameraDescription::is_along_view(camera.eye, camera.look_at, camera.up) {
            return Err(Error::Usage("--up must not point along the view".into()));
        }
        Ok(camera)
    }

    /// As [`Self::choose`], ready to make rays. Views sample pixels where `rt` does.
    ///
    /// # Errors
    /// Those of [`Self::choose`] and [`Camera::new`].
    pub fn ready(&self, description: &Description, bounds: Option<(DVec3, DVec3)>, size: (u32, u32)) -> Result<Eye> {
        match self.rt_view(description, bounds)? {
            Some(view) => {
                let camera = Camera::of_view(&view, f64::from(size.0) / f64::from(size.1))?;
                Ok(Eye { camera, up: camera.v })
            }
            None => Eye::new(&self.choose(description, bounds, size)?, size),
        }
    }

    /// The same; if nothing says where to look from, `rt`'s default view.
    pub fn or_default_view(&self) -> Self {
        let is_silent = self.camera.is_none()
            && self.view.is_none()
            && self.fov.is_none()
            && [self.eye, self.look_at, self.up].iter().all(Option::is_none);
        let az = if is_silent { self.az.or(Some(DEFAULT_VIEW.0)) } else { self.az };
        Self { az, ..self.clone() }
    }

    /// The view script asked for.
    ///
    /// # Errors
    /// A file that cannot be read or is no view script.
    pub fn script(&self) -> Result<Option<View>> {
        let Some(path) = &self.view else { return Ok(None) };
        let bytes = std::fs::read(path).map_err(|e| Error::io(path, e))?;
        view::parse(path, &bytes).map(Some)
    }

    /// The view of BRL-CAD's `rt` that is asked for, if one is.
    ///
    /// # Errors
    /// Those of [`Self::script`].
    pub fn rt_view(&self, description: &Description, bounds: Option<(DVec3, DVec3)>) -> Result<Option<View>> {
        if self.az.is_none() && self.el.is_none() {
            return self.script();
        }
        let (az, el) = (self.az.unwrap_or(DEFAULT_VIEW.0), self.el.unwrap_or(DEFAULT_VIEW.1));
        let bounds = description.looks.as_ref().and_then(|looks| looks.bounds).or(bounds);
        let bounds = bounds.unwrap_or((DVec3::NEG_ONE, DVec3::ONE));
        Ok(Some(View::around(bounds, az.to_radians(), el.to_radians())))
    }
}

fn named(description: &Description, name: &str) -> Result<CameraDescription> {
    description.cameras.iter().find(|c| c.name == name).cloned().ok_or_else(|| {
        let names: Vec<&str> = description.cameras.iter().map(|c| c.name.as_str()).collect();
        let near = nearest_name(name, names.iter().copied()).map(|n| format!(" (did you mean `{n}`?)"));
        let list = if names.is_empty() { "none".into() } else { names.join(", ") };
        Error::Usage(format!("no camera `{name}`{}; the scene has: {list}", near.unwrap_or_default()))
    })
}

/// Parses `WxH`, 1 to 65536 pixels each way.
pub fn size(text: &str) -> std::result::Result<(u32, u32), String> {
    let side = |s: &str| s.parse().ok().filter(|side| (1..=MAX_SIDE).contains(side));
    let sides = text.split_once('x').and_then(|(w, h)| Some((side(w)?, side(h)?)));
    sides.ok_or_else(|| format!("expected WIDTHxHEIGHT, each 1 to {MAX_SIDE}, for example 1280x720"))
}

fn point(text: &str) -> std::result::Result<DVec3, String> {
    let numbers: Option<Vec<f64>> = text.split(',').map(|s| s.trim().parse().ok()).collect();
    match numbers.as_deref() {
        Some(&[x, y, z]) if [x, y, z].iter().all(|c: &f64| c.is_finite()) => Ok(DVec3::new(x, y, z)),
        _ => Err("expected three finite numbers X,Y,Z, for example 0,1.5,-4".into()),
    }
}

/// As scene files have it: without a direction the camera would take another, and nobody would know.
fn direction(text: &str) -> std::result::Result<DVec3, String> {
    let has_direction = |v: &DVec3| v.try_normalize().is_some();
    Some(point(text)?)
        .filter(has_direction)
        .ok_or_else(|| "it must have a direction: its length is zero or out of range".into())
}

fn field_of_view(text: &str) -> std::result::Result<f64, String> {
    let degrees = text.parse().ok().filter(|&d: &f64| d > 0.0 && d < 180.0);
    degrees.ok_or_else(|| "expected degrees between 0 and 180".into())
}

fn angle(text: &str) -> std::result::Result<f64, String> {
    text.parse().ok().filter(|d: &f64| d.is_finite()).ok_or_else(|| "expected degrees".into())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::description::Projection;

    #[test]
    fn arguments_parse_or_say_what_is_expected() {
        assert_eq!(size("1280x720"), Ok((1280, 720)));
        for wrong in ["1280", "0x5", "5x", "70000x1", "-1x1", "1x1x1"] {
            assert!(size(wrong).is_err(), "{wrong}");
        }
        assert_eq!(point("0, -1.5,2e3"), Ok(DVec3::new(0.0, -1.5, 2000.0)));
        for wrong in ["1,2", "1,2,3,4", "a,b,c", "1,2,inf", ""] {
            assert!(point(wrong).is_err(), "{wrong}");
        }
        assert_eq!(direction("0,0,-2"), Ok(DVec3::new(0.0, 0.0, -2.0)));
        for wrong in ["0,0,0", "1e-200,0,0", "0,1e200,0"] {
            assert!(direction(wrong).unwrap_err().contains("must have a direction"), "{wrong}");
        }
        assert!(direction("0,1").unwrap_err().contains("three finite numbers"));
        assert_eq!(field_of_view("45"), Ok(45.0));
        assert!(field_of_view("180").is_err() && field_of_view("nan").is_err());
    }

    fn camera(name: &str) -> CameraDescription {
        let projection = Projection::Parallel { height: 2.0 };
        CameraDescription { name: name.into(), eye: DVec3::X, look_at: DVec3::ZERO, up: DVec3::Y, projection }
    }

    #[test]
    fn cameras_are_found_by_name_and_changed_by_arguments() {
        let mut scene = Description::new("s");
        scene.cameras = vec![camera("front"), camera("side")];
        let size = (4, 3);
        let choose = |args: &CameraArgs| args.choose(&scene, None, size);
        assert_eq!(choose(&CameraArgs::default()).unwrap().name, "front");
        let mut args = CameraArgs { camera: Some("side".into()), ..Default::default() };
        args.eye = Some(DVec3::Z);
        args.fov = Some(90.0);
        let chosen = choose(&args).unwrap();
        assert_eq!((chosen.name.as_str(), chosen.eye, chosen.up), ("side", DVec3::Z, DVec3::Y));
        assert_eq!(chosen.projection, Projection::Perspective { theta: std::f64::consts::FRAC_PI_2 });
        args.camera = Some("sid".into());
        let text = choose(&args).unwrap_err().to_string();
        assert!(text.contains("did you mean `side`") && text.contains("front, side"), "{text}");
    }

    #[test]
    fn an_up_along_the_view_is_refused_only_where_it_was_given() {
        let mut scene = Description::new("s");
        scene.cameras = vec![camera("front")];
        let above = CameraArgs { eye: Some(DVec3::Y * 5.0), ..Default::default() };
        assert_eq!(above.choose(&scene, None, (4, 3)).unwrap().up, DVec3::Y);
        for up in [DVec3::Y, DVec3::NEG_Y, DVec3::new(1e-10, 3.0, 0.0)] {
            let text =
                CameraArgs { up: Some(up), ..above.clone() }.choose(&scene, None, (4, 3)).unwrap_err().to_string();
            assert!(text.contains("--up must not point along the view"), "{up}: {text}");
        }
        let tilted = CameraArgs { up: Some(DVec3::new(0.01, 1.0, 0.0)), ..above };
        assert!(tilted.choose(&scene, None, (4, 3)).is_ok());
    }

    #[test]
    fn a_scene_without_cameras_is_framed() {
        let bounds = Some((DVec3::splat(9.0), DVec3::splat(11.0)));
        let camera = CameraArgs::default().choose(&Description::new("s"), bounds, (4, 3)).unwrap();
        assert_eq!(camera.look_at, DVec3::splat(10.0));
    }

    #[test]
    fn angles_frame_the_scene_as_rt_does() {
        let bounds = Some((DVec3::splat(-2.0), DVec3::splat(2.0)));
        let args = CameraArgs { az: Some(35.0), ..Default::default() };
        let camera = args.ready(&Description::new("s"), bounds, (512, 512)).unwrap().camera;
        // What rt itself reports for a box of 4 x 4 x 4 about the origin.
        assert!((camera.eye - DVec3::new(3.63702136, 2.54666977, 2.07039819)).length() < 1e-8, "{}", camera.eye);
        assert!((2.0 * camera.half_width - 6.928203230275509).abs() < 1e-12);
        assert_eq!((camera.anchor, camera.parallel), ([0.0, 1.0], true));
        let described = args.choose(&Description::new("s"), bounds, (512, 512)).unwrap();
        let same = Camera::new(&described, 1.0).unwrap();
        assert!((same.v - camera.v).length() < 1e-12 && (same.half_height - camera.half_height).abs() < 1e-12);
    }
}
