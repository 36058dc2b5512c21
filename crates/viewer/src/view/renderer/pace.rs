//! How much is rendered at once, and in which size: the frame time while the picture moves, all of it once it rests.

use super::stage::Stage;
use super::{Report, Worker};
use render::RenderError;
use std::time::{Duration, Instant};

/// The picture is moving until the camera has rested for so long.
pub(super) const REST: Duration = Duration::from_millis(150);
/// Least time between two pictures of the same view in full size: they differ little, and uploading takes time.
const BETWEEN_REFINEMENTS: Duration = Duration::from_millis(120);

impl Worker {
    /// The size that the film should get, if it has another.
    pub(super) fn size(&self, stage: &Stage) -> Option<(u32, u32)> {
        let now = stage.frames.size();
        let wanted = if stage.changed.elapsed() >= REST {
            self.window
        } else if stage.frames.spp() == 0 {
            self.resolution.clone().moving_size(self.window)
        } else {
            now
        };
        (wanted != now).then_some(wanted)
    }

    /// One picture, or as much of it as the time allows, top to bottom.
    pub(super) fn render(&mut self) {
        let still = self.stage.as_ref().is_some_and(|stage| stage.changed.elapsed() >= REST);
        let size = self.stage.as_ref().and_then(|stage| self.size(stage));
        let aovs = self.needs_aovs();
        // Keeps the scale that it has decided on.
        self.resolution.moving_size(self.window);
        let Some(stage) = &mut self.stage else { return };
        if let Some((width, height)) = size
            && let Err(error) = stage.frames.set_film(width, height, aovs)
        {
            (self.tell)(Report::Trouble(error.to_string()));
            self.paused = true;
            return;
        }

        let start = Instant::now();
        let (width, height) = stage.frames.size();
        let pixels = u64::from(width) * u64::from(height);
        let count = self.resolution.frames_in_budget(pixels);
        for _ in 0..count {
            if still {
                // A frame that is not finished was stopped, or the device has failed.
                if !stage.frames.render_frame_unless(&self.stop) {
                    if stage.frames.error().is_none() {
                        return;
                    }
                    break;
                }
            } else {
                stage.frames.render_frame();
            }
        }
        stage.frames.wait();
        let error = stage.frames.error();
        if let Some(RenderError::Scene(text)) = error {
            // Beginning anew would not mend the file: told once, and shown without what is missing.
            if !std::mem::replace(&mut stage.incomplete, true) {
                (self.tell)(Report::Trouble(text));
            }
        } else if let Some(error) = error {
            self.go_on_without_device(&error);
            return;
        }
        let seconds = start.elapsed().as_secs_f64();
        stage.seconds = seconds;
        let learn_s = stage.frames.sampler_stats().map_or(0.0, |sampler| sampler.learn_s);
        stage.learned = [learn_s, learn_s - stage.learned[0]];

        // Making a picture of what was rendered is to take a third of the time at most.
        let between = BETWEEN_REFINEMENTS.max(stage.showing * 2);
        let due = stage.published.is_none_or(|at| at.elapsed() >= between);
        if due || !still || stage.frames.spp() <= 2 {
            self.publish();
        }
        // What is done to the picture for the eyes counts while it moves: then it is done for every frame.
        let seconds = if still { seconds } else { start.elapsed().as_secs_f64() };
        self.resolution.measured(pixels * u64::from(count), seconds * 1e3);
        self.tell_importance();
    }
}
