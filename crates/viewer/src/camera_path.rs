//! Camera paths: what the window records, and what it, `render` and `bench` follow. A file is a JSON list of poses, one a frame.

use crate::output;
use anyhow::{Context, bail};
use glam::{Affine3A, Mat3A, Vec3A};
use scene::Camera;
use serde::{Deserialize, Serialize};
use std::ops::Range;
use std::path::Path;
use std::str::FromStr;

/// A camera in a file.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Pose {
    position: [f32; 3],
    /// Columns of camera to world.
    rotation: [f32; 9],
    /// Radians.
    fov_y: f32,
}

impl From<&Camera> for Pose {
    fn from(camera: &Camera) -> Self {
        let pose = camera.world_from_camera;
        Self {
            position: pose.translation.to_array(),
            rotation: pose.matrix3.to_cols_array(),
            fov_y: camera.fov_y,
        }
    }
}

impl Pose {
    /// The camera, if the numbers make one.
    pub(crate) fn camera(&self, name: &str) -> Option<Camera> {
        let rotation = Mat3A::from_cols_array(&self.rotation);
        let orthonormal = (rotation * rotation.transpose()).abs_diff_eq(Mat3A::IDENTITY, 1e-3);
        let translation = Vec3A::from(self.position);
        let valid = orthonormal && rotation.determinant() > 0.0 && translation.is_finite();
        (valid && self.fov_y > 0.0 && self.fov_y < std::f32::consts::PI).then(|| Camera {
            name: name.into(),
            world_from_camera: Affine3A {
                matrix3: rotation,
                translation,
            },
            fov_y: self.fov_y,
        })
    }
}

/// Reads a camera path: a JSON list of cameras, one a frame.
///
/// # Errors
/// If it cannot be read, or is no camera path.
pub(crate) fn read(path: &Path) -> anyhow::Result<Vec<Camera>> {
    let shown = path.display();
    let text = std::fs::read_to_string(path).with_context(|| format!("{shown}: cannot read the camera path"))?;
    parse(&text).with_context(|| shown.to_string())
}

/// Understands a text.
///
/// # Errors
/// If it is no camera path.
pub(crate) fn parse(text: &str) -> anyhow::Result<Vec<Camera>> {
    let poses: Vec<Pose> =
        serde_json::from_str(text).context("no camera path; the window records one, see its key K")?;
    if poses.is_empty() {
        bail!("the camera path has no frames");
    }
    let cameras: Option<Vec<Camera>> = poses.iter().map(|pose| pose.camera("path")).collect();
    cameras.context("a pose is no rotation, or its angle of view is not between 0 and pi")
}

/// Writes a camera path.
///
/// # Errors
/// Those of the file system.
pub(crate) fn write(path: &Path, cameras: &[Camera]) -> anyhow::Result<()> {
    let poses: Vec<Pose> = cameras.iter().map(Pose::from).collect();
    output::write(path, (serde_json::to_string(&poses)? + "\n").as_bytes())
}

/// Frames of a path, as they are asked for: `A..B`, the first frame being 0 and frame B not among them, or `A..=B`, or `A..`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Frames {
    first: usize,
    /// One after the last; `None`: to the end.
    end: Option<usize>,
}

impl FromStr for Frames {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        const HOW: &str = "must be A..B, the first frame being 0 and frame B not among them, or A..=B, or A..";
        let (first, last) = text.split_once("..").ok_or(HOW)?;
        let number = |text: &str| text.parse::<usize>().map_err(|_| HOW.to_string());
        let first = if first.is_empty() { 0 } else { number(first)? };
        let end = match last.strip_prefix('=') {
            _ if last.is_empty() => None,
            Some(last) => Some(number(last)?.checked_add(1).ok_or(HOW)?),
            None => Some(number(last)?),
        };
        if end.is_some_and(|end| end <= first) {
            return Err(format!("there are no frames in '{text}'; it {HOW}"));
        }
        Ok(Self { first, end })
    }
}

impl Frames {
    /// Those of a path of `count` frames.
    ///
    /// # Errors
    /// If it is not that long.
    pub(crate) fn of(&self, count: usize) -> anyhow::Result<Range<usize>> {
        let end = self.end.unwrap_or(count);
        if end > count || self.first >= end {
            bail!("--frames asks for more than the camera path has: its {count} frames are 0..{count}");
        }
        Ok(self.first..end)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3;

    #[test]
    fn a_pose_that_is_no_rotation_makes_no_camera() {
        let pose = Pose {
            position: [0.0; 3],
            rotation: [0.0; 9],
            fov_y: 1.0,
        };
        assert!(pose.camera("flat").is_none());
    }

    #[test]
    fn a_camera_path_is_read_as_it_was_written_and_others_are_refused() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let file = folder.path().join("path.json");
        let camera = |x: f32| Camera::look_at("c", Vec3::X * x, Vec3::new(x, 1.0, 5.0), Vec3::Y, 1.0);
        let cameras: Vec<Camera> = (0..5).map(|i| camera(i as f32)).collect();
        write(&file, &cameras).expect("a writable folder");
        let back = read(&file).expect("its own file");
        let poses = |cameras: &[Camera]| cameras.iter().map(|c| c.world_from_camera).collect::<Vec<_>>();
        assert_eq!(poses(&back), poses(&cameras));
        for text in ["walk", "[{\"position\": [0, 0, 0]}]"] {
            std::fs::write(&file, text).expect("a writable folder");
            let error = format!("{:#}", read(&file).expect_err(text));
            assert!(
                error.contains("path.json") && error.contains("no camera path"),
                "{error}"
            );
        }
        assert!(read(&folder.path().join("none.json")).is_err());
    }

    #[test]
    fn frames_are_ranges_of_the_path() {
        let frames = |text: &str| {
            text.parse::<Frames>()
                .and_then(|frames| frames.of(10).map_err(|error| error.to_string()))
        };
        assert_eq!(frames("2..5"), Ok(2..5));
        assert_eq!(frames("2..=5"), Ok(2..6));
        assert_eq!(frames("7.."), Ok(7..10));
        assert_eq!(frames("..3"), Ok(0..3));
        for odd in ["", "3", "5..5", "6..2", "a..b", "-1..3", "0..=18446744073709551615"] {
            assert!(frames(odd).expect_err(odd).contains("A..B"), "{odd}");
        }
        for beyond in ["0..11", "10..", "3..=10"] {
            assert!(frames(beyond).expect_err(beyond).contains("0..10"), "{beyond}");
        }
    }
}
