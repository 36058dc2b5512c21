//! Finding a device, and telling clearly why there is none.

use super::pipelines::{Compiled, PipelineFile};
use crate::RenderError;
use crate::error::GpuFault;
use std::path::Path;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use wgpu::Features;

/// What to do where no adapter is found.
const NO_ADAPTER: &str =
    "install a Vulkan driver (Linux: mesa-vulkan-drivers has one for processors), or render with --backend cpu";

/// Storage buffers that the path pass binds when it makes auxiliary images: one more than by default.
const BUFFERS_WITH_AOVS: u32 = 9;

/// An adapter that this machine has.
#[derive(Clone, Debug, serde::Serialize)]
pub struct AdapterInfo {
    /// Its name.
    pub name: String,
    /// The interface: "vulkan", "metal", "dx12" or "gl".
    pub backend: String,
    /// The kind: "DiscreteGpu", "IntegratedGpu", "Cpu" and so on.
    pub kind: String,
    /// The driver and its version, as far as it tells.
    pub driver: String,
}

impl From<wgpu::AdapterInfo> for AdapterInfo {
    fn from(info: wgpu::AdapterInfo) -> Self {
        Self {
            name: info.name,
            backend: info.backend.to_str().into(),
            kind: format!("{:?}", info.device_type),
            driver: format!("{} {}", info.driver, info.driver_info).trim().into(),
        }
    }
}

impl std::fmt::Display for AdapterInfo {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{} ({}, {})", self.name, self.backend, self.driver)
    }
}

fn instance() -> wgpu::Instance {
    wgpu::Instance::new(wgpu::InstanceDescriptor::new_without_display_handle_from_env())
}

/// All adapters of this machine.
pub fn adapters() -> Vec<AdapterInfo> {
    let found = pollster::block_on(instance().enumerate_adapters(wgpu::Backends::all()));
    found.iter().map(|adapter| adapter.get_info().into()).collect()
}

/// An open device.
#[derive(Debug)]
pub struct Gpu {
    pub(crate) device: wgpu::Device,
    pub(crate) queue: wgpu::Queue,
    info: AdapterInfo,
    pub(super) pipelines: Option<PipelineFile>,
    pub(super) compiled: Compiled,
    /// See [`Gpu::bytes_read`].
    pub(super) read: AtomicU64,
    /// What has gone wrong since, the first of it.
    fault: Arc<Mutex<Option<GpuFault>>>,
}

impl Gpu {
    /// Opens the adapter that wgpu prefers; the variables WGPU_BACKEND and WGPU_ADAPTER_NAME are heeded.
    ///
    /// # Errors
    /// [`RenderError::Gpu`] with [`GpuFault::NoAdapter`] if there is none, or none that can do it.
    pub fn open() -> Result<Arc<Self>, RenderError> {
        Self::open_with(None)
    }

    /// [`Gpu::open`]; compiled shaders are kept in `folder`, where the driver can.
    ///
    /// # Errors
    /// Those of [`Gpu::open`].
    pub fn open_with(folder: Option<&Path>) -> Result<Arc<Self>, RenderError> {
        let refuse = |what: String| GpuFault::NoAdapter.error(format!("{what}; {NO_ADAPTER}"));
        let instance = instance();
        let adapter = match pollster::block_on(wgpu::util::initialize_adapter_from_env(&instance, None)) {
            Ok(adapter) => adapter,
            Err(_) => pollster::block_on(instance.request_adapter(&wgpu::RequestAdapterOptions {
                power_preference: wgpu::PowerPreference::HighPerformance,
                ..Default::default()
            }))
            .map_err(|error| refuse(format!("no GPU was found ({error})")))?,
        };
        let info = adapter.get_info();
        let has = adapter.limits();
        // Of the limits only those that let larger scenes in, and auxiliary images, are raised.
        let default = wgpu::Limits::default();
        let buffers = has.max_storage_buffers_per_shader_stage.min(BUFFERS_WITH_AOVS);
        let limits = wgpu::Limits {
            max_storage_buffers_per_shader_stage: buffers.max(default.max_storage_buffers_per_shader_stage),
            max_storage_buffer_binding_size: has.max_storage_buffer_binding_size,
            max_buffer_size: has.max_buffer_size,
            ..default
        };
        let (device, queue) = pollster::block_on(adapter.request_device(&wgpu::DeviceDescriptor {
            label: Some("render"),
            required_limits: limits,
            // Both are done without where they lack.
            required_features: adapter.features() & (Features::TIMESTAMP_QUERY | Features::PIPELINE_CACHE),
            ..Default::default()
        }))
        .map_err(|error| refuse(format!("{} cannot be used ({error})", info.name)))?;
        let fault = Arc::new(Mutex::new(None));
        let (lost, failed) = (fault.clone(), fault.clone());
        device.set_device_lost_callback(move |_, why| note(&lost, GpuFault::Lost(why)));
        device.on_uncaptured_error(Arc::new(move |error: wgpu::Error| {
            note(
                &failed,
                match error {
                    wgpu::Error::OutOfMemory { .. } => GpuFault::OutOfMemory,
                    other => GpuFault::Lost(other.to_string()),
                },
            );
        }));
        let pipelines = folder.and_then(|folder| PipelineFile::open(&device, &info, folder));
        Ok(Arc::new(Self {
            device,
            queue,
            info: info.into(),
            pipelines,
            compiled: Compiled::default(),
            read: AtomicU64::new(0),
            fault,
        }))
    }

    /// Which adapter it is.
    pub fn info(&self) -> &AdapterInfo {
        &self.info
    }

    /// Bytes that were copied from the device to the processor since it was opened.
    pub fn bytes_read(&self) -> u64 {
        self.read.load(Ordering::Relaxed)
    }

    /// Whether it binds as many buffers at a time as auxiliary images need.
    pub(super) fn binds_aovs(&self) -> bool {
        self.device.limits().max_storage_buffers_per_shader_stage >= BUFFERS_WITH_AOVS
    }

    /// Gives the device up, as if it had been taken away: everything that renders on it fails from now on.
    pub fn destroy(&self) {
        self.device.destroy();
        note(&self.fault, GpuFault::Lost("it was destroyed".into()));
    }

    /// What has gone wrong, if anything has.
    pub fn error(&self) -> Option<RenderError> {
        let fault = self.fault.lock().unwrap_or_else(PoisonError::into_inner).clone()?;
        let what = match &fault {
            GpuFault::OutOfMemory => format!(
                "{} is out of memory; render a smaller image, or use --backend cpu",
                self.info
            ),
            GpuFault::Lost(why) => format!("{} was lost ({why}); try again, or use --backend cpu", self.info),
            GpuFault::NoAdapter => NO_ADAPTER.into(),
        };
        Some(fault.error(what))
    }

    /// What is told of a device that gives no results without saying why.
    pub(crate) fn gone(&self) -> RenderError {
        let what = format!("{} gives no results; try again, or use --backend cpu", self.info);
        GpuFault::Lost(String::new()).error(what)
    }

    /// Waits until everything that was submitted is done; false if the device is lost.
    pub(crate) fn wait(&self) -> bool {
        let done = self.device.poll(wgpu::PollType::wait_indefinitely());
        if let Err(error) = done {
            note(&self.fault, GpuFault::Lost(error.to_string()));
        }
        self.error().is_none()
    }

    /// Waits until `submission` is done; false if the device is lost.
    pub(super) fn wait_for(&self, submission: wgpu::SubmissionIndex) -> bool {
        let done = self.device.poll(wgpu::PollType::Wait {
            submission_index: Some(submission),
            timeout: None,
        });
        if let Err(error) = done {
            note(&self.fault, GpuFault::Lost(error.to_string()));
        }
        self.error().is_none()
    }

    /// Why a binding of so many bytes is impossible, if it is.
    pub(crate) fn refuses(&self, what: &str, bytes: u64) -> Option<RenderError> {
        let limits = self.device.limits();
        let most = limits.max_storage_buffer_binding_size.min(limits.max_buffer_size);
        (bytes > most).then(|| {
            let mib = |bytes: u64| bytes.div_ceil(1 << 20);
            GpuFault::OutOfMemory.error(format!(
                "{what}: {} MiB, and {} takes {} MiB at a time; use --backend cpu",
                mib(bytes),
                self.info,
                mib(most)
            ))
        })
    }
}

/// Keeps the first fault: what comes after it follows from it.
fn note(place: &Mutex<Option<GpuFault>>, fault: GpuFault) {
    place
        .lock()
        .unwrap_or_else(PoisonError::into_inner)
        .get_or_insert(fault);
}
