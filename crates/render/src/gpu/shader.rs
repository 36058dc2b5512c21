//! From the files in `shaders/` to one shader: `#import "lib/hash.wgsl"` includes a file once.

use crate::RenderError;
use crate::error::GpuFault;
use light_cache::Scheme;

/// Embeds files by their path under `shaders/`.
macro_rules! files {
    ($($path:literal),* $(,)?) => {
        &[$(($path, include_str!(concat!("../../../../shaders/", $path)))),*]
    };
}

/// All files that the linker knows, by path.
const FILES: &[(&str, &str)] = files![
    "clean/film.wgsl",
    "clean/guide.wgsl",
    "clean/kept.wgsl",
    "clean/projection.wgsl",
    "lib/constants.wgsl",
    "lib/control.wgsl",
    "lib/ggx.wgsl",
    "lib/hash.wgsl",
    "lib/hemisphere.wgsl",
    "lib/interval.wgsl",
    "lib/mis.wgsl",
    "lib/sequence.wgsl",
    "lib/sum.wgsl",
    "lib/tile.wgsl",
    "lib/triangle.wgsl",
    "lib/wide.wgsl",
    "light_cache/adaptive.wgsl",
    "light_cache/bindings.wgsl",
    "light_cache/cut.wgsl",
    "light_cache/discrete.wgsl",
    "light_cache/distribution.wgsl",
    "light_cache/grid.wgsl",
    "light_cache/guide.wgsl",
    "light_cache/light_tree.wgsl",
    "light_cache/tree.wgsl",
    "light_cache/uniform.wgsl",
    "pass/assemble.wgsl",
    "pass/atrous.wgsl",
    "pass/count.wgsl",
    "pass/mean.wgsl",
    "pass/path.wgsl",
    "pass/recall.wgsl",
    "pass/resolve.wgsl",
    "pass/split.wgsl",
    "pass/tally.wgsl",
    "pass/thin.wgsl",
    "pass/typical.wgsl",
    "pass/vary.wgsl",
    "path/direct.wgsl",
    "path/log.wgsl",
    "probe/first_hit.wgsl",
    "probe/none.wgsl",
    "record/aov.wgsl",
    "record/clean.wgsl",
    "record/count.wgsl",
    "record/film.wgsl",
    "record/frame.wgsl",
    "record/lesson.wgsl",
    "record/ray.wgsl",
    "scene/bindings.wgsl",
    "scene/bsdf.wgsl",
    "scene/light.wgsl",
    "scene/surface.wgsl",
    "scene/texture.wgsl",
    "trace/bvh.wgsl",
];

/// The name that every sampler goes by: it is bound to the file of the one in use.
const SAMPLER: &str = "light_cache/sampler.wgsl";

/// Likewise, of what looks over the path's shoulder.
const PROBE: &str = "probe/probe.wgsl";

/// The files of the back end: path under `shaders/`, and text.
pub fn files() -> &'static [(&'static str, &'static str)] {
    FILES
}

fn sampler_file(scheme: Scheme) -> &'static str {
    match scheme {
        Scheme::Uniform => "light_cache/uniform.wgsl",
        Scheme::Discrete => "light_cache/discrete.wgsl",
        Scheme::Tree => "light_cache/tree.wgsl",
        Scheme::Adaptive => "light_cache/adaptive.wgsl",
    }
}

fn probe_file(aovs: bool) -> &'static str {
    if aovs {
        "probe/first_hit.wgsl"
    } else {
        "probe/none.wgsl"
    }
}

/// `text` with everything that it imports, each file once, before what needs it; lights are drawn by `scheme`, and with `aovs` paths tell
/// what they meet first.
///
/// # Errors
/// [`RenderError::Gpu`] for an import that there is no file for.
pub fn link(text: &str, scheme: Scheme, aovs: bool) -> Result<String, RenderError> {
    let mut linked = String::new();
    let mut done = Vec::new();
    let bound = [(SAMPLER, sampler_file(scheme)), (PROBE, probe_file(aovs))];
    add(text, &bound, &mut done, &mut linked)?;
    Ok(linked)
}

/// The pass of that name, linked.
pub(crate) fn pass(name: &str, scheme: Scheme, aovs: bool) -> Result<String, RenderError> {
    link(&format!("#import \"pass/{name}.wgsl\"\n"), scheme, aovs)
}

/// Appends `text` to `linked`; `bound`: files by the names that stand for them.
fn add(
    text: &str,
    bound: &[(&str, &'static str)],
    done: &mut Vec<&'static str>,
    linked: &mut String,
) -> Result<(), RenderError> {
    for line in text.lines() {
        let Some(import) = line.strip_prefix("#import ") else {
            linked.push_str(line);
            linked.push('\n');
            continue;
        };
        let import = import.trim().trim_matches('"');
        let stands_for = bound.iter().find(|(name, _)| *name == import);
        let wanted = stands_for.map_or(import, |(_, path)| path);
        let Some((path, text)) = FILES.iter().find(|(path, _)| *path == wanted) else {
            return Err(GpuFault::NoAdapter.error(format!("no shader file {wanted}")));
        };
        if !done.contains(path) {
            done.push(path);
            add(text, bound, done, linked)?;
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_pass_links_and_is_valid_with_every_sampler() {
        let schemes = [Scheme::Uniform, Scheme::Discrete, Scheme::Tree, Scheme::Adaptive];
        for (scheme, aovs) in schemes.into_iter().flat_map(|scheme| [(scheme, false), (scheme, true)]) {
            let text = pass("path", scheme, aovs).expect("links");
            let module = match wgpu::naga::front::wgsl::parse_str(&text) {
                Ok(module) => module,
                Err(error) => panic!("{scheme:?}: {}", error.emit_to_string(&text)),
            };
            let mut validator = wgpu::naga::valid::Validator::new(
                wgpu::naga::valid::ValidationFlags::all(),
                wgpu::naga::valid::Capabilities::empty(),
            );
            if let Err(error) = validator.validate(&module) {
                panic!("{scheme:?}: {}", error.emit_to_string(&text));
            }
        }
    }

    #[test]
    fn files_are_included_once_and_unknown_ones_refused() {
        let text = link(
            "#import \"lib/hash.wgsl\"\n#import \"lib/interval.wgsl\"\n",
            Scheme::Uniform,
            false,
        )
        .expect("links");
        assert_eq!(text.matches("fn mix_bits(").count(), 1);
        assert!(link("#import \"lib/none.wgsl\"\n", Scheme::Uniform, false).is_err());
    }
}
