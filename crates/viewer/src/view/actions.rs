//! What the window can be told to do, and the keys that tell it.

use super::camera_control::Motion;
use super::views::View;
use crate::cli::Backend;
use glam::{Vec2, Vec3};
use render::Method;
use winit::keyboard::KeyCode;

/// Something to do. Keys, panels and scripts all come to this.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Action {
    /// Starts or ends a motion.
    Fly(Motion, bool),
    /// Turns by so many pixels of mouse movement.
    Look(Vec2),
    /// Notches of the wheel.
    Speed(f32),
    /// Back to the scene's own camera.
    Home,
    /// Shows or hides something.
    Toggle(Part),
    /// Closes what is on top.
    Close,
    /// Shows this view.
    Show(View),
    /// Chooses lights by this method.
    Sample(Method),
    /// The next method in the list.
    NextSampler,
    /// Renders on this.
    Device(Backend),
    /// Bounces after the first surface.
    Bounces(u32),
    /// Lights drawn at the first surface.
    LightSamples(u32),
    /// Milliseconds for a frame while the picture moves.
    Budget(f64),
    /// So many stops more.
    Expose(f32),
    /// Takes the noise away, or shows it.
    Denoise,
    /// Switches automatic exposure.
    AutoExposure,
    /// Stops rendering or goes on.
    Pause,
    /// Tells about the pixel at this share of width and height.
    Inspect(Vec2),
    /// Marks a lamp.
    Select(Option<usize>),
    /// Changes a lamp's light: factor per channel.
    Relight(usize, Vec3),
    /// All lamps as the scene has them.
    RelightAll,
    /// Keeps the camera under this number.
    Store(usize),
    /// Goes to the camera of this number.
    Recall(usize),
    /// Starts to record a camera path, or ends and saves it.
    Record,
    /// Plays the last camera path, or stops.
    Play,
    /// Camera as text to the clipboard.
    CopyCamera,
    /// Another scene.
    Open(String),
    /// The same scene, read again.
    Reload,
    /// PNG as seen and linear EXR, in the current folder.
    Screenshot,
    Fullscreen,
    Quit,
}

/// What can be shown or hidden.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Part {
    Help,
    Settings,
    Lights,
    Overlay,
    OpenDialog,
    /// Everything but the picture.
    All,
}

/// Modifiers that a key needs.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) enum With {
    #[default]
    Nothing,
    Ctrl,
    Alt,
}

/// A line of the key list.
pub(super) struct Line {
    pub(super) keys: &'static str,
    pub(super) what: &'static str,
}

/// The key list by topic.
pub(super) const HELP: [(&str, &[Line]); 4] = [
    (
        "Walk",
        &[
            line("W A S D", "forward, left, back, right"),
            line("Q E", "down, up"),
            line("right drag", "look around"),
            line("wheel", "speed"),
            line("Shift  Ctrl", "fast, slow"),
            line("Home", "back to the scene's camera"),
            line("Ctrl+1 ... 9", "store a bookmark"),
            line("Alt+1 ... 9", "go to a bookmark"),
            line("K  P", "record, play a camera path"),
            line("C", "camera to the clipboard"),
        ],
    ),
    (
        "Picture",
        &[
            line("0  1 ... 6", "image, debug views"),
            line("T", "next sampler"),
            line("N", "noise as it is, or taken away"),
            line(",  .", "darker, brighter"),
            line("X", "exposure by itself, or fixed"),
            line("Space", "pause rendering"),
        ],
    ),
    (
        "Look closer",
        &[
            line("left click", "inspect a pixel: its lights"),
            line("L", "light table"),
            line("Tab", "settings"),
            line("F3", "figures"),
            line("F2", "hide everything"),
        ],
    ),
    (
        "Files and window",
        &[
            line("O", "open a scene"),
            line("F5", "read the scene again"),
            line("F12", "screenshot: PNG and EXR"),
            line("F11", "full screen"),
            line("Esc", "close what is open"),
            line("Ctrl+Q", "quit"),
        ],
    ),
];

const fn line(keys: &'static str, what: &'static str) -> Line {
    Line { keys, what }
}

/// The motion of a key that is held.
fn motion(key: KeyCode) -> Option<Motion> {
    Some(match key {
        KeyCode::KeyW => Motion::Forward,
        KeyCode::KeyS => Motion::Back,
        KeyCode::KeyA => Motion::Left,
        KeyCode::KeyD => Motion::Right,
        KeyCode::KeyE => Motion::Up,
        KeyCode::KeyQ => Motion::Down,
        KeyCode::ShiftLeft | KeyCode::ShiftRight => Motion::Fast,
        KeyCode::ControlLeft | KeyCode::ControlRight => Motion::Slow,
        _ => return None,
    })
}

/// What a key does that goes down (or up); `None` for nothing.
pub(super) fn action_of(key: KeyCode, with: With, down: bool) -> Option<Action> {
    if let Some(motion) = motion(key)
        && (!down || with != With::Ctrl || motion == Motion::Slow)
    {
        return Some(Action::Fly(motion, down));
    }
    if !down {
        return None;
    }
    if let Some(digit) = digit(key) {
        return match (with, digit) {
            (With::Nothing, digit) => View::ALL.get(digit).map(|&view| Action::Show(view)),
            (_, 0) => None,
            (With::Ctrl, digit) => Some(Action::Store(digit)),
            (With::Alt, digit) => Some(Action::Recall(digit)),
        };
    }
    Some(match (key, with) {
        (KeyCode::KeyQ, With::Ctrl) => Action::Quit,
        (_, With::Ctrl | With::Alt) => return None,
        (KeyCode::F1, _) => Action::Toggle(Part::Help),
        (KeyCode::F2, _) => Action::Toggle(Part::All),
        (KeyCode::F3, _) => Action::Toggle(Part::Overlay),
        (KeyCode::F5, _) => Action::Reload,
        (KeyCode::F11, _) => Action::Fullscreen,
        (KeyCode::F12, _) => Action::Screenshot,
        (KeyCode::Tab, _) => Action::Toggle(Part::Settings),
        (KeyCode::KeyL, _) => Action::Toggle(Part::Lights),
        (KeyCode::KeyO, _) => Action::Toggle(Part::OpenDialog),
        (KeyCode::KeyT, _) => Action::NextSampler,
        (KeyCode::Comma, _) => Action::Expose(-0.5),
        (KeyCode::Period, _) => Action::Expose(0.5),
        (KeyCode::KeyN, _) => Action::Denoise,
        (KeyCode::KeyX, _) => Action::AutoExposure,
        (KeyCode::KeyK, _) => Action::Record,
        (KeyCode::KeyP, _) => Action::Play,
        (KeyCode::KeyC, _) => Action::CopyCamera,
        (KeyCode::Space, _) => Action::Pause,
        (KeyCode::Home, _) => Action::Home,
        (KeyCode::Escape, _) => Action::Close,
        _ => return None,
    })
}

fn digit(key: KeyCode) -> Option<usize> {
    const DIGITS: [KeyCode; 10] = [
        KeyCode::Digit0,
        KeyCode::Digit1,
        KeyCode::Digit2,
        KeyCode::Digit3,
        KeyCode::Digit4,
        KeyCode::Digit5,
        KeyCode::Digit6,
        KeyCode::Digit7,
        KeyCode::Digit8,
        KeyCode::Digit9,
    ];
    DIGITS.iter().position(|&code| code == key)
}

/// The keys that do anything, by the names that scripts use.
pub(super) const KEY_NAMES: [(&str, KeyCode); 40] = [
    ("w", KeyCode::KeyW),
    ("a", KeyCode::KeyA),
    ("s", KeyCode::KeyS),
    ("d", KeyCode::KeyD),
    ("q", KeyCode::KeyQ),
    ("e", KeyCode::KeyE),
    ("shift", KeyCode::ShiftLeft),
    ("ctrl", KeyCode::ControlLeft),
    ("0", KeyCode::Digit0),
    ("1", KeyCode::Digit1),
    ("2", KeyCode::Digit2),
    ("3", KeyCode::Digit3),
    ("4", KeyCode::Digit4),
    ("5", KeyCode::Digit5),
    ("6", KeyCode::Digit6),
    ("7", KeyCode::Digit7),
    ("8", KeyCode::Digit8),
    ("9", KeyCode::Digit9),
    ("f1", KeyCode::F1),
    ("f2", KeyCode::F2),
    ("f3", KeyCode::F3),
    ("f5", KeyCode::F5),
    ("f11", KeyCode::F11),
    ("f12", KeyCode::F12),
    ("tab", KeyCode::Tab),
    ("l", KeyCode::KeyL),
    ("o", KeyCode::KeyO),
    ("t", KeyCode::KeyT),
    ("comma", KeyCode::Comma),
    ("period", KeyCode::Period),
    ("x", KeyCode::KeyX),
    ("n", KeyCode::KeyN),
    ("k", KeyCode::KeyK),
    ("p", KeyCode::KeyP),
    ("c", KeyCode::KeyC),
    ("space", KeyCode::Space),
    ("home", KeyCode::Home),
    ("esc", KeyCode::Escape),
    ("up", KeyCode::ArrowUp),
    ("enter", KeyCode::Enter),
];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keys_do_what_the_list_says() {
        use With::{Alt, Ctrl, Nothing};
        let down = |key, with| action_of(key, with, true);
        assert_eq!(down(KeyCode::KeyW, Nothing), Some(Action::Fly(Motion::Forward, true)));
        assert_eq!(
            action_of(KeyCode::KeyW, Nothing, false),
            Some(Action::Fly(Motion::Forward, false))
        );
        assert_eq!(down(KeyCode::Digit0, Nothing), Some(Action::Show(View::Image)));
        assert_eq!(down(KeyCode::Digit2, Nothing), Some(Action::Show(View::Normal)));
        assert_eq!(down(KeyCode::Digit9, Nothing), None);
        assert_eq!(down(KeyCode::Digit3, Ctrl), Some(Action::Store(3)));
        assert_eq!(down(KeyCode::Digit3, Alt), Some(Action::Recall(3)));
        assert_eq!(down(KeyCode::KeyQ, Ctrl), Some(Action::Quit));
        assert_eq!(down(KeyCode::KeyQ, Nothing), Some(Action::Fly(Motion::Down, true)));
    }

    #[test]
    fn a_motion_always_ends_whatever_is_held_then() {
        for (_, key) in KEY_NAMES {
            if let Some(Action::Fly(motion, true)) = action_of(key, With::Nothing, true) {
                for with in [With::Nothing, With::Ctrl, With::Alt] {
                    assert_eq!(action_of(key, with, false), Some(Action::Fly(motion, false)));
                }
            }
        }
    }
}
