//! Moving a camera by hand: around what it looks at, sideways, nearer, through the scene.

use glam::{DQuat, DVec3};

use crate::scene::description::{CameraDescription, Projection};

/// Least angle between the view and the up vector, radians.
const LEAST_TILT: f64 = 0.01;
/// Limits of the field of view, radians.
const FIELD: (f64, f64) = (0.01, 3.0);

/// Turns `camera` about the point it looks at: `right` about the up vector (the scene seems to turn to the right), `up` about
/// the camera's horizontal axis, radians. The view never gets past the up vector.
pub fn orbit(camera: &mut CameraDescription, right: f64, up: f64) {
    let axis = camera.up.normalize_or(DVec3::Y);
    let arm = DQuat::from_axis_angle(axis, -right) * (camera.eye - camera.look_at);
    let side = axis.cross(arm).normalize_or(axis.any_orthonormal_vector());
    let tilt = axis.angle_between(arm);
    let wanted = (tilt - up).clamp(LEAST_TILT, std::f64::consts::PI - LEAST_TILT);
    camera.eye = camera.look_at + DQuat::from_axis_angle(side, wanted - tilt) * arm;
}

/// Moves eye and point looked at in the picture's plane: the scene follows a pointer that moves by `right`, `up` picture
/// heights.
pub fn pan(camera: &mut CameraDescription, right: f64, up: f64) {
    let (u, v, _) = axes(camera);
    let height = match camera.projection {
        Projection::Perspective { theta } => 2.0 * (theta * 0.5).tan() * distance(camera),
        Projection::Parallel { height } => height,
    };
    shift(camera, (u * -right + v * -up) * height);
}

/// Shows the point looked at `factor` times as large: a nearer eye, or a smaller parallel view.
pub fn zoom(camera: &mut CameraDescription, factor: f64) {
    if !(factor > 0.0 && factor.is_finite()) {
        return;
    }
    if let Projection::Parallel { height } = &mut camera.projection {
        *height = (*height / factor).clamp(f64::MIN_POSITIVE, f64::MAX);
        return;
    }
    let eye = camera.look_at + (camera.eye - camera.look_at) / factor;
    if eye != camera.look_at && eye.is_finite() {
        camera.eye = eye;
    }
}

/// Moves eye and point looked at by multiples of their distance: to the right, up, forward.
pub fn fly(camera: &mut CameraDescription, right: f64, up: f64, forward: f64) {
    let (u, v, n) = axes(camera);
    shift(camera, (u * right + v * up - n * forward) * distance(camera));
}

/// Turns the eye's own head: `right` about the up vector, `up` about the horizontal axis, radians.
pub fn turn(camera: &mut CameraDescription, right: f64, up: f64) {
    let eye = camera.eye;
    // The point looked at goes around the eye.
    let mut mirrored = CameraDescription { eye: camera.look_at, look_at: eye, ..camera.clone() };
    orbit(&mut mirrored, right, up);
    camera.look_at = mirrored.eye;
}

/// Makes the field of view (the height of a parallel view) `factor` times as large.
pub fn widen(camera: &mut CameraDescription, factor: f64) {
    match &mut camera.projection {
        Projection::Perspective { theta } => *theta = (*theta * factor).clamp(FIELD.0, FIELD.1),
        Projection::Parallel { .. } => zoom(camera, 1.0 / factor),
    }
}

fn distance(camera: &CameraDescription) -> f64 {
    camera.eye.distance(camera.look_at)
}

/// Right, up, backwards; unit.
fn axes(camera: &CameraDescription) -> (DVec3, DVec3, DVec3) {
    let n = (camera.eye - camera.look_at).normalize_or(DVec3::Z);
    let u = camera.up.cross(n).normalize_or(n.any_orthonormal_vector());
    (u, n.cross(u), n)
}

fn shift(camera: &mut CameraDescription, by: DVec3) {
    let (eye, look_at) = (camera.eye + by, camera.look_at + by);
    if eye.is_finite() && look_at.is_finite() && eye != look_at {
        (camera.eye, camera.look_at) = (eye, look_at);
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::{FRAC_PI_2, PI};

    use super::*;

    fn camera() -> CameraDescription {
        let projection = Projection::Perspective { theta: FRAC_PI_2 };
        CameraDescription { name: "c".into(), eye: DVec3::Z * 2.0, look_at: DVec3::ZERO, up: DVec3::Y, projection }
    }

    fn near(a: DVec3, b: DVec3) {
        assert!(a.distance(b) < 1e-12, "{a} is not {b}");
    }

    #[test]
    fn an_orbit_keeps_the_distance_and_stops_at_the_pole() {
        let mut c = camera();
        orbit(&mut c, -FRAC_PI_2, 0.0);
        near(c.eye, DVec3::X * 2.0);
        orbit(&mut c, 0.0, PI / 6.0);
        near(c.eye, DVec3::new(2.0 * (PI / 6.0).cos(), 1.0, 0.0));
        orbit(&mut c, 0.0, 10.0);
        assert!(c.eye.y > 1.99 && c.eye.x > 0.0, "{}", c.eye);
        orbit(&mut c, 0.0, -10.0);
        assert!(c.eye.y < -1.99 && c.eye.x > 0.0 && (c.eye.length() - 2.0).abs() < 1e-12, "{}", c.eye);
    }

    #[test]
    fn a_pan_follows_the_pointer() {
        // At distance 2 under 90 degrees the picture is 4 high.
        let mut c = camera();
        pan(&mut c, 0.25, -0.5);
        near(c.look_at, DVec3::new(-1.0, 2.0, 0.0));
        near(c.eye, DVec3::new(-1.0, 2.0, 2.0));
    }

    #[test]
    fn zoom_fly_turn_and_widen() {
        let mut c = camera();
        zoom(&mut c, 2.0);
        near(c.eye, DVec3::Z);
        fly(&mut c, 0.0, 1.0, 3.0);
        near(c.eye, DVec3::new(0.0, 1.0, -2.0));
        near(c.look_at, DVec3::new(0.0, 1.0, -3.0));
        turn(&mut c, FRAC_PI_2, 0.0);
        near(c.look_at, DVec3::new(1.0, 1.0, -2.0));
        turn(&mut c, 0.0, PI / 4.0);
        near(c.look_at, DVec3::new(0.5f64.sqrt(), 1.0 + 0.5f64.sqrt(), -2.0));
        widen(&mut c, 0.5);
        assert_eq!(c.projection, Projection::Perspective { theta: FRAC_PI_2 / 2.0 });
        widen(&mut c, 1e9);
        assert_eq!(c.projection, Projection::Perspective { theta: FIELD.1 });
        c.projection = Projection::Parallel { height: 3.0 };
        zoom(&mut c, 3.0);
        widen(&mut c, 2.0);
        assert_eq!(c.projection, Projection::Parallel { height: 2.0 });
        for factor in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            let before = c.clone();
            zoom(&mut c, factor);
            assert_eq!((c.eye, c.projection), (before.eye, before.projection));
        }
    }
}
