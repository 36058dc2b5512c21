//! Bookmarks, camera paths, and the camera as text.

use super::app::App;
use super::settings_file::Remembered;
use crate::camera_path::{self, Pose};
use crate::message;
use scene::Camera;
use std::path::PathBuf;

impl App {
    /// A scene is about to be shown: its bookmarks are taken up, and it heads the list of scenes.
    pub(super) fn recall_scene(&mut self, what: &str) {
        self.keep_bookmarks();
        self.bookmarks.clear();
        let Some(remembered) = &mut self.remembered else { return };
        remembered.opened(what);
        let poses = remembered.bookmarks.get(what).into_iter().flatten();
        self.bookmarks = poses
            .filter_map(|(&number, pose)| Some((number, pose.camera("bookmark")?)))
            .collect();
    }

    /// Enters the bookmarks of the scene that is shown into what is remembered.
    fn keep_bookmarks(&mut self) {
        let (Some(remembered), Some(stage)) = (&mut self.remembered, &self.stage) else {
            return;
        };
        let poses = self
            .bookmarks
            .iter()
            .map(|(&number, camera)| (number, Pose::from(camera)));
        remembered.bookmarks.insert(stage.what.clone(), poses.collect());
    }

    /// Writes what the next run should know.
    pub(super) fn remember(&mut self) {
        self.keep_bookmarks();
        let Some(remembered) = self.remembered.take() else {
            return;
        };
        let now = Remembered {
            overlay: self.panels.overlay,
            settings: self.panels.settings,
            view: self.view,
            ..remembered
        };
        if let Err(error) = now.write() {
            message::warn(format!("the window's settings are not kept: {error:#}"));
        }
    }

    /// Keeps the camera under a number.
    pub(super) fn store_bookmark(&mut self, number: usize) {
        self.say(format!("bookmark {number} stored"));
        self.bookmarks.insert(number, self.fly.camera().clone());
    }

    /// Goes to the camera of a number.
    pub(super) fn recall_bookmark(&mut self, number: usize) {
        match self.bookmarks.get(&number).cloned() {
            Some(camera) => self.jump(&camera),
            None => self.say(format!("no bookmark {number}; Ctrl+{number} stores one")),
        }
    }

    /// Starts to record a camera path, or ends it.
    pub(super) fn toggle_record(&mut self) {
        match self.driver.recording.take() {
            None => {
                self.driver.recording = Some(Vec::new());
                self.say("recording the camera's path; K ends it");
            }
            Some(path) => {
                let name = |number: u32| PathBuf::from(format!("manylight-path-{number:04}.json"));
                let free = (1..).map(name).find(|name| !name.exists()).unwrap_or_default();
                let written = camera_path::write(&free, &path);
                self.say(match written {
                    Ok(()) => format!("{}: {} frames; P plays them", free.display(), path.len()),
                    Err(error) => format!("P plays {} frames, but they are not kept: {error:#}", path.len()),
                });
                self.driver.path = path;
            }
        }
    }

    /// Plays the camera path, or stops.
    pub(super) fn toggle_play(&mut self) {
        if self.driver.playing.take().is_some() {
            return;
        }
        if self.driver.path.is_empty() {
            self.say("no camera path yet; K records one");
        } else {
            self.driver.playing = Some(0);
        }
    }

    /// Puts the camera to the clipboard as a line of a script.
    pub(super) fn copy_camera(&mut self) {
        let line = script_line(self.fly.camera());
        self.say(line.clone());
        self.egui.copy_text(line);
    }
}

/// The camera as a line of a script.
fn script_line(camera: &Camera) -> String {
    let pose = camera.world_from_camera;
    let eye = pose.translation;
    let target = eye - pose.matrix3.z_axis;
    format!(
        "0 camera {} {} {}  {} {} {}",
        eye.x, eye.y, eye.z, target.x, target.y, target.z
    )
}
