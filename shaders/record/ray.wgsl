// Rays and what they meet.

struct Ray {
    origin_ws: vec3<f32>,
    direction_ws: vec3<f32>,
    t_max: f32,
}

// x: instance, y: triangle of its mesh.
const NO_PRIMITIVE: vec2<u32> = vec2<u32>(0xffffffffu, 0xffffffffu);

struct Hit {
    t: f32,
    // Barycentric weights of the second and third corner.
    u: f32,
    v: f32,
    // NO_PRIMITIVE: nothing was hit.
    id: vec2<u32>,
}
