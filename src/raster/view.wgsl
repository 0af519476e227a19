// What all shaders know; it stands before each of them.

struct View {
    // The eye, metres, world; w: what radiance is multiplied by so that half floats hold it.
    eye: vec4<f32>,
    // Spherical harmonics of the ambient irradiance, R, G, B, NIR.
    ambient: array<vec4<f32>, 9>,
    // Width and height in pixels, number of lights, effects.
    counts: vec4<u32>,
    // Pixels per unit of x/z; radius of the ambient occlusion, metres.
    focal: vec4<f32>,
};

@group(0) @binding(0) var<uniform> view: View;

// One triangle over all.
@vertex
fn screen(@builtin(vertex_index) i: u32) -> @builtin(position) vec4<f32> {
    return vec4<f32>(f32(i & 1u) * 4.0 - 1.0, f32(i >> 1u) * 4.0 - 1.0, 0.0, 1.0);
}

