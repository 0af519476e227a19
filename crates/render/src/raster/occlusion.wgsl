// Screen-space ambient occlusion: McGuire, Mara & Luebke 2012, "Scalable Ambient Obscurance", from the positions and
// normals of the label pass.

@group(1) @binding(0) var positions: texture_2d<f32>;
@group(1) @binding(1) var normals: texture_2d<f32>;

const TAPS = 16;
const TURNS = 7.0;

@fragment
fn occlude(@builtin(position) at: vec4<f32>) -> @location(0) vec4<f32> {
    let pixel = vec2<i32>(at.xy);
    let here = textureLoad(positions, pixel, 0);
    if here.w == 0.0 {
        return vec4<f32>(1.0);
    }
    let n = textureLoad(normals, pixel, 0).xyz;
    let radius = view.focal.y;
    let reach = clamp(view.focal.x * radius / length(here.xyz - view.eye.xyz), 2.0, 96.0);
    // Rotations repeat in 4 × 4 pixels; the blur in the shading pass removes the pattern.
    let turn = f32((pixel.x & 3) * 4 + (pixel.y & 3)) * 0.39269908 * 7.0;
    let last = vec2<i32>(view.counts.xy) - 1;
    var sum = 0.0;
    for (var i = 0; i < TAPS; i++) {
        let share = (f32(i) + 0.5) / f32(TAPS);
        let angle = share * TURNS * 6.2831853 + turn;
        let tap = clamp(pixel + vec2<i32>(round(vec2<f32>(cos(angle), sin(angle)) * share * reach)), vec2<i32>(0), last);
        let there = textureLoad(positions, tap, 0);
        if there.w > 0.0 {
            let v = (there.xyz - here.xyz) / radius;
            let vv = dot(v, v);
            let f = max(1.0 - vv, 0.0);
            sum += f * f * f * max((dot(v, n) - 0.02) / (vv + 0.001), 0.0);
        }
    }
    return vec4<f32>(max(1.0 - sum * 1.5 / f32(TAPS), 0.0));
}
