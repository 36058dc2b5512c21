//! Frames on the device, and learning from them.

use super::buffers::{read, storage, uniform, written};
use super::device::Gpu;
use super::layout::{FilmPixel, FrameParams, PackedObservation};
use super::lessons::{LessonPasses, Lessons, read_all};
use super::scene::SceneBuffers;
use super::timing::{Pass, PassTime, Timer};
use super::{refusal, shader};
use crate::choosing::Choosing;
use crate::direct::OneLight;
use crate::frame::{Drawn, Eye, Frames};
use crate::path::{Counters, sequence_since};
use crate::{Film, Method, RenderError, Settings};
use ::scene::Scene;
use light_cache::{CellRecord, LightRecord, LightSampler, Packed, SamplerStats, ShadingPoint, Thinning};
use std::cell::OnceCell;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// Side of a workgroup of `path.wgsl`.
const GROUP: u32 = 8;

/// Frames with one light per vertex, rendered on the device.
pub(super) struct GpuFrames<S> {
    gpu: Arc<Gpu>,
    /// The sampler, and what it has of the CPU's frames.
    drawn: Drawn<OneLight<S>>,
    pipeline: wgpu::ComputePipeline,
    /// `None` for samplers that do not learn.
    lesson_passes: Option<LessonPasses>,
    params: wgpu::Buffer,
    frame_group: wgpu::BindGroup,
    scene_group: wgpu::BindGroup,
    cache: wgpu::Buffer,
    cache_group: wgpu::BindGroup,
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
    failure: Option<RenderError>,
}

/// What a frame of one size writes.
struct Target {
    pixels: u64,
    film: wgpu::Buffer,
    observations: wgpu::Buffer,
    group: wgpu::BindGroup,
    /// Columns, rows, and observations that a pixel has room for.
    size: [u32; 3],
    lessons: Option<Lessons>,
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
        let buffers = SceneBuffers::new(&gpu, scene)?;
        let pipeline = compile(&gpu, &sampler, &packed, &buffers, settings)?;
        let lesson_passes = S::LEARNS.then(|| LessonPasses::new(&gpu)).transpose()?;
        gpu.keep_pipelines();
        let params = uniform(&gpu, "frame", bytemuck::bytes_of(&FrameParams::default()));
        let sobol = uniform(
            &gpu,
            "sobol rows",
            bytemuck::cast_slice(sampling::sobol::reversed_rows()),
        );
        let cache = storage(&gpu, "light sampler", bytemuck::cast_slice(&packed.words))?;
        let frames = Self {
            frame_group: group(&gpu, &pipeline, 0, &[(0, &params), (1, &sobol)]),
            scene_group: group(&gpu, &pipeline, 1, &buffers.bindings()),
            cache_group: group(&gpu, &pipeline, 2, &[(0, &cache)]),
            drawn: Drawn::new(OneLight(sampler)),
            gpu,
            pipeline,
            lesson_passes,
            params,
            cache,
            target: None,
            submitted: None,
            timer: None,
            controls: FrameParams::CONTROLS_NEW,
            counted: Counters::default(),
            film: OnceCell::new(),
            failure: None,
        };
        match frames.gpu.error() {
            Some(error) => Err(error),
            None => Ok(frames),
        }
    }

    /// Makes room for what frames of this size write, if it is not there.
    fn target(&self, eye: &Eye<'_>, pixels: u64) -> Result<Target, RenderError> {
        let slots = if S::LEARNS {
            eye.light_samples + eye.max_bounces
        } else {
            0
        };
        let film = written(&self.gpu, "film", pixels * size_of::<FilmPixel>() as u64)?;
        let observations = written(
            &self.gpu,
            "observations of a frame",
            pixels * u64::from(slots) * size_of::<PackedObservation>() as u64,
        )?;
        let group = group(&self.gpu, &self.pipeline, 3, &[(0, &film), (1, &observations)]);
        let size = [eye.image_width, eye.image_height, slots];
        let lessons = match &self.lesson_passes {
            Some(passes) => Some(Lessons::new(&self.gpu, passes, &self.params, &observations, size)?),
            None => None,
        };
        Ok(Target {
            pixels,
            film,
            observations,
            group,
            size,
            lessons,
        })
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
            .write_buffer(&self.params, 0, bytemuck::bytes_of(&params));
        let mut encoder = self
            .gpu
            .device
            .create_command_encoder(&wgpu::CommandEncoderDescriptor { label: Some("path") });
        {
            let mut pass = Pass::Path.begin(&mut encoder, self.timer.as_ref());
            pass.set_pipeline(&self.pipeline);
            for (index, group) in [&self.frame_group, &self.scene_group, &self.cache_group, &target.group]
                .into_iter()
                .enumerate()
            {
                pass.set_bind_group(index as u32, group, &[]);
            }
            pass.dispatch_workgroups(eye.image_width.div_ceil(GROUP), eye.image_height.div_ceil(GROUP), 1);
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
        let Some(packed) = self.drawn.direct.0.pack() else {
            return Ok(());
        };
        let bytes: &[u8] = bytemuck::cast_slice(&packed.words);
        if bytes.len() as u64 <= self.cache.size() {
            self.gpu.queue.write_buffer(&self.cache, 0, bytes);
        } else {
            self.cache = storage(&self.gpu, "light sampler", bytes)?;
            self.cache_group = group(&self.gpu, &self.pipeline, 2, &[(0, &self.cache)]);
        }
        Ok(())
    }

    /// Why nothing goes on.
    fn lost(&self) -> RenderError {
        self.gpu.error().unwrap_or_else(|| self.gpu.gone())
    }

    /// [`GpuFrames::read_film`], once after every frame.
    fn read_once(&self, film: &Film) -> &(Film, Counters) {
        self.film.get_or_init(|| self.read_film(film))
    }

    /// What the device has accumulated; `film` has the frames' number and weights.
    fn read_film(&self, film: &Film) -> (Film, Counters) {
        let mut read_back = film.clone();
        let mut counters = Counters::default();
        if let Some(target) = &self.target {
            read(&self.gpu, &target.film, |bytes| {
                let pixels: &[FilmPixel] = bytemuck::cast_slice(bytes);
                if film.spp() > 0 {
                    read_back.load(|pixel| (pixels[pixel].sums(), pixels[pixel].count, pixels[pixel].weight()));
                }
                for pixel in pixels {
                    counters.rays_nearest += u64::from(pixel.rays_nearest);
                    counters.rays_occluded += u64::from(pixel.rays_occluded);
                    counters.nonfinite += u64::from(pixel.nonfinite);
                }
            });
        }
        (read_back, counters)
    }
}

/// The bind group `index` of `pipeline`: buffers by their bindings.
pub(super) fn group(
    gpu: &Gpu,
    pipeline: &wgpu::ComputePipeline,
    index: u32,
    buffers: &[(u32, &wgpu::Buffer)],
) -> wgpu::BindGroup {
    let entries: Vec<_> = buffers
        .iter()
        .map(|&(binding, buffer)| wgpu::BindGroupEntry {
            binding,
            resource: buffer.as_entire_binding(),
        })
        .collect();
    gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
        label: None,
        layout: &pipeline.get_bind_group_layout(index),
        entries: &entries,
    })
}

/// The path pass, specialised to scene, sampler and settings.
fn compile<S: LightSampler>(
    gpu: &Gpu,
    sampler: &S,
    packed: &Packed,
    scene: &SceneBuffers,
    settings: &Settings,
) -> Result<wgpu::ComputePipeline, RenderError> {
    let text = shader::pass("path", packed.scheme)?;
    let resamples = matches!(settings.method, Method::Sampled(_)) && settings.candidates > 1;
    let heuristic = settings.mis.heuristic().map_or(4, |heuristic| heuristic as u32);
    let mut constants: Vec<(&str, f64)> = vec![
        ("LEARNS", f64::from(u8::from(S::LEARNS))),
        ("CONTROLLED", f64::from(u8::from(sampler.is_controlled()))),
        ("RESAMPLES", f64::from(u8::from(resamples))),
        ("HEURISTIC", f64::from(heuristic)),
    ];
    constants.extend(scene.switches.iter().map(|&(name, on)| (name, f64::from(u8::from(on)))));
    gpu.compile("path", &text, &constants)
}

impl<S: LightSampler> Frames for GpuFrames<S> {
    fn look(&mut self, eye: &Eye<'_>, film: &mut Film) {
        self.drawn.direct.0.set_eye(eye.camera.origin_ws);
        self.controls = FrameParams::CONTROLS_NEW;
        let pixels = u64::from(eye.image_width) * u64::from(eye.image_height);
        if self.target.as_ref().is_some_and(|target| target.pixels == pixels) {
            return;
        }
        self.counted = Frames::counters(self, film);
        self.film = OnceCell::new();
        match self.target(eye, pixels) {
            Ok(target) => self.target = Some(target),
            Err(error) => self.failure = Some(error),
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
        self.film = OnceCell::new();
        self.failure = result.err();
        (Counters::default(), self.failure.is_none())
    }

    fn scene_changed(&mut self, scene: &Scene) {
        self.drawn.scene_changed(scene);
        let uploaded = SceneBuffers::new(&self.gpu, scene).and_then(|buffers| {
            self.scene_group = group(&self.gpu, &self.pipeline, 1, &buffers.bindings());
            self.upload_sampler()
        });
        if let Err(error) = uploaded {
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
        self.counted + self.read_once(film).1
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

    fn prepare_s(&self) -> f64 {
        0.0
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

    /// The film is on the device: no state is told.
    fn save(&self) -> Option<(u32, Vec<u8>)> {
        None
    }

    fn restore(&mut self, _first_frame: u32, _learned: &[u8]) -> bool {
        false
    }

    /// Not measured on the device.
    fn choosing(&self, _eye: &Eye<'_>) -> Option<Choosing> {
        None
    }
}
