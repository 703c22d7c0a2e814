//! What a person can ask of a view: by key, by pointer, or by a line of a script.

use super::heat::Heat;
use super::pilot;
use super::stage::{Look, Stage};
use crate::camera::framing;
use crate::error::{Error, Result, nearest_name};
use crate::render::RenderOptions;
use crate::scene::description::{CameraDescription, Projection};
use crate::shade::{Integrator, unknown_shaders};
use crate::trace::EXACT_ENGINE;

/// A change of what is looked at, or how.
#[derive(Clone, Debug, PartialEq)]
pub enum Action {
    /// Turn about the point looked at: to the right, up; degrees.
    Orbit(f64, f64),
    /// Turn the head: to the right, up; degrees.
    Turn(f64, f64),
    /// Move in the picture's plane: the scene goes right, up by picture heights.
    Pan(f64, f64),
    /// Show what is looked at so many times as large.
    Zoom(f64),
    /// Move right, up, forward by multiples of the distance to what is looked at.
    Fly(f64, f64, f64),
    /// Make the field of view so many times as large.
    Widen(f64),
    /// Vertical field of view, degrees.
    Fov(f64),
    /// A camera of the scene by name.
    Camera(String),
    /// The scene's next camera.
    NextCamera,
    /// Back to where the view began.
    Reset,
    /// What is shown.
    Integrator(String),
    /// The next integrator.
    NextIntegrator,
    /// The engine that traces.
    Engine(String),
    /// The next engine.
    NextEngine,
    /// A map of the engine's work, or none.
    Heat(Option<Heat>),
    /// The next map, then none.
    NextHeat,
    /// Brighter by stops.
    Exposure(f64),
    /// Samples per pixel.
    Samples(u32),
    /// Edge of the first blocks, pixels.
    Blocks(u32),
}

/// A view: what is looked at, and how bright it is shown.
#[derive(Clone, Debug)]
pub struct View {
    /// What is looked at.
    pub look: Look,
    /// Where the view began.
    pub home: CameraDescription,
    /// Colours are shown times 2^exposure.
    pub exposure: f32,
    /// Whether the integrator `rt` may show shaders that it does not know as plastic.
    pub lenient: bool,
}

impl View {
    /// Checks that `stage`, which is to take the place of another one, can be shown as that is shown.
    ///
    /// # Errors
    /// A usage error for a scene that the integrator cannot show.
    pub fn check(&self, stage: &dyn Stage) -> Result<()> {
        obstacle(stage, self.look.options.integrator, self.lenient).map_or(Ok(()), |what| Err(Error::Usage(what)))
    }

    /// Does what `action` asks.
    ///
    /// # Errors
    /// A usage error for a name that does not exist or a number out of range; nothing is changed then.
    pub fn apply(&mut self, action: &Action, stage: &dyn Stage) -> Result<()> {
        let (camera, options) = (&mut self.look.camera, &mut self.look.options);
        match action {
            Action::Orbit(right, up) => pilot::orbit(camera, right.to_radians(), up.to_radians()),
            Action::Turn(right, up) => pilot::turn(camera, right.to_radians(), up.to_radians()),
            Action::Pan(right, up) => pilot::pan(camera, *right, *up),
            Action::Zoom(factor) => pilot::zoom(camera, *factor),
            Action::Fly(right, up, forward) => pilot::fly(camera, *right, *up, *forward),
            Action::Widen(factor) => pilot::widen(camera, *factor),
            Action::Fov(degrees) if *degrees > 0.0 && *degrees < 180.0 => {
                camera.projection = Projection::Perspective { theta: degrees.to_radians() };
            }
            Action::Fov(degrees) => {
                return Err(Error::Usage(format!("a field of view of {degrees}: expected degrees between 0 and 180")));
            }
            Action::Camera(name) => *camera = named(stage, name)?,
            Action::NextCamera => {
                let cameras = &stage.description().cameras;
                let at = cameras.iter().position(|c| c.name == camera.name).map_or(0, |i| (i + 1) % cameras.len());
                match cameras.get(at) {
                    Some(next) => *camera = next.clone(),
                    None => {
                        let aspect = f64::from(options.width) / f64::from(options.height);
                        *camera = framing(stage.bounds(), aspect);
                    }
                }
            }
            Action::Reset => *camera = self.home.clone(),
            Action::Integrator(name) => show(options, known_integrator(stage, name, self.lenient)?),
            Action::NextIntegrator => {
                let can_show = |&i: &Integrator| obstacle(stage, i, self.lenient).is_none();
                let all: Vec<Integrator> = Integrator::ALL.into_iter().filter(can_show).collect();
                show(options, after(&all, options.integrator));
            }
            Action::Engine(name) => options.engine = known_engine(stage, name)?,
            Action::NextEngine => {
                let engines = stage.engines();
                let at = engines.iter().position(|e| *e == options.engine).map_or(0, |i| i + 1);
                options.engine = engines.get(at).copied().unwrap_or(EXACT_ENGINE).into();
            }
            Action::Heat(heat) => self.look.heat = *heat,
            Action::NextHeat => {
                self.look.heat = match self.look.heat {
                    None => Some(Heat::ALL[0]),
                    Some(last) if last == Heat::ALL[Heat::ALL.len() - 1] => None,
                    Some(heat) => Some(after(&Heat::ALL, heat)),
                };
            }
            Action::Exposure(stops) => self.exposure = (self.exposure + *stops as f32).clamp(-30.0, 30.0),
            Action::Samples(spp) => {
                let changed = RenderOptions { spp: *spp, ..options.clone() };
                changed.check()?;
                *options = changed;
            }
            Action::Blocks(start) if start.is_power_of_two() && *start <= 16 => self.look.start = *start,
            Action::Blocks(start) => {
                return Err(Error::Usage(format!("blocks of {start} pixels: expected 16, 8, 4, 2 or 1")));
            }
        }
        Ok(())
    }
}

/// The element after `now`; the first after the last.
fn after<T: Copy + PartialEq>(all: &[T], now: T) -> T {
    let at = all.iter().position(|x| *x == now).map_or(0, |i| (i + 1) % all.len());
    all[at]
}

/// Makes `options` those of a picture by `integrator`, as deep as it goes by itself.
fn show(options: &mut RenderOptions, integrator: Integrator) {
    (options.integrator, options.depth) = (integrator, integrator.depth());
}

fn known_integrator(stage: &dyn Stage, name: &str, lenient: bool) -> Result<Integrator> {
    let integrator = name.parse()?;
    obstacle(stage, integrator, lenient).map_or(Ok(integrator), |what| Err(Error::Usage(what)))
}

/// Why `integrator` cannot show the scene, if so: what a view may not begin with, neither it nor the scene may be changed to.
fn obstacle(stage: &dyn Stage, integrator: Integrator, lenient: bool) -> Option<String> {
    if integrator != Integrator::Rt {
        return None;
    }
    let Some(looks) = &stage.description().looks else {
        return Some(format!("the integrator `{}` shows BRL-CAD databases only", integrator.name()));
    };
    let (shader, region) = unknown_shaders(looks).into_iter().next().filter(|_| !lenient)?;
    Some(format!("the shader `{shader}` of region {region} is not supported; --lenient shows it as plastic"))
}

fn known_engine(stage: &dyn Stage, name: &str) -> Result<String> {
    let names: Vec<&str> = stage.engines().into_iter().chain(["auto", EXACT_ENGINE]).collect();
    unknown("engine", name, &names).map_or_else(|| Ok(name.to_string()), Err)
}

fn named(stage: &dyn Stage, name: &str) -> Result<CameraDescription> {
    let cameras = &stage.description().cameras;
    let names: Vec<&str> = cameras.iter().map(|c| c.name.as_str()).collect();
    match unknown("camera", name, &names) {
        Some(error) => Err(error),
        None => Ok(cameras[names.iter().position(|n| *n == name).unwrap_or_default()].clone()),
    }
}

/// The error that `name` is none of `names`, if so.
fn unknown(what: &str, name: &str, names: &[&str]) -> Option<Error> {
    if names.contains(&name) {
        return None;
    }
    let near = nearest_name(name, names.iter().copied()).map_or(String::new(), |n| format!("; did you mean `{n}`?"));
    let list = if names.is_empty() { "none".into() } else { names.join(", ") };
    Some(Error::Usage(format!("no {what} `{name}`; there are: {list}{near}")))
}
