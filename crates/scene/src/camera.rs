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
    /// From the pinhole to the image's top left corner, one metre in front of it.
    pub corner_ws: Vec3,
    /// From a pixel to its right neighbour, there.
    pub step_x_ws: Vec3,
    /// From a pixel to the one below.
    pub step_y_ws: Vec3,
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

#[cfg(test)]
mod tests {
    use super::*;

    fn camera() -> Camera {
        Camera::look_at("c", Vec3::new(1.0, 2.0, 3.0), Vec3::new(4.0, 2.0, -1.0), Vec3::Y, 1.0)
    }

    #[test]
    fn the_middle_of_the_image_looks_at_the_target() {
        let rays = camera().rays(640, 480);
        assert_eq!(rays.origin_ws, Vec3::new(1.0, 2.0, 3.0));
        let forward = Vec3::new(3.0, 0.0, -4.0) / 5.0;
        assert!((rays.direction_ws(Vec2::new(320.0, 240.0)) - forward).length() < 1e-6);
    }

    #[test]
    fn up_is_up_and_right_is_right() {
        let rays = camera().rays(640, 480);
        let middle = rays.direction_ws(Vec2::new(320.0, 240.0));
        assert!(rays.direction_ws(Vec2::new(320.0, 0.0)).y > middle.y);
        let right = rays.direction_ws(Vec2::new(640.0, 240.0)) - middle;
        assert!(right.dot(middle.cross(Vec3::Y)) > 0.0);
    }

    #[test]
    fn the_angle_of_view_is_vertical_whatever_the_aspect() {
        for width in [100, 480, 2000] {
            let rays = camera().rays(width, 480);
            let (x, edges) = (0.5 * width as f32, [0.0, 480.0]);
            let [top, bottom] = edges.map(|y| rays.direction_ws(Vec2::new(x, y)));
            assert!((top.angle_between(bottom) - 1.0).abs() < 1e-5);
            // Square pixels: a pixel to the right is as far as a pixel down.
            let at = Vec2::new(x, 240.0);
            let [here, beside, below] = [at, at + Vec2::X, at + Vec2::Y].map(|p| rays.direction_ws(p));
            assert!((beside.distance(here) / below.distance(here) - 1.0).abs() < 1e-3);
        }
    }
}
