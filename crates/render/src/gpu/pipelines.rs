//! Compiled shaders, kept in a file from one start to the next where the driver can.

use super::device::Gpu;
use crate::RenderError;
use std::collections::HashMap;
use std::hash::{DefaultHasher, Hasher};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

/// What a file of ours begins with; another version of the program compiles anew.
const MAGIC: &[u8] = concat!("manylight pipelines ", env!("CARGO_PKG_VERSION"), "\n").as_bytes();

/// What was compiled since the start, by its text and its switches.
pub(super) type Compiled = Mutex<HashMap<(String, Vec<(String, u64)>), wgpu::ComputePipeline>>;

/// A driver's own cache of what it has compiled, and the file that it is kept in.
#[derive(Debug)]
pub(super) struct PipelineFile {
    path: PathBuf,
    cache: wgpu::PipelineCache,
}

impl PipelineFile {
    /// The cache of this adapter in `folder`, as full as it was left; `None` where the driver has none. A file that is damaged or of
    /// another version is taken for none.
    pub(super) fn open(device: &wgpu::Device, adapter: &wgpu::AdapterInfo, folder: &Path) -> Option<Self> {
        if !device.features().contains(wgpu::Features::PIPELINE_CACHE) {
            return None;
        }
        let path = folder.join(wgpu::util::pipeline_cache_key(adapter)?);
        let data = std::fs::read(&path)
            .ok()
            .and_then(|bytes| Some(contents(&bytes)?.to_vec()));
        let descriptor = wgpu::PipelineCacheDescriptor {
            label: Some("pipelines"),
            data: data.as_deref(),
            fallback: true,
        };
        #[allow(unsafe_code, reason = "wgpu trusts the caller with the origin of the data")]
        // SAFETY: the data come from `PipelineCache::get_data` by way of `save`, are whole (their hash is right), and wgpu checks that they are
        // of this adapter and driver.
        let cache = unsafe { device.create_pipeline_cache(&descriptor) };
        Some(Self { path, cache })
    }

    /// For those who compile.
    pub(super) fn cache(&self) -> &wgpu::PipelineCache {
        &self.cache
    }

    /// Keeps what has been compiled. That it cannot be written costs time only, at the next start.
    pub(super) fn save(&self) {
        let Some(data) = self.cache.get_data() else { return };
        if let Some(folder) = self.path.parent() {
            // If there is no folder writing fails too.
            let _ = std::fs::create_dir_all(folder);
        }
        let written: std::io::Result<()> = scene::file::write(&self.path, |out| {
            out.write_all(MAGIC)?;
            out.write_all(&hash(&data).to_le_bytes())?;
            out.write_all(&data)
        });
        drop(written);
    }
}

/// What `save` was given, if the file is whole.
fn contents(bytes: &[u8]) -> Option<&[u8]> {
    let (expected, data) = bytes.strip_prefix(MAGIC)?.split_first_chunk()?;
    (u64::from_le_bytes(*expected) == hash(data)).then_some(data)
}

/// The same in every run of the same program.
fn hash(data: &[u8]) -> u64 {
    let mut hasher = DefaultHasher::new();
    hasher.write(data);
    hasher.finish()
}

impl Gpu {
    /// Compiles the entry point `name` of a shader, with the given values of its switches.
    pub(super) fn compile(
        &self,
        name: &str,
        text: &str,
        constants: &[(&str, f64)],
    ) -> Result<wgpu::ComputePipeline, RenderError> {
        let key = (
            text.to_owned(),
            constants
                .iter()
                .map(|(name, value)| (name.to_string(), value.to_bits()))
                .collect(),
        );
        let mut compiled = self.compiled.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(pipeline) = compiled.get(&key) {
            return Ok(pipeline.clone());
        }
        let module = self.device.create_shader_module(wgpu::ShaderModuleDescriptor {
            label: Some(name),
            source: wgpu::ShaderSource::Wgsl(text.into()),
        });
        let pipeline = self.device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
            label: Some(name),
            layout: None,
            module: &module,
            entry_point: Some(name),
            compilation_options: wgpu::PipelineCompilationOptions {
                constants,
                ..Default::default()
            },
            cache: self.pipelines.as_ref().map(PipelineFile::cache),
        });
        match self.error() {
            Some(error) => Err(error),
            None => {
                compiled.insert(key, pipeline.clone());
                Ok(pipeline)
            }
        }
    }

    /// Keeps what has been compiled for the next start.
    pub(super) fn keep_pipelines(&self) {
        if let Some(pipelines) = &self.pipelines {
            pipelines.save();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn damaged_and_foreign_files_are_ignored() {
        let mut file = MAGIC.to_vec();
        file.extend(hash(b"data").to_le_bytes());
        file.extend(b"data");
        assert_eq!(contents(&file), Some(&b"data"[..]));
        for end in 0..file.len() {
            assert_eq!(contents(&file[..end]), None);
        }
        for at in 0..file.len() {
            let mut damaged = file.clone();
            damaged[at] ^= 1;
            assert_eq!(contents(&damaged), None);
        }
    }
}
