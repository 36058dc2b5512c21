//! `render --camera-path`: an image for each frame of a camera path.

use super::RenderArgs;
use super::file::{self, Format, Made};
use super::stats::Stats;
use crate::camera_path::{self, Frames};
use crate::exit::Status;
use crate::interrupt::Watch;
use crate::session::{self, BackEnd, Budget, Loaded};
use crate::{message, output};
use anyhow::{Result, bail};
use clap::Args;
use render::{Settings, image};
use scene::Camera;
use std::path::{Path, PathBuf};

/// Options of image sequences.
#[derive(Debug, Args)]
pub(super) struct SequenceArgs {
    /// Render along this camera path, as the window records it; "####" in the name of the output is the number of the frame
    ///
    /// What was learned about the lights is kept from frame to frame.
    #[arg(long, value_name = "FILE", conflicts_with_all = ["camera", "stats", "display_server", "resume", "shard"])]
    camera_path: Option<PathBuf>,
    /// Which of its frames: A..B, the first being 0 and frame B not among them, or A..=B; default: all
    #[arg(long, value_name = "A..B", requires = "camera_path")]
    frames: Option<Frames>,
}

/// The frames to be rendered.
#[derive(Debug)]
pub(super) struct Sequence {
    frames: Vec<(Camera, PathBuf)>,
}

impl SequenceArgs {
    /// The frames asked for, each with its file, which can be written; `None` if one image is asked for.
    ///
    /// # Errors
    /// Paths that cannot be read, frames that they do not have, names without room for a number.
    pub(super) fn frames(&self, output: &Path) -> Result<Option<Sequence>> {
        let Some(path) = &self.camera_path else { return Ok(None) };
        let mut cameras = camera_path::read(path)?;
        let range = match &self.frames {
            Some(frames) => frames.of(cameras.len())?,
            None => 0..cameras.len(),
        };
        let name = Numbered::new(output)?;
        if Format::of(output)? == Format::Part {
            bail!("{}: a sequence is of images, .exr or .png", output.display());
        }
        let frames: Vec<(Camera, PathBuf)> = cameras.drain(range.clone()).zip(range.map(|n| name.file(n))).collect();
        for (_, file) in &frames {
            output::check_writable(file)?;
        }
        Ok(Some(Sequence { frames }))
    }
}

/// A file name with room for a number.
struct Numbered {
    before: String,
    /// Least number of digits.
    digits: usize,
    after: String,
}

impl Numbered {
    fn new(path: &Path) -> Result<Self> {
        let shown = path.display();
        let Some(text) = path.to_str() else {
            bail!("{shown}: the name of the output is not valid Unicode");
        };
        let digits = text.chars().filter(|&c| c == '#').count();
        match text.find(&"#".repeat(digits)) {
            Some(at) if digits > 0 => Ok(Self {
                before: text[..at].into(),
                digits,
                after: text[at + digits..].into(),
            }),
            _ => bail!("{shown}: a sequence needs one place for the number of the frame, such as frame_####.png"),
        }
    }

    fn file(&self, number: usize) -> PathBuf {
        format!("{}{number:0width$}{}", self.before, self.after, width = self.digits).into()
    }
}

/// Renders and writes frame by frame.
///
/// # Errors
/// Settings out of range; files that cannot be written.
pub(super) fn run(
    args: &RenderArgs,
    format: Format,
    settings: &Settings,
    loaded: Loaded,
    sequence: &Sequence,
) -> Result<Status> {
    const DEFAULT_SPP: u64 = 64;
    let Some((first, _)) = sequence.frames.first() else {
        return Ok(Status::Done);
    };
    let back_end = BackEnd::open(args.light.one_backend()?)?;
    let (scene, origin) = loaded.give();
    let mut renderer = back_end.start(scene, first, settings)?;
    let budget = Budget::new(&args.budget, DEFAULT_SPP).until(args.target_error, &args.budget);
    // By the first frame, if none is asked for: a film whose exposure jumps from picture to picture flickers.
    let mut exposure = args.exposure;
    let count = sequence.frames.len();
    for (number, (camera, file)) in (1..).zip(&sequence.frames) {
        let watch = Watch::rendering();
        renderer.set_camera(camera);
        let what = format!("frame {number} of {count}");
        session::render_frames(renderer.as_mut(), budget, &watch, &what, |_| {})?;
        let interrupted = watch.writing();
        let film = renderer.film();
        let exposure = *exposure.get_or_insert_with(|| image::auto_exposure(&film.image()));
        let stats = Stats::new(
            renderer.as_ref(),
            &renderer.stats(),
            &origin,
            &camera.name,
            settings,
            interrupted,
            &back_end,
        );
        let made = Made {
            film,
            scene: renderer.scene(),
            stats: &stats,
            settings,
        };
        file::write(file, format, &args.aov, exposure, &made)?;
        message::note(format!(
            "{}: {} spp, frame {number} of {count}",
            file.display(),
            film.spp()
        ));
        if interrupted {
            return Ok(Status::Interrupted);
        }
    }
    Ok(Status::Done)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_number_of_the_frame_takes_the_place_of_the_hashes() {
        let file = |name: &str, number| Numbered::new(Path::new(name)).map(|name| name.file(number));
        assert_eq!(file("walk/f_####.png", 7).expect("valid"), Path::new("walk/f_0007.png"));
        assert_eq!(file("#.exr", 123).expect("valid"), Path::new("123.exr"));
        for odd in ["f.png", "f_#_#.png", ""] {
            let text = file(odd, 1).expect_err(odd).to_string();
            assert!(text.contains("frame_####.png"), "{text}");
        }
    }
}
