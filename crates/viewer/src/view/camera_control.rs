//! The camera that keys and mouse fly.

use glam::{Affine3A, Mat3, Mat3A, Vec2, Vec3};
use scene::Camera;

/// The walker's speed at first, as a share of the scene's radius per second. Higher values cross the scene sooner; lower
/// values make small steps.
const SPEED_OF_RADIUS: f32 = 0.12;
/// What one notch of the wheel multiplies the speed by, as an exponent of e.
const SPEED_PER_NOTCH: f32 = 0.1;
/// What holding Shift multiplies the speed by; Ctrl divides by it.
const FAST: f32 = 4.0;
/// As far up and down as one can look, radians: straight up has no heading.
const STEEPEST: f32 = 1.55;
/// Longest step in time, seconds: after a hitch nobody wants to find himself in another room.
const LONGEST_STEP: f32 = 0.1;

/// Which way the walker wants to go.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) enum Motion {
    Forward,
    Back,
    Left,
    Right,
    Up,
    Down,
    Fast,
    Slow,
}

impl Motion {
    const ALL: [Self; 8] = [
        Self::Forward,
        Self::Back,
        Self::Left,
        Self::Right,
        Self::Up,
        Self::Down,
        Self::Fast,
        Self::Slow,
    ];
}

/// A camera in somebody's hands.
#[derive(Clone, Debug)]
pub(super) struct FlyCamera {
    camera: Camera,
    /// Metres per second.
    speed: f32,
    held: [bool; Motion::ALL.len()],
}

impl FlyCamera {
    /// Starts where `camera` is, at a speed that suits a scene of that radius.
    pub(super) fn new(camera: &Camera, scene_radius: f32) -> Self {
        Self {
            camera: camera.clone(),
            speed: (scene_radius * SPEED_OF_RADIUS).clamp(1e-3, 1e6),
            held: [false; Motion::ALL.len()],
        }
    }

    /// Where it is now.
    pub(super) fn camera(&self) -> &Camera {
        &self.camera
    }

    /// Metres per second.
    pub(super) fn speed(&self) -> f32 {
        self.speed
    }

    /// Jumps to another place; the keys stay held.
    pub(super) fn jump(&mut self, camera: &Camera) {
        self.camera.clone_from(camera);
    }

    /// A key of motion goes down or up.
    pub(super) fn hold(&mut self, motion: Motion, down: bool) {
        self.held[motion as usize] = down;
    }

    /// All keys up: the window has lost the keyboard.
    pub(super) fn release_all(&mut self) {
        self.held = [false; Motion::ALL.len()];
    }

    /// Whether any key moves it.
    pub(super) fn is_flying(&self) -> bool {
        self.wanted_direction() != Vec3::ZERO
    }

    /// The mouse has moved by so many pixels of a window `window_height` pixels high: what is under the pointer in
    /// the middle of the picture stays under it.
    pub(super) fn look(&mut self, pixels: Vec2, window_height: f32) {
        let radians_per_pixel = self.camera.fov_y / window_height.max(1.0);
        let turn = pixels * radians_per_pixel;
        if !turn.is_finite() || turn == Vec2::ZERO {
            return;
        }
        let forward = self.forward();
        let heading = forward.x.atan2(-forward.z) + turn.x;
        let pitch = (forward.y.clamp(-1.0, 1.0).asin() - turn.y).clamp(-STEEPEST, STEEPEST);
        let rotation = Mat3::from_rotation_y(-heading) * Mat3::from_rotation_x(pitch);
        self.camera.world_from_camera.matrix3 = Mat3A::from(rotation);
    }

    /// The wheel has turned by `notches`.
    pub(super) fn change_speed(&mut self, notches: f32) {
        if notches.is_finite() {
            self.speed = (self.speed * (SPEED_PER_NOTCH * notches).exp()).clamp(1e-3, 1e6);
        }
    }

    /// Flies on for `seconds`; whether it has moved.
    pub(super) fn advance(&mut self, seconds: f32) -> bool {
        let direction = self.wanted_direction();
        if direction == Vec3::ZERO || seconds <= 0.0 {
            return false;
        }
        let haste = match (self.held[Motion::Fast as usize], self.held[Motion::Slow as usize]) {
            (true, false) => FAST,
            (false, true) => 1.0 / FAST,
            _ => 1.0,
        };
        let step = direction * (self.speed * haste * seconds.min(LONGEST_STEP));
        self.camera.world_from_camera.translation += glam::Vec3A::from(step);
        true
    }

    fn forward(&self) -> Vec3 {
        Vec3::from(-self.camera.world_from_camera.matrix3.z_axis)
    }

    /// Unit direction of what is held, world space; zero if nothing is, or opposites are.
    fn wanted_direction(&self) -> Vec3 {
        let axis = |more: Motion, less: Motion| {
            f32::from(u8::from(self.held[more as usize])) - f32::from(u8::from(self.held[less as usize]))
        };
        let Affine3A { matrix3, .. } = self.camera.world_from_camera;
        let along = Vec3::from(matrix3.x_axis) * axis(Motion::Right, Motion::Left)
            + self.forward() * axis(Motion::Forward, Motion::Back)
            + Vec3::Y * axis(Motion::Up, Motion::Down);
        along.normalize_or_zero()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn fly() -> FlyCamera {
        let camera = Camera::look_at("c", Vec3::new(1.0, 2.0, 3.0), Vec3::new(1.0, 2.0, 0.0), Vec3::Y, 1.0);
        FlyCamera::new(&camera, 10.0)
    }

    fn position(fly: &FlyCamera) -> Vec3 {
        fly.camera().world_from_camera.translation.into()
    }

    #[test]
    fn keys_fly_where_they_say_at_the_speed_shown() {
        for (motion, expected) in [
            (Motion::Forward, -Vec3::Z),
            (Motion::Back, Vec3::Z),
            (Motion::Left, -Vec3::X),
            (Motion::Right, Vec3::X),
            (Motion::Up, Vec3::Y),
            (Motion::Down, -Vec3::Y),
        ] {
            let mut fly = fly();
            let start = position(&fly);
            fly.hold(motion, true);
            assert!(fly.advance(0.05));
            let step = position(&fly) - start;
            assert!(
                (step - expected * fly.speed() * 0.05).length() < 1e-5,
                "{motion:?}: {step}"
            );
            fly.hold(motion, false);
            assert!(!fly.advance(0.05) && !fly.is_flying());
        }
    }

    #[test]
    fn opposite_keys_cancel_and_two_are_no_faster_than_one() {
        let mut fly = fly();
        fly.hold(Motion::Left, true);
        fly.hold(Motion::Right, true);
        assert!(!fly.advance(0.05));
        fly.hold(Motion::Left, false);
        fly.hold(Motion::Forward, true);
        let start = position(&fly);
        fly.advance(0.05);
        assert!(((position(&fly) - start).length() - fly.speed() * 0.05).abs() < 1e-5);
    }

    #[test]
    fn shift_is_fast_ctrl_is_slow_and_a_hitch_is_no_leap() {
        let length = |held: Option<Motion>, seconds: f32| {
            let mut fly = fly();
            let start = position(&fly);
            fly.hold(Motion::Forward, true);
            held.into_iter().for_each(|key| fly.hold(key, true));
            fly.advance(seconds);
            (position(&fly) - start).length()
        };
        let plain = length(None, 0.05);
        assert!((length(Some(Motion::Fast), 0.05) / plain - FAST).abs() < 1e-3);
        assert!((length(Some(Motion::Slow), 0.05) * FAST / plain - 1.0).abs() < 1e-3);
        assert!((length(None, 60.0) - length(None, LONGEST_STEP)).abs() < 1e-5);
    }

    #[test]
    fn looking_turns_right_and_down_and_stays_upright() {
        let mut fly = fly();
        fly.look(Vec2::new(100.0, 0.0), 1000.0);
        let forward = fly.forward();
        assert!(forward.x > 0.0 && forward.y.abs() < 1e-6, "{forward}");
        assert!((forward.angle_between(-Vec3::Z) - 0.1).abs() < 1e-4);
        fly.look(Vec2::new(0.0, 50.0), 1000.0);
        assert!(fly.forward().y < 0.0);
        for _ in 0..100 {
            fly.look(Vec2::new(17.0, -400.0), 1000.0);
        }
        let up = Vec3::from(fly.camera().world_from_camera.matrix3.y_axis);
        assert!(up.y > 0.0, "never upside down: {up}");
        let matrix = fly.camera().world_from_camera.matrix3;
        assert!((matrix.determinant() - 1.0).abs() < 1e-4);
    }

    #[test]
    fn unfit_input_changes_nothing() {
        let mut fly = fly();
        let before = fly.camera().world_from_camera;
        fly.look(Vec2::new(f32::NAN, 1.0), 1000.0);
        fly.look(Vec2::new(f32::INFINITY, 1.0), 0.0);
        fly.change_speed(f32::NAN);
        fly.hold(Motion::Forward, true);
        fly.advance(-1.0);
        assert_eq!(fly.camera().world_from_camera, before);
        fly.change_speed(1e9);
        assert!(fly.speed().is_finite());
    }
}
