//! What the window remembers from one run to the next, in the user's configuration folder.

use super::views::View;
use crate::camera_path::Pose;
use crate::output;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::PathBuf;

/// Scenes that are remembered.
const RECENT: usize = 8;

/// What is remembered. Anything missing or unknown in the file is as at the first run.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub(crate) struct Remembered {
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
        text.and_then(|text| Self::parse(&text)).unwrap_or_default()
    }

    /// Understands a text, if it can be understood.
    pub(crate) fn parse(text: &str) -> Option<Self> {
        serde_json::from_str(text).ok()
    }

    /// All bookmarks of all scenes.
    pub(crate) fn bookmarks(&self) -> impl Iterator<Item = &Pose> {
        self.bookmarks.values().flat_map(BTreeMap::values)
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
    use scene::Camera;

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
