// The film's image, as it is.
#import "clean/film.wgsl"
#import "record/clean.wgsl"
#import "record/film.wgsl"

@group(3) @binding(1) var<storage, read> film: array<FilmPixel>;
@group(3) @binding(2) var<storage, read_write> shown: array<vec4<f32>>;

// twin: crates/render/src/film.rs image
@compute @workgroup_size(8, 8)
fn mean(@builtin(global_invocation_id) id: vec3<u32>) {
    if is_inside(id.xy) {
        let pixel = pixel_at(id.xy);
        shown[pixel] = vec4<f32>(mean_of(film[pixel]).rgb, 1.0);
    }
}
