// Common declarations, prepended to each shader.

struct View {
    // Camera position in world coordinates, metres; w: factor that scales radiance into the range of half floats.
    eye: vec4<f32>,
    // Spherical harmonics of the ambient irradiance, R, G, B, NIR.
    ambient: array<vec4<f32>, 9>,
    // Width and height in pixels, number of lights, effects.
    counts: vec4<u32>,
    // Pixels per unit of x/z; radius of the ambient occlusion, metres.
    focal: vec4<f32>,
};

@group(0) @binding(0) var<uniform> view: View;

// Full-screen triangle.
@vertex
fn screen(@builtin(vertex_index) i: u32) -> @builtin(position) vec4<f32> {
    return vec4<f32>(f32(i & 1u) * 4.0 - 1.0, f32(i >> 1u) * 4.0 - 1.0, 0.0, 1.0);
}

