// Where points of the world appear in a picture.
#import "lib/constants.wgsl"
#import "record/clean.wgsl"

struct Share {
    // Of width and height.
    at: vec2<f32>,
    // Whether the point lies before the camera.
    exists: bool,
}

// twin: crates/render/src/clean/projection.rs share
fn share(seen: Seen, point_ws: vec3<f32>) -> Share {
    let local = seen.x_axis * point_ws.x + seen.y_axis * point_ws.y + seen.z_axis * point_ws.z + seen.translation;
    if local.z >= -1e-6 {
        return Share(vec2<f32>(0.0), false);
    }
    let half = vec2<f32>(seen.half_width, seen.half_height);
    let at = vec2<f32>(local.x, -local.y) / (half * -local.z) * 0.5 + 0.5;
    return Share(at, is_finite(at.x) && is_finite(at.y));
}
