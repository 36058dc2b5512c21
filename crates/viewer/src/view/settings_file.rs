//! What the window remembers from one run to the next, in the user's configuration folder.

use super::views::View;
use crate::output;
use anyhow::Context;
use glam::{Affine3A, Mat3A, Vec3A};
use scene::Camera;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Scenes that are remembered.
const RECENT: usize = 8;

/// What is remembered. Anything missing or unknown in the file is as at the first run.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub(super) struct Remembered {
    /// Scenes that were open, the last one first.
    pub(super) recent: Vec<String>,
    /// Whether the figures are shown.
    pub(super) overlay: bool,
    /// Whether the settings are open.
    pub(super) settings: bool,
    /// The view.
    pub(super) view: View,
    /// Bookmarks by scene, by number.
    pub(super) bookmarks: BTreeMap<String, BTreeMap<usize, Pose>>,
}

/// A camera in a file.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Pose {
    position: [f32; 3],
    /// Columns of camera to world.
    rotation: [f32; 9],
    /// Radians.
    fov_y: f32,
}

impl Default for Remembered {
    fn default() -> Self {
        Self {
            recent: Vec::new(),
            overlay: true,
            settings: false,
            view: View::Image,
            bookmarks: BTreeMap::new(),
        }
    }
}

impl Remembered {
    /// Reads the file; what was never written or cannot be understood is as at the first run.
    pub(super) fn read() -> Self {
        let text = path().and_then(|path| std::fs::read_to_string(path).ok());
        text.and_then(|text| serde_json::from_str(&text).ok())
            .unwrap_or_default()
    }

    /// Writes the file.
    ///
    /// # Errors
    /// Those of the file system.
    pub(super) fn write(&self) -> anyhow::Result<()> {
        let Some(path) = path() else { return Ok(()) };
        if let Some(folder) = path.parent() {
            std::fs::create_dir_all(folder)?;
        }
        output::write(&path, (serde_json::to_string_pretty(self)? + "\n").as_bytes())
    }

    /// Puts a scene to the top of the list.
    pub(super) fn opened(&mut self, what: &str) {
        self.recent.retain(|other| other != what);
        self.recent.insert(0, what.into());
        self.recent.truncate(RECENT);
    }
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
    pub(super) fn camera(&self, name: &str) -> Option<Camera> {
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
pub(super) fn read_path(path: &Path) -> anyhow::Result<Vec<Camera>> {
    let shown = path.display();
    let text = std::fs::read_to_string(path).with_context(|| format!("{shown}: cannot read the camera path"))?;
    let poses: Vec<Pose> = serde_json::from_str(&text).with_context(|| format!("{shown}: no camera path"))?;
    let cameras: Option<Vec<Camera>> = poses.iter().map(|pose| pose.camera("path")).collect();
    cameras.with_context(|| format!("{shown}: a pose is no rotation, or its angle of view is not between 0 and pi"))
}

/// Writes a camera path.
///
/// # Errors
/// Those of the file system.
pub(super) fn write_path(path: &Path, cameras: &[Camera]) -> anyhow::Result<()> {
    let poses: Vec<Pose> = cameras.iter().map(Pose::from).collect();
    output::write(path, (serde_json::to_string(&poses)? + "\n").as_bytes())
}

/// Where it is kept; `None` where there is no home.
fn path() -> Option<PathBuf> {
    let folder = |name: &str| {
        std::env::var_os(name)
            .filter(|value| !value.is_empty())
            .map(PathBuf::from)
    };
    let config = if cfg!(windows) {
        folder("APPDATA")
    } else if cfg!(target_os = "macos") {
        folder("HOME").map(|home| home.join("Library/Application Support"))
    } else {
        folder("XDG_CONFIG_HOME").or_else(|| folder("HOME").map(|home| home.join(".config")))
    };
    config.map(|config| config.join("manylight").join("window.json"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3;

    #[test]
    fn what_is_written_is_read_again() {
        let camera = Camera::look_at("c", Vec3::new(1.0, 2.0, 3.0), Vec3::ZERO, Vec3::Y, 0.9);
        let mut remembered = Remembered::default();
        remembered.opened("demo:rooms");
        remembered
            .bookmarks
            .entry("demo:rooms".into())
            .or_default()
            .insert(3, Pose::from(&camera));
        let json = serde_json::to_string(&remembered).expect("serialisable");
        let read: Remembered = serde_json::from_str(&json).expect("its own text");
        assert_eq!(read, remembered);
        let back = read.bookmarks["demo:rooms"][&3].camera("back").expect("a camera");
        assert_eq!(back.world_from_camera, camera.world_from_camera);
    }

    #[test]
    fn what_is_missing_or_odd_is_as_at_the_first_run() {
        let read: Remembered = serde_json::from_str(r#"{"overlay": false, "of a later version": 1}"#).expect("valid");
        assert_eq!(
            read,
            Remembered {
                overlay: false,
                ..Remembered::default()
            }
        );
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
        write_path(&file, &cameras).expect("a writable folder");
        let read = read_path(&file).expect("its own file");
        let poses = |cameras: &[Camera]| cameras.iter().map(|c| c.world_from_camera).collect::<Vec<_>>();
        assert_eq!(poses(&read), poses(&cameras));
        for text in ["walk", "[{\"position\": [0, 0, 0]}]"] {
            std::fs::write(&file, text).expect("a writable folder");
            let error = format!("{:#}", read_path(&file).expect_err(text));
            assert!(
                error.contains("path.json") && error.contains("no camera path"),
                "{error}"
            );
        }
        assert!(read_path(&folder.path().join("none.json")).is_err());
    }

    #[test]
    fn the_list_of_scenes_is_short_and_without_doubles() {
        let mut remembered = Remembered::default();
        (0..20).for_each(|i| remembered.opened(&format!("{i}.glb")));
        remembered.opened("15.glb");
        assert_eq!(remembered.recent.len(), RECENT);
        assert_eq!(remembered.recent[..3], ["15.glb", "19.glb", "18.glb"]);
    }
}
