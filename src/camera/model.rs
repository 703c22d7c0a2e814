//! The camera of the classic textbook: eye, u, v, n, N, theta and aspect.
//!
//! Source: F. S. Hill, *Computer Graphics Using OpenGL*, ray tracing chapter ("the ray through pixel r, c"):
//!
//! ```text
//! ray(r, c) = -N n + W (2c / nCols - 1) u + H (2r / nRows - 1) v,     H = N tan(theta / 2),  W = H aspect
//! ```
//!
//! with the distance N = 1. In the formula rows count from the bottom. Our pictures have y down: sample (sx, sy)
//! in [0, 1)^2 of pixel (x, y) is at `c = x + sx`, `r = nRows - (y + sy)`, so the centre of a pixel (0.5, 0.5)
//! enters as `c = x + 0.5`, `r = nRows - y - 0.5`. Directions are not normalised: with N = 1 the ray parameter t
//! of a perspective camera is the distance along the viewing axis.

use glam::DVec3;

use crate::error::{Error, Result};
use crate::scene::brlcad::view::View;
use crate::scene::description::{CameraDescription, Projection};

/// A camera ready to make rays. All vectors are f64, world space; u, v, n are orthonormal, u points right, v up and
/// n backwards (from the scene to the eye), so u x v = n.
///
/// The ray through the point (x, y) of a picture of w x h pixels, x to the right and y down, (0, 0) its upper left corner and (0.5, 0.5)
/// the centre of the first pixel, crosses the view plane at
///
/// ```text
/// a = half_width (2 x / w - 1),     b = half_height (1 - 2 y / h)
///
/// perspective: origin eye,               direction a u + b v - n
/// parallel:    origin eye + a u + b v,   direction -n
/// ```
///
/// The view plane of a perspective camera lies at distance 1 before the eye, half_height = tan(theta / 2), and directions are not
/// unit: t is the distance along the viewing axis. That of a parallel camera goes through the eye, and t is the distance from it. Source:
/// F. S. Hill, *Computer Graphics Using OpenGL*, ray tracing chapter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera {
    /// Eye point; for a parallel camera the point behind the centre of the picture where rays start.
    pub eye: DVec3,
    /// Right.
    pub u: DVec3,
    /// Up.
    pub v: DVec3,
    /// Backwards.
    pub n: DVec3,
    /// Half the width of the picture: at distance N = 1 (perspective), or of the view volume (parallel).
    pub half_width: f64,
    /// Half the height of the picture, as above.
    pub half_height: f64,
    /// Whether all rays have direction -n (and their origins vary) or all start at the eye.
    pub parallel: bool,
    /// Where in its pixel a single ray goes: x to the right, y down, 0 to 1. The centre, or BRL-CAD's lower left corner.
    pub anchor: [f64; 2],
}

/// The centre of a pixel.
const CENTRE: [f64; 2] = [0.5, 0.5];
/// The corner of a pixel where BRL-CAD's `rt` samples.
const LOWER_LEFT: [f64; 2] = [0.0, 1.0];

impl Camera {
    /// The camera that `description` means, for pictures of `aspect` = width / height.
    ///
    /// An up vector along the viewing direction (or zero) is replaced by the coordinate axis farthest from it.
    ///
    /// # Errors
    /// A usage error if a number is not finite, eye and look-at coincide, the angle is not between 0 and 180
    /// degrees, or height or aspect are not positive.
    pub fn new(description: &CameraDescription, aspect: f64) -> Result<Self> {
        let name = &description.name;
        let fail = |what: &str| Err(Error::Usage(format!("camera `{name}`: {what}")));
        let CameraDescription { eye, look_at, up, .. } = *description;
        if !(eye.is_finite() && look_at.is_finite() && up.is_finite()) {
            return fail("eye, look-at and up must be finite numbers");
        }
        if !(aspect > 0.0 && aspect.is_finite()) {
            return fail("the aspect ratio must be a positive number");
        }
        // Halved first: the difference of two huge points would overflow.
        let Some(n) = unit(eye * 0.5 - look_at * 0.5) else {
            return fail("eye and look-at are the same point");
        };
        let u = right_of(up, n);
        let (half_height, parallel) = match description.projection {
            Projection::Perspective { theta } if theta > 0.0 && theta < std::f64::consts::PI => {
                ((theta * 0.5).tan(), false)
            }
            Projection::Perspective { .. } => return fail("the field of view must be between 0 and 180 degrees"),
            Projection::Parallel { height } if height > 0.0 && height.is_finite() => (height * 0.5, true),
            Projection::Parallel { .. } => return fail("the height of the view must be a positive number"),
        };
        Ok(Self { eye, u, v: n.cross(u), n, half_width: half_height * aspect, half_height, parallel, anchor: CENTRE })
    }

    /// The camera of BRL-CAD's `rt`: the view's size is the picture's width, rays start on the plane through the eye,
    /// and pixels are sampled at their lower left corners. Pixels are square, as `rt -V` with the picture's aspect.
    ///
    /// # Errors
    /// A usage error if the aspect ratio is not positive.
    pub fn of_view(view: &View, aspect: f64) -> Result<Self> {
        if !(aspect > 0.0 && aspect.is_finite()) {
            return Err(Error::Usage("the aspect ratio must be a positive number".into()));
        }
        let [u, v, n] = view.axes;
        let half_width = view.perspective.map_or(view.size * 0.5, |angle| (angle * 0.5).tan());
        let parallel = view.perspective.is_none();
        Ok(Self { eye: view.eye, u, v, n, half_width, half_height: half_width / aspect, parallel, anchor: LOWER_LEFT })
    }

    /// Origin and direction of the ray through the point (x, y) of a picture of `width` x `height` pixels; x to the
    /// right and y down, in pixels, (0, 0) is the picture's upper left corner. The direction is not unit.
    pub fn ray(&self, width: u32, height: u32, x: f64, y: f64) -> (DVec3, DVec3) {
        let c = x;
        let r = f64::from(height) - y;
        let a = self.half_width * (2.0 * c / f64::from(width) - 1.0);
        let b = self.half_height * (2.0 * r / f64::from(height) - 1.0);
        if self.parallel {
            (self.eye + (a * self.u + b * self.v), -self.n)
        } else {
            (self.eye, a * self.u + b * self.v - self.n)
        }
    }
}

/// What the command line changes of a camera; `None` keeps what the camera has.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct CameraOverrides {
    /// Eye point.
    pub eye: Option<DVec3>,
    /// Point looked at.
    pub look_at: Option<DVec3>,
    /// Up vector.
    pub up: Option<DVec3>,
    /// Vertical field of view, radians; makes a parallel camera a perspective one.
    pub theta: Option<f64>,
}

impl CameraOverrides {
    /// `camera` with the changes.
    pub fn apply(&self, camera: &CameraDescription) -> CameraDescription {
        CameraDescription {
            name: camera.name.clone(),
            eye: self.eye.unwrap_or(camera.eye),
            look_at: self.look_at.unwrap_or(camera.look_at),
            up: self.up.unwrap_or(camera.up),
            projection: self.theta.map_or(camera.projection, |theta| Projection::Perspective { theta }),
        }
    }
}

/// `d` with length 1, also where its square would overflow or vanish; `None` for zero and non-finite vectors.
pub(crate) fn unit(d: DVec3) -> Option<DVec3> {
    let scale = d.abs().max_element();
    (scale > 0.0 && d.is_finite()).then(|| (d / scale).normalize())
}

/// The unit vector to the right of someone who looks along -n with `up` above.
fn right_of(up: DVec3, n: DVec3) -> DVec3 {
    // Below this sine the direction of up x n is mostly rounding.
    const LEAST_SINE: f64 = 1e-9;
    let along = unit(up).map(|up| up.cross(n)).filter(|side| side.length() > LEAST_SINE);
    let side = along.unwrap_or_else(|| {
        let a = n.abs();
        let axis = if a.y <= a.x && a.y <= a.z {
            DVec3::Y
        } else if a.z <= a.x {
            DVec3::Z
        } else {
            DVec3::X
        };
        axis.cross(n)
    });
    side.normalize()
}
