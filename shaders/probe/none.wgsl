// Nobody looks over the path's shoulder.
#import "scene/surface.wgsl"

fn probe_pixel(pixel: u32) {}

fn probe_first_hit(pixel: u32, surface: Surface, distance: f32, light: u32) {}
