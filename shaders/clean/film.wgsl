// Means of a film's sums.
#import "lib/constants.wgsl"
#import "record/film.wgsl"

// R, G, B, luminance squared.
fn mean_of(pixel: FilmPixel) -> vec4<f32> {
    if pixel.count == 0u {
        return vec4<f32>(0.0);
    }
    return (pixel.hi + pixel.lo) / (pixel.weight_hi + pixel.weight_lo);
}
