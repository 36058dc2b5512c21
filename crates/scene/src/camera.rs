//! The pinhole camera.

use glam::{Affine3A, Mat3A, Vec2, Vec3, Vec3A};

/// A perspective pinhole camera. It looks along its own -z with y up, as in glTF.
#[derive(Clone, Debug)]
pub struct Camera {
    /// Name in the file, or a made-up one that [`crate::Report`] tells of.
    pub name: String,
    /// Camera to world; rotation and translation only.
    pub world_from_camera: Affine3A,
    /// Full vertical angle of view, radians, in (0, pi).
    pub fov_y: f32,
}

/// Turns film positions into rays for one image size: what is constant over a frame, computed once.
#[derive(Clone, Copy, Debug)]
pub struct CameraRays {
    /// World-space position of the pinhole.
    pub origin_ws: Vec3,
    corner_ws: Vec3,
    step_x_ws: Vec3,
    step_y_ws: Vec3,
}

impl Camera {
    /// A camera at `eye` looking at `target`.
    pub fn look_at(name: &str, eye: Vec3, target: Vec3, up: Vec3, fov_y: f32) -> Self {
        let back = (eye - target).normalize();
        let right = up.cross(back).normalize();
        let matrix = Mat3A::from_cols(right.into(), back.cross(right).into(), back.into());
        Self {
            name: name.into(),
            world_from_camera: Affine3A {
                matrix3: matrix,
                translation: eye.into(),
            },
            fov_y,
        }
    }

    /// The ray maker for a `width` x `height` image; the vertical angle of view is kept whatever the aspect ratio.
    pub fn rays(&self, width: u32, height: u32) -> CameraRays {
        let half_height = (0.5 * self.fov_y).tan();
        let half_width = half_height * width as f32 / height as f32;
        let world = |v: Vec3| Vec3::from(self.world_from_camera.matrix3 * Vec3A::from(v));
        CameraRays {
            origin_ws: self.world_from_camera.translation.into(),
            corner_ws: world(Vec3::new(-half_width, half_height, -1.0)),
            step_x_ws: world(Vec3::new(2.0 * half_width / width as f32, 0.0, 0.0)),
            step_y_ws: world(Vec3::new(0.0, -2.0 * half_height / height as f32, 0.0)),
        }
    }
}

impl CameraRays {
    /// Unit direction through the film position `at` in pixels: (0, 0) is the top left corner of the image.
    #[inline]
    pub fn direction_ws(&self, at: Vec2) -> Vec3 {
        (self.corner_ws + self.step_x_ws * at.x + self.step_y_ws * at.y).normalize()
    }
}
