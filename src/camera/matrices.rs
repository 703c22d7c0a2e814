//! The camera as 4 x 4 matrices, as image files store them.

use glam::{DMat4, DVec3, DVec4};

use super::model::Camera;

impl Camera {
    /// World space to camera space as OpenEXR's `worldToCamera` defines it: origin at the eye, x right, y up,
    /// z along the viewing direction (a left-handed space).
    ///
    /// Column vectors (`m * p`). OpenEXR stores matrices for row vectors (`p * m`), row by row: that is exactly
    /// [`DMat4::to_cols_array`] of this matrix.
    pub fn world_to_camera(&self) -> DMat4 {
        let row = |axis: DVec3| axis.extend(-axis.dot(self.eye));
        DMat4::from_cols(row(self.u), row(self.v), row(-self.n), DVec4::W).transpose()
    }

    /// World space to normalised device coordinates as OpenEXR's `worldToNDC` defines them: after division by w,
    /// (0, 0) is the upper left and (1, 1) the lower right corner of the display window. z is the reciprocal depth
    /// (perspective) or the depth (parallel), which keeps the matrix invertible. Layout as in
    /// [`Camera::world_to_camera`].
    pub fn world_to_ndc(&self) -> DMat4 {
        let (x, y) = (0.5 / self.half_width, -0.5 / self.half_height);
        let camera_to_ndc = if self.parallel {
            DMat4::from_cols(
                DVec4::new(x, 0.0, 0.0, 0.0),
                DVec4::new(0.0, y, 0.0, 0.0),
                DVec4::Z,
                DVec4::new(0.5, 0.5, 0.0, 1.0),
            )
        } else {
            DMat4::from_cols(
                DVec4::new(x, 0.0, 0.0, 0.0),
                DVec4::new(0.0, y, 0.0, 0.0),
                DVec4::new(0.5, 0.5, 0.0, 1.0),
                DVec4::Z,
            )
        };
        camera_to_ndc * self.world_to_camera()
    }
}
