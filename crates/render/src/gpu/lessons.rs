//! Observations on the device: thinned there after every frame, and read when an epoch is over.

use super::buffers::{read, read_start, uniform, written};
use super::device::Gpu;
use super::layout::{LessonCounters, LessonParams, PackedObservation, Run};
use super::path_pass::group;
use super::shader;
use super::timing::{Pass, Timer};
use crate::RenderError;
use crate::film::TILE_SIZE;
use light_cache::{Observation, Scheme, Thinning};

/// Most observations that the device keeps between two looks, 48 bytes each. Higher values are read less often; lower values need less
/// memory.
const MAX_KEPT: usize = 1 << 20;
/// Frames whose observations may be kept, all of them, if that is less.
const KEPT_FRAMES: usize = 16;

/// The passes that thin.
pub(super) struct LessonPasses {
    tally: wgpu::ComputePipeline,
    thin: wgpu::ComputePipeline,
}

impl LessonPasses {
    pub(super) fn new(gpu: &Gpu) -> Result<Self, RenderError> {
        // Whatever the sampler: these passes draw no lights.
        let pipeline = |pass: Pass| gpu.compile(pass.name(), &shader::pass(pass.name(), Scheme::Uniform, false)?, &[]);
        Ok(Self {
            tally: pipeline(Pass::Tally)?,
            thin: pipeline(Pass::Thin)?,
        })
    }
}

/// What the frames of one size have left to learn from.
pub(super) struct Lessons {
    /// Columns and rows of tiles.
    tiles: [u32; 2],
    /// Most observations of a frame.
    per_frame: usize,
    capacity: usize,
    params: wgpu::Buffer,
    counters: wgpu::Buffer,
    kept: wgpu::Buffer,
    runs: wgpu::Buffer,
    tally_groups: [wgpu::BindGroup; 2],
    thin_groups: [wgpu::BindGroup; 2],
    /// No more than these are on the device.
    waiting: usize,
    /// What was read of the epoch so far.
    collected: Vec<Vec<Observation>>,
}

impl Lessons {
    /// Room for frames of `width` x `height` with `slots` observations a pixel, which lie in `observations`.
    ///
    /// # Errors
    /// [`RenderError::Gpu`] if the device has too little room.
    pub(super) fn new(
        gpu: &Gpu,
        passes: &LessonPasses,
        frame: &wgpu::Buffer,
        observations: &wgpu::Buffer,
        [width, height, slots]: [u32; 3],
    ) -> Result<Self, RenderError> {
        let per_frame = width as usize * height as usize * slots as usize;
        let capacity = MAX_KEPT.min(KEPT_FRAMES * per_frame).max(1);
        let params = uniform(gpu, "lesson", bytemuck::bytes_of(&LessonParams::default()));
        let counters = written(gpu, "counters of observations", size_of::<LessonCounters>() as u64)?;
        let room = |what, size: usize| written(gpu, what, (capacity * size) as u64);
        let kept = room("observations kept", size_of::<PackedObservation>())?;
        let runs = room("runs of observations", size_of::<Run>())?;
        let (tally, thin) = (&passes.tally, &passes.thin);
        Ok(Self {
            tiles: [width.div_ceil(TILE_SIZE), height.div_ceil(TILE_SIZE)],
            per_frame,
            capacity,
            tally_groups: [
                group(gpu, tally, 0, &[(0, frame)]),
                group(gpu, tally, 3, &[(0, observations), (1, &counters)]),
            ],
            thin_groups: [
                group(gpu, thin, 0, &[(0, frame)]),
                group(
                    gpu,
                    thin,
                    3,
                    &[(0, observations), (1, &counters), (2, &params), (3, &kept), (4, &runs)],
                ),
            ],
            params,
            counters,
            kept,
            runs,
            waiting: 0,
            collected: Vec::new(),
        })
    }

    /// Adds the passes that thin a frame's observations.
    pub(super) fn encode(
        &mut self,
        gpu: &Gpu,
        passes: &LessonPasses,
        encoder: &mut wgpu::CommandEncoder,
        thinning: &Thinning,
        timer: Option<&Timer>,
    ) {
        if thinning.is_first {
            self.waiting = 0;
            self.collected.clear();
        }
        // The frame's own counter starts anew every time, the others when nothing waits.
        let stale = (self.waiting > 0).then_some(size_of::<u32>() as u64);
        encoder.clear_buffer(&self.counters, 0, stale);
        self.waiting += self.most_kept(thinning);
        let params = LessonParams {
            frame: thinning.frame,
            stride: thinning.stride,
            ..LessonParams::default()
        };
        gpu.queue.write_buffer(&self.params, 0, bytemuck::bytes_of(&params));
        let [columns, rows] = self.tiles;
        for (pass, pipeline, groups) in [
            (Pass::Tally, &passes.tally, &self.tally_groups),
            (Pass::Thin, &passes.thin, &self.thin_groups),
        ] {
            let mut pass = pass.begin(encoder, timer);
            pass.set_pipeline(pipeline);
            for (index, group) in [0, 3].into_iter().zip(groups) {
                pass.set_bind_group(index, group, &[]);
            }
            pass.dispatch_workgroups(columns, rows, 1);
        }
    }

    /// After a frame: what its epoch has left if it was the last one of it, or else nothing. `None` if the device is lost.
    pub(super) fn end_frame(&mut self, gpu: &Gpu, thinning: &Thinning) -> Option<Vec<Vec<Observation>>> {
        let next_may_not_fit = self.waiting + self.most_kept(thinning) > self.capacity;
        if thinning.is_last || next_may_not_fit {
            let kept = self.collect(gpu)?;
            self.collected.extend(kept);
        }
        if thinning.is_last {
            Some(std::mem::take(&mut self.collected))
        } else {
            Some(Vec::new())
        }
    }

    /// What was kept of the epoch so far; less of a device that is lost.
    pub(super) fn into_kept(mut self, gpu: &Gpu) -> Vec<Vec<Observation>> {
        if self.waiting > 0 {
            let waiting = self.collect(gpu);
            self.collected.extend(waiting.unwrap_or_default());
        }
        self.collected
    }

    /// Adds what was kept of the epoch so far, in frames of another size.
    pub(super) fn go_on_with(&mut self, kept: Vec<Vec<Observation>>) {
        self.collected = kept;
    }

    fn most_kept(&self, thinning: &Thinning) -> usize {
        thinning.most_kept().min(self.per_frame)
    }

    /// Reads what waits on the device, by frame and tile.
    fn collect(&mut self, gpu: &Gpu) -> Option<Vec<Vec<Observation>>> {
        let counters: LessonCounters = read(gpu, &self.counters, |bytes| {
            bytemuck::pod_read_unaligned(&bytes[..size_of::<LessonCounters>()])
        })?;
        self.waiting = 0;
        let bytes = |count: u32, size: usize| (count as usize).min(self.capacity) * size;
        let mut runs: Vec<Run> = read_start(gpu, &self.runs, bytes(counters.runs, size_of::<Run>()), |bytes| {
            bytemuck::cast_slice(bytes).to_vec()
        })?;
        runs.sort_unstable_by_key(|run| (run.frame, run.tile));
        let size = bytes(counters.kept, size_of::<PackedObservation>());
        read_start(gpu, &self.kept, size, |bytes| {
            let kept: &[PackedObservation] = bytemuck::cast_slice(bytes);
            let of_run = |run: &Run| {
                let all = kept.iter().skip(run.first as usize).take(run.count as usize);
                all.filter_map(|packed| packed.get(run.weight)).collect()
            };
            runs.iter().map(of_run).collect()
        })
    }
}

/// All observations of a frame, in the order in which the CPU's tiles write them down. `None` if the device is lost.
pub(super) fn read_all(
    gpu: &Gpu,
    observations: &wgpu::Buffer,
    [width, height, slots]: [u32; 3],
) -> Option<Vec<Vec<Observation>>> {
    let slots = slots as usize;
    let count = width as usize * height as usize * slots;
    read_start(gpu, observations, count * size_of::<PackedObservation>(), |bytes| {
        let all: &[PackedObservation] = bytemuck::cast_slice(bytes);
        let starts = |end: u32| (0..end).step_by(TILE_SIZE as usize);
        let tile = |x0: u32, y0: u32| {
            let rows = y0..(y0 + TILE_SIZE).min(height);
            let pixels = rows.flat_map(|y| (x0..(x0 + TILE_SIZE).min(width)).map(move |x| (y * width + x) as usize));
            pixels
                .flat_map(|pixel| &all[pixel * slots..(pixel + 1) * slots])
                .filter_map(|packed| packed.get(1))
                .collect()
        };
        starts(height)
            .flat_map(|y0| starts(width).map(move |x0| (x0, y0)))
            .map(|(x0, y0)| tile(x0, y0))
            .collect()
    })
}
