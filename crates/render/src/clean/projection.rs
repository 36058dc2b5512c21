//! Where points of the world appear in a picture.

use glam::{Affine3A, Vec2, Vec3};
use scene::Camera;

/// A camera the other way round: from the world to shares of a picture's width and height.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Projection {
    pub(crate) camera_from_world: Affine3A,
    /// Half of the picture's width and height at unit distance.
    pub(crate) half: Vec2,
}

impl Projection {
    /// `aspect` is width over height.
    pub fn new(camera: &Camera, aspect: f32) -> Self {
        let half_height = (0.5 * camera.fov_y).tan();
        Self {
            camera_from_world: camera.world_from_camera.inverse(),
            half: Vec2::new(half_height * aspect, half_height),
        }
    }

    /// Shares of width and height; `None` behind the camera.
    #[inline]
    pub fn share(&self, point_ws: Vec3) -> Option<Vec2> {
        let local = self.camera_from_world.transform_point3(point_ws);
        if local.z >= -1e-6 {
            return None;
        }
        let share = Vec2::new(local.x, -local.y) / (self.half * -local.z) * 0.5 + 0.5;
        share.is_finite().then_some(share)
    }

    /// Height of a pixel at unit distance, in a picture of `height` rows.
    pub fn pixel_size(&self, height: u32) -> f32 {
        2.0 * self.half.y / height as f32
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_point_is_projected_to_the_pixel_whose_ray_meets_it() {
        let camera = Camera::look_at("c", Vec3::new(1.0, 2.0, 3.0), Vec3::new(1.4, 1.8, 0.0), Vec3::Y, 1.0);
        let projection = Projection::new(&camera, 640.0 / 360.0);
        let rays = camera.rays(640, 360);
        let at = Vec2::new(123.0, 200.0);
        let point = rays.origin_ws + rays.direction_ws(at) * 7.0;
        let share = projection.share(point).expect("in front");
        assert!((share * Vec2::new(640.0, 360.0) - at).length() < 0.01, "{share}");
        assert!(projection.share(rays.origin_ws - rays.direction_ws(at)).is_none());
        let below = projection.share(point - Vec3::from(camera.world_from_camera.matrix3.y_axis));
        assert!(below.expect("in front").y > share.y);
    }
}
