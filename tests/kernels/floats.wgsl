// Pure functions of single precision: two random numbers in, ten numbers out.
#import "lib/ggx.wgsl"
#import "lib/triangle.wgsl"

@group(3) @binding(0) var<storage, read> input: array<vec2<f32>>;
@group(3) @binding(1) var<storage, read_write> output: array<f32>;

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x >= arrayLength(&input) {
        return;
    }
    let u = input[id.x];
    let at = 12u * id.x;
    let disk = cosine_hemisphere(u);
    let flat = uniform_triangle(u);
    let triangle = spherical_triangle(
        vec3<f32>(1.0, 0.2, -0.3) + vec3<f32>(u, 0.0),
        vec3<f32>(-0.4, 1.5, 0.2),
        vec3<f32>(0.3, -0.1, 0.8) * (0.5 + u.x),
    );
    let towards = sample_spherical_triangle(triangle, u);
    let half = sample_vndf(normalize(vec3<f32>(0.3, u.x - 0.5, 0.4)), 0.05 + u.y, u);
    output[at] = disk.x;
    output[at + 1u] = disk.y;
    output[at + 2u] = disk.z;
    output[at + 3u] = flat.x;
    output[at + 4u] = flat.y;
    output[at + 5u] = triangle.solid_angle;
    output[at + 6u] = towards.x;
    output[at + 7u] = towards.y;
    output[at + 8u] = towards.z;
    output[at + 9u] = half.x;
    output[at + 10u] = half.y;
    output[at + 11u] = half.z;
}
