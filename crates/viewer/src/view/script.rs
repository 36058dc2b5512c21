//! `view --script FILE`: drives the window without a hand. One line is one action: the number of the frame at which it is
//! due, what to do, and its arguments.

use super::actions::{KEY_NAMES, With};
use super::views::View;
use crate::cli::Backend;
use anyhow::{Context, Result, bail};
use clap::ValueEnum;
use glam::{Vec2, Vec3};
use render::Method;
use std::collections::VecDeque;
use std::path::{Path, PathBuf};
use std::str::FromStr;
use winit::keyboard::KeyCode;

/// The lines that a script may have, for help and errors.
pub(super) const SYNTAX: &str = "\
FRAME camera EX EY EZ TX TY TZ    stand at E, look at T
FRAME key [ctrl+|alt+]NAME [N]    hold a key for N frames (1)
FRAME look DX DY                  move the mouse by pixels, right button held
FRAME wheel NOTCHES               change the speed
FRAME click X Y                   left click at a share of width and height
FRAME view NAME                   image, albedo, normal, depth, light, error, cells
FRAME sampler NAME                as --sampler
FRAME resize WIDTH HEIGHT         as if the window had that size
FRAME open SCENE                  load another scene
FRAME settle SPP                  wait until the picture rests and has SPP samples per pixel
FRAME random N SEED               N random inputs
FRAME screenshot FILE             .png as seen, .exr linear
FRAME report FILE                 frame times and input latency as JSON
FRAME backend NAME                cpu, gpu
FRAME lose-device WHICH           as if the driver failed: window (what shows), renderer (what --backend gpu renders on)
FRAME quit";

/// Something due.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Step {
    Camera(Vec3, Vec3),
    Key { key: KeyCode, with: With, frames: u64 },
    Look(Vec2),
    Wheel(f32),
    Click(Vec2),
    Show(View),
    Sample(Method),
    Resize(u32, u32),
    Open(String),
    Settle(u64),
    Random { count: u32, seed: u32 },
    Screenshot(PathBuf),
    Report(PathBuf),
    Render(Backend),
    LoseDevice(Which),
    Quit,
}

/// One of the two devices that may be there.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Which {
    /// The window is drawn with it.
    Window,
    /// The GPU back end renders on it.
    Renderer,
}

/// A script, and how far it has come.
#[derive(Clone, Debug)]
pub(crate) struct Script {
    steps: VecDeque<(u64, Step)>,
    /// Frames so far. Stands still while something is waited for.
    frame: u64,
}

impl Script {
    /// Reads a file.
    ///
    /// # Errors
    /// If it cannot be read, or a line is not understood.
    pub(super) fn read(path: &Path) -> Result<Self> {
        let text =
            std::fs::read_to_string(path).with_context(|| format!("{}: cannot read the script", path.display()))?;
        Self::parse(&text).with_context(|| path.display().to_string())
    }

    /// Understands a text.
    ///
    /// # Errors
    /// The first line that is not understood, with its number.
    pub(crate) fn parse(text: &str) -> Result<Self> {
        let mut steps = VecDeque::new();
        for (number, line) in (1..).zip(text.lines()) {
            let line = line.split('#').next().unwrap_or_default();
            let words: Vec<&str> = line.split_whitespace().collect();
            let Some((frame, words)) = words.split_first() else {
                continue;
            };
            let step = parse_frame(frame, &steps).and_then(|frame| Ok((frame, parse_step(words)?)));
            steps.push_back(step.with_context(|| format!("line {number}: '{}'", line.trim()))?);
        }
        Ok(Self { steps, frame: 0 })
    }

    /// Takes the next step that is due in this frame, if any is.
    pub(super) fn due(&mut self) -> Option<Step> {
        let (frame, _) = self.steps.front()?;
        if *frame > self.frame {
            return None;
        }
        self.steps.pop_front().map(|(_, step)| step)
    }

    /// Puts a step back that has to wait.
    pub(super) fn wait_for(&mut self, step: Step) {
        self.steps.push_front((self.frame, step));
    }

    /// A frame was drawn. False when the script is at its end.
    pub(super) fn advance(&mut self) -> bool {
        self.frame += 1;
        !self.steps.is_empty()
    }
}

/// Frames may not go back.
fn parse_frame(word: &str, before: &VecDeque<(u64, Step)>) -> Result<u64> {
    let frame = number(word, "the number of a frame")?;
    if before.back().is_some_and(|(last, _)| *last > frame) {
        bail!("frames must not go back");
    }
    Ok(frame)
}

fn parse_step(words: &[&str]) -> Result<Step> {
    let floats = |words: &[&str]| -> Result<Vec<f32>> {
        let values: Result<Vec<f32>> = words.iter().map(|word| number(word, "a number")).collect();
        let values = values?;
        if values.iter().any(|value| !value.is_finite()) {
            bail!("numbers must be finite");
        }
        Ok(values)
    };
    Ok(match words {
        ["camera", coordinates @ ..] if coordinates.len() == 6 => {
            let c = floats(coordinates)?;
            let (eye, target) = (Vec3::new(c[0], c[1], c[2]), Vec3::new(c[3], c[4], c[5]));
            if (target - eye).cross(Vec3::Y).length() < 1e-6 {
                bail!("the camera must not look straight up or down, nor at itself");
            }
            Step::Camera(eye, target)
        }
        ["key", key] => parse_key(key, 1)?,
        ["key", key, frames] => parse_key(key, number(frames, "a number of frames")?)?,
        ["look", x, y] => Step::Look(Vec2::from_slice(&floats(&[x, y])?)),
        ["wheel", notches] => Step::Wheel(floats(&[notches])?[0]),
        ["click", x, y] => Step::Click(Vec2::from_slice(&floats(&[x, y])?)),
        ["view", name] => {
            let found = View::ALL.into_iter().find(|view| view.name() == *name);
            Step::Show(found.with_context(|| {
                let names: Vec<_> = View::ALL.iter().map(|view| view.name()).collect();
                format!("no view '{name}'; there is: {}", names.join(", "))
            })?)
        }
        ["sampler", name] => Step::Sample(Method::try_from((*name).to_owned()).map_err(anyhow::Error::msg)?),
        ["resize", width, height] => Step::Resize(number(width, "a width")?, number(height, "a height")?),
        ["open", scene] => Step::Open((*scene).into()),
        ["settle", spp] => Step::Settle(number(spp, "samples per pixel")?),
        ["random", count, seed] => Step::Random {
            count: number(count, "a number of inputs")?,
            seed: number(seed, "a seed")?,
        },
        ["screenshot", file] => Step::Screenshot(file.into()),
        ["report", file] => Step::Report(file.into()),
        ["backend", name] => Step::Render(match Backend::from_str(name, false) {
            Ok(backend) => backend,
            Err(_) => bail!("no back end '{name}'; there is: cpu, gpu"),
        }),
        ["lose-device", "window"] => Step::LoseDevice(Which::Window),
        ["lose-device", "renderer"] => Step::LoseDevice(Which::Renderer),
        ["quit"] => Step::Quit,
        _ => bail!("not understood; the lines are:\n{SYNTAX}"),
    })
}

fn parse_key(word: &str, frames: u64) -> Result<Step> {
    let (with, name) = match word.split_once('+') {
        Some(("ctrl", name)) => (With::Ctrl, name),
        Some(("alt", name)) => (With::Alt, name),
        _ => (With::Nothing, word),
    };
    let Some((_, key)) = KEY_NAMES.iter().find(|(known, _)| *known == name) else {
        let names: Vec<_> = KEY_NAMES.iter().map(|(name, _)| *name).collect();
        bail!("no key '{name}'; there is: {}", names.join(", "));
    };
    Ok(Step::Key {
        key: *key,
        with,
        frames,
    })
}

fn number<T: FromStr>(word: &str, what: &str) -> Result<T> {
    word.parse().ok().with_context(|| format!("'{word}' is not {what}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_script_is_carried_out_frame_by_frame_in_order() {
        let text = "# a walk\n0 view normal\n\n2 key w 10\n2 look 5 -3   # and look\n4 quit\n";
        let mut script = Script::parse(text).expect("a valid script");
        assert_eq!(script.due(), Some(Step::Show(View::Normal)));
        assert_eq!(script.due(), None);
        assert!(script.advance() && script.advance());
        let key = Step::Key {
            key: KeyCode::KeyW,
            with: With::Nothing,
            frames: 10,
        };
        assert_eq!(script.due(), Some(key));
        assert_eq!(script.due(), Some(Step::Look(Vec2::new(5.0, -3.0))));
        assert_eq!(script.due(), None);
        assert!(script.advance() && script.advance());
        assert_eq!(script.due(), Some(Step::Quit));
        assert!(!script.advance());
    }

    #[test]
    fn a_step_that_waits_holds_up_what_follows() {
        let mut script = Script::parse("0 settle 4\n0 quit").expect("a valid script");
        let step = script.due().expect("due");
        script.wait_for(step.clone());
        assert_eq!(script.due(), Some(step));
        assert_eq!(script.due(), Some(Step::Quit));
    }

    #[test]
    fn every_line_of_the_syntax_is_understood() {
        for line in SYNTAX.lines() {
            let usage = line.split("  ").next().expect("something").trim();
            let example = usage
                .replace("FRAME", "0")
                .replace("EX EY EZ TX TY TZ", "0 1 2 3 4 5")
                .replace("[ctrl+|alt+]NAME [N]", "ctrl+1 3")
                .replace("DX DY", "1 -2")
                .replace("NOTCHES", "2")
                .replace("X Y", "0.5 0.5")
                .replace("WIDTH HEIGHT", "0 7")
                .replace("SCENE", "demo:rooms")
                .replace("SPP", "4")
                .replace("N SEED", "10 3")
                .replace("FILE", "out.png")
                .replace("WHICH", "renderer");
            let name = match usage {
                usage if usage.contains("sampler") => "tree",
                usage if usage.contains("backend") => "gpu",
                _ => "depth",
            };
            let example = example.replace("NAME", name);
            Script::parse(&example).unwrap_or_else(|error| panic!("{example}: {error:#}"));
        }
    }

    #[test]
    fn errors_name_the_line_and_what_is_possible() {
        for (text, expected) in [
            ("0 view radar", "there is: image"),
            ("0 key hyper", "no key 'hyper'"),
            ("x quit", "not the number of a frame"),
            ("5 quit\n3 quit", "line 2"),
            ("0 jump", "FRAME camera"),
            ("0 camera 0 0 0 0 5 0", "straight up"),
            ("0 look nan 1", "finite"),
            ("0 sampler best", "adaptive"),
            ("0 backend tpu", "cpu, gpu"),
            ("0 lose-device", "WHICH"),
        ] {
            let error = format!("{:#}", Script::parse(text).expect_err(text));
            assert!(error.contains(expected), "{text}: {error}");
        }
    }
}
