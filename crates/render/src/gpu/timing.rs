//! How long passes take on the device, by its own clock.

use super::buffers::read;
use super::device::Gpu;

/// A pass of a frame, or a stage of a picture for the eyes, which has several.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Pass {
    Path,
    Tally,
    Thin,
    History,
    Filter,
    Resolve,
}

impl Pass {
    const ALL: [Self; 6] = [
        Self::Path,
        Self::Tally,
        Self::Thin,
        Self::History,
        Self::Filter,
        Self::Resolve,
    ];

    /// The name of a pass's file and of its entry point, or of the stage.
    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Path => "path",
            Self::Tally => "tally",
            Self::Thin => "thin",
            Self::History => "history",
            Self::Filter => "filter",
            Self::Resolve => "resolve",
        }
    }

    /// Begins it, timed if there is a timer.
    pub(super) fn begin<'e>(
        self,
        encoder: &'e mut wgpu::CommandEncoder,
        timer: Option<&Timer>,
    ) -> wgpu::ComputePass<'e> {
        let first = 2 * self as u32;
        encoder.begin_compute_pass(&wgpu::ComputePassDescriptor {
            label: Some(self.name()),
            timestamp_writes: timer.map(|timer| wgpu::ComputePassTimestampWrites {
                query_set: &timer.queries,
                beginning_of_pass_write_index: Some(first),
                end_of_pass_write_index: Some(first + 1),
            }),
        })
    }
}

/// A beginning and an end each.
const QUERIES: u32 = 2 * Pass::ALL.len() as u32;

/// The time that one pass took.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct PassTime {
    /// Its name: that of its file in `shaders/pass`, or of the stage that it is part of.
    pub name: String,
    /// Frames in which it ran and was timed.
    pub frames: u64,
    /// Mean per frame.
    pub mean_ms: f64,
    /// Longest.
    pub max_ms: f64,
}

/// A clock for the passes of a frame or a picture. It is read after every one, which then cannot overlap the next.
#[derive(Debug)]
pub(super) struct Timer {
    queries: wgpu::QuerySet,
    ticks: wgpu::Buffer,
    ms_per_tick: f64,
    /// The first frame is left out: some drivers compile in it.
    is_first: bool,
    times: [PassTime; Pass::ALL.len()],
}

impl Timer {
    /// `None` where the device has no clock.
    pub(super) fn new(gpu: &Gpu) -> Option<Self> {
        if !gpu.device.features().contains(wgpu::Features::TIMESTAMP_QUERY) {
            return None;
        }
        Some(Self {
            queries: gpu.device.create_query_set(&wgpu::QuerySetDescriptor {
                label: Some("passes"),
                ty: wgpu::QueryType::Timestamp,
                count: QUERIES,
            }),
            ticks: gpu.device.create_buffer(&wgpu::BufferDescriptor {
                label: Some("timestamps"),
                size: u64::from(QUERIES) * wgpu::QUERY_SIZE as u64,
                usage: wgpu::BufferUsages::QUERY_RESOLVE | wgpu::BufferUsages::COPY_SRC,
                mapped_at_creation: false,
            }),
            ms_per_tick: f64::from(gpu.queue.get_timestamp_period()) * 1e-6,
            is_first: true,
            times: Pass::ALL.map(|pass| PassTime {
                name: pass.name().into(),
                frames: 0,
                mean_ms: 0.0,
                max_ms: 0.0,
            }),
        })
    }

    /// Adds to the end of a frame what makes its times readable; `passes` ran, which follow each other in [`Pass::ALL`].
    pub(super) fn resolve(&self, encoder: &mut wgpu::CommandEncoder, passes: &[Pass]) {
        let first = 2 * passes[0] as u32;
        let queries = first..first + 2 * passes.len() as u32;
        encoder.resolve_query_set(&self.queries, queries, &self.ticks, 0);
    }

    /// Takes note of a frame in which `passes` ran, as told to [`Timer::resolve`]. Returns their milliseconds; none if the device is lost.
    pub(super) fn note(&mut self, gpu: &Gpu, passes: &[Pass]) -> Vec<f64> {
        let ticks: Option<Vec<u64>> = read(gpu, &self.ticks, bytemuck::pod_collect_to_vec);
        let ms_of = |ticks: &[u64]| ticks[1].saturating_sub(ticks[0]) as f64 * self.ms_per_tick;
        let taken: Vec<f64> = (ticks.unwrap_or_default().chunks_exact(2).take(passes.len()))
            .map(ms_of)
            .collect();
        if std::mem::take(&mut self.is_first) {
            return taken;
        }
        for (pass, &ms) in passes.iter().zip(&taken) {
            let time = &mut self.times[*pass as usize];
            time.frames += 1;
            time.mean_ms += (ms - time.mean_ms) / time.frames as f64;
            time.max_ms = time.max_ms.max(ms);
        }
        taken
    }

    /// Of all passes that ran.
    pub(super) fn times(&self) -> Vec<PassTime> {
        self.times.iter().filter(|time| time.frames > 0).cloned().collect()
    }
}
