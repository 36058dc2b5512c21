//! Frames on the device, and learning from them.

use super::count::CountPass;
use super::device::Gpu;
use super::layout::FrameParams;
use super::lessons::{LessonPasses, read_all};
use super::path_pass::PathPass;
use super::refusal;
use super::target::{DeviceFilm, Target};
use super::timing::{Pass, PassTime, Timer};
use crate::direct::OneLight;
use crate::frame::{Drawn, Eye, Frames};
use crate::path::{Counters, sequence_since};
use crate::{Film, RenderError, Settings};
use ::scene::Scene;
use light_cache::{CellRecord, LightRecord, LightSampler, SamplerStats, ShadingPoint, Thinning};
use std::cell::OnceCell;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// Frames with one light per vertex, rendered on the device.
pub(super) struct GpuFrames<S> {
    gpu: Arc<Gpu>,
    /// The sampler, and what it has of the CPU's frames.
    drawn: Drawn<OneLight<S>>,
    pass: PathPass,
    /// `None` for samplers that do not learn.
    lesson_passes: Option<LessonPasses>,
    target: Option<Target>,
    /// The last frame: no more than one is under way while the next is prepared.
    submitted: Option<wgpu::SubmissionIndex>,
    timer: Option<Timer>,
    /// [`FrameParams::controls`] of the next frame.
    controls: u32,
    /// Counts of films that are gone.
    counted: Counters,
    /// What the device has accumulated, since somebody asked.
    film: OnceCell<(Film, Counters)>,
    /// What its pixels have counted, likewise.
    counts: OnceCell<Counters>,
    /// Once somebody has made do without the film; `None` in it: the device is lost.
    count_pass: OnceCell<Option<CountPass>>,
    failure: Option<RenderError>,
}

impl<S: LightSampler> GpuFrames<S> {
    /// Uploads scene and sampler and compiles the shader.
    ///
    /// # Errors
    /// A sampler that only the CPU has, a scene that does not fit.
    pub(super) fn new(gpu: Arc<Gpu>, scene: &Scene, sampler: S, settings: &Settings) -> Result<Self, RenderError> {
        let Some(packed) = sampler.pack() else {
            return Err(refusal(format!("the sampler '{}'", settings.method.name())));
        };
        let pass = PathPass::new(&gpu, scene, &sampler, &packed, settings)?;
        let lesson_passes = S::LEARNS.then(|| LessonPasses::new(&gpu)).transpose()?;
        let frames = Self {
            drawn: Drawn::new(OneLight(sampler)),
            gpu,
            pass,
            lesson_passes,
            target: None,
            submitted: None,
            timer: None,
            controls: FrameParams::CONTROLS_NEW,
            counted: Counters::default(),
            film: OnceCell::new(),
            counts: OnceCell::new(),
            count_pass: OnceCell::new(),
            failure: None,
        };
        match frames.gpu.error() {
            Some(error) => Err(error),
            None => Ok(frames),
        }
    }

    /// Makes room for what the coming frames write, if it is not there.
    fn make_room(&mut self, eye: &Eye<'_>, film: &Film) -> Result<(), RenderError> {
        let slots = if S::LEARNS {
            eye.light_samples + eye.max_bounces
        } else {
            0
        };
        let size = [eye.image_width, eye.image_height, slots];
        let aovs = film.has_aovs();
        if self.target.as_ref().is_some_and(|target| target.is_for(size, aovs)) {
            return Ok(());
        }
        self.counted = Frames::counters(self, film);
        self.accumulated();
        // What the sampler has not learned from yet is not lost.
        let before = self.target.take().and_then(|target| target.lessons);
        let kept = before.map_or_else(Vec::new, |lessons| lessons.into_kept(&self.gpu));
        self.pass.set_aovs(&self.gpu, aovs)?;
        let mut target = Target::new(&self.gpu, &self.pass, self.lesson_passes.as_ref(), size, aovs)?;
        if let Some(lessons) = &mut target.lessons {
            lessons.go_on_with(kept);
        }
        self.target = Some(target);
        Ok(())
    }

    /// Submits a frame, and waits for the one before.
    fn dispatch(
        &mut self,
        target: &mut Target,
        eye: &Eye<'_>,
        film: &Film,
        weight: f32,
        thinning: Option<&Thinning>,
    ) -> bool {
        let (seed, frame) = sequence_since(eye.seed, eye.frame, self.drawn.first_frame);
        let camera = &eye.camera;
        let params = FrameParams {
            origin_ws: camera.origin_ws.to_array(),
            width: eye.image_width,
            corner_ws: camera.corner_ws.to_array(),
            height: eye.image_height,
            step_x_ws: camera.step_x_ws.to_array(),
            frame,
            step_y_ws: camera.step_y_ws.to_array(),
            weight,
            seed: [seed as u32, (seed >> 32) as u32],
            max_bounces: eye.max_bounces,
            light_samples: eye.light_samples,
            clear: u32::from(film.spp() == 0),
            candidates: eye.candidates,
            slots: target.size[2],
            controls: std::mem::take(&mut self.controls),
        };
        self.gpu
            .queue
            .write_buffer(&self.pass.params, 0, bytemuck::bytes_of(&params));
        let mut encoder = self
            .gpu
            .device
            .create_command_encoder(&wgpu::CommandEncoderDescriptor { label: Some("path") });
        {
            let mut pass = Pass::Path.begin(&mut encoder, self.timer.as_ref());
            self.pass
                .encode(&mut pass, &target.group, eye.image_width, eye.image_height);
        }
        let mut passes = &[Pass::Path][..];
        if let (Some(thinning), Some(lessons), Some(pipelines)) = (thinning, &mut target.lessons, &self.lesson_passes) {
            lessons.encode(&self.gpu, pipelines, &mut encoder, thinning, self.timer.as_ref());
            passes = &[Pass::Path, Pass::Tally, Pass::Thin];
        }
        if let Some(timer) = &self.timer {
            timer.resolve(&mut encoder, passes);
        }
        let before = self.submitted.replace(self.gpu.queue.submit([encoder.finish()]));
        if let Some(timer) = &mut self.timer {
            timer.note(&self.gpu, passes);
        }
        before.is_none_or(|before| self.gpu.wait_for(before)) && self.gpu.error().is_none()
    }

    /// Lets the sampler learn from a frame, or at the end of some frames from all of them, and uploads what it draws from then on.
    fn learn(&mut self, target: &mut Target, eye: &Eye<'_>, thinning: Option<&Thinning>) -> Result<(), RenderError> {
        let learned = if let (Some(thinning), Some(lessons)) = (thinning, &mut target.lessons) {
            let Some(kept) = lessons.end_frame(&self.gpu, thinning) else {
                return Err(self.lost());
            };
            self.drawn
                .learn_by(eye.frame, |direct, _| direct.0.end_thinned_frame(&eye.scene, kept))
        } else {
            let Some(observations) = read_all(&self.gpu, &target.observations, target.size) else {
                return Err(self.lost());
            };
            self.drawn.observations = observations;
            self.drawn.learn(&eye.scene, eye.frame)
        };
        if learned {
            self.controls = FrameParams::CONTROLS_LEARN;
            self.upload_sampler()?;
        }
        Ok(())
    }

    fn upload_sampler(&mut self) -> Result<(), RenderError> {
        match self.drawn.direct.0.pack() {
            Some(packed) => self.pass.set_sampler(&self.gpu, &packed),
            None => Ok(()),
        }
    }

    /// Why nothing goes on.
    fn lost(&self) -> RenderError {
        self.gpu.error().unwrap_or_else(|| self.gpu.gone())
    }

    /// What was read is no longer all.
    fn accumulated(&mut self) {
        (self.film, self.counts) = (OnceCell::new(), OnceCell::new());
    }

    /// What the device has accumulated, read once after every frame; `film` has the frames' number and weights.
    fn read_once(&self, film: &Film) -> &(Film, Counters) {
        self.film.get_or_init(|| match &self.target {
            Some(target) => target.read(&self.gpu, film),
            None => (film.clone(), Counters::default()),
        })
    }
}

/// State is not told, for the film is on the device, nor what choosing costs there.
impl<S: LightSampler> Frames for GpuFrames<S> {
    fn look(&mut self, eye: &Eye<'_>, film: &mut Film) {
        self.drawn.direct.0.set_eye(eye.camera.origin_ws);
        self.controls = FrameParams::CONTROLS_NEW;
        if let Err(error) = self.make_room(eye, film) {
            self.failure = Some(error);
        }
    }

    fn render<const AOVS: bool>(&mut self, eye: &mut Eye<'_>, film: &mut Film, stop: &AtomicBool) -> (Counters, bool) {
        let nothing = (Counters::default(), false);
        if stop.load(Ordering::Relaxed) || self.failure.is_some() {
            return nothing;
        }
        let Some(mut target) = self.target.take() else {
            return nothing;
        };
        let sampler = &self.drawn.direct.0;
        let weight = sampler.pace().frame_weight;
        let thinning = if S::LEARNS { sampler.thinning() } else { None };
        film.set_weight(weight);
        let result = if !self.dispatch(&mut target, eye, film, weight, thinning.as_ref()) {
            Err(self.lost())
        } else if S::LEARNS {
            self.learn(&mut target, eye, thinning.as_ref())
        } else {
            Ok(())
        };
        self.target = Some(target);
        self.accumulated();
        self.failure = result.err();
        (Counters::default(), self.failure.is_none())
    }

    fn scene_changed(&mut self, scene: &Scene) {
        self.drawn.scene_changed(scene);
        let uploaded = self.pass.set_scene(&self.gpu, scene);
        if let Some(target) = &mut self.target {
            target.bind(&self.gpu, &self.pass);
        }
        if let Err(error) = uploaded.and_then(|()| self.upload_sampler()) {
            self.failure = Some(error);
        }
    }

    fn film<'f>(&'f self, film: &'f Film) -> &'f Film {
        // The device clears what it has with the next frame.
        if film.spp() == 0 {
            return film;
        }
        &self.read_once(film).0
    }

    fn counters(&self, film: &Film) -> Counters {
        let of_target = match (self.film.get(), self.count_pass.get(), &self.target) {
            (None, Some(Some(pass)), Some(target)) => {
                *(self.counts).get_or_init(|| pass.run(&self.gpu, &target.film).unwrap_or_default())
            }
            _ => self.read_once(film).1,
        };
        self.counted + of_target
    }

    fn device_film(&self, film: &Film) -> Option<DeviceFilm<'_>> {
        // The device clears what it has with the next frame.
        if film.spp() == 0 {
            return None;
        }
        self.count_pass.get_or_init(|| CountPass::new(&self.gpu).ok());
        Some(self.target.as_ref()?.on_device(&self.gpu, film))
    }

    fn error(&self) -> Option<RenderError> {
        self.failure.clone()
    }

    fn wait(&mut self) {
        if !self.gpu.wait() && self.failure.is_none() {
            self.failure = Some(self.lost());
        }
    }

    fn time_passes(&mut self) -> bool {
        self.timer = Timer::new(&self.gpu);
        self.timer.is_some()
    }

    fn pass_times(&self) -> Vec<PassTime> {
        self.timer.as_ref().map_or_else(Vec::new, Timer::times)
    }

    fn sampler_stats(&self) -> Option<SamplerStats> {
        self.drawn.sampler_stats()
    }

    fn light_records(&self, scene: &Scene) -> Vec<LightRecord> {
        self.drawn.light_records(scene)
    }

    fn cells(&self, scene: &Scene) -> Vec<CellRecord> {
        self.drawn.cells(scene)
    }

    fn light_probabilities(&self, scene: &Scene, points: &[ShadingPoint]) -> Vec<f64> {
        self.drawn.light_probabilities(scene, points)
    }

    fn cells_at(&self, points: &[ShadingPoint]) -> Vec<Option<u64>> {
        self.drawn.cells_at(points)
    }
}
