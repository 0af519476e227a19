// Passes that draw triangles: shadow maps, labels, image.

// Parameters of a part.
struct Wear {
    // Factors on the reflectance and transmittance texel, R, G, B, NIR.
    tint: vec4<f32>,
    tint_transmitted: vec4<f32>,
    // GGX α of the coat (1: none), strength of the relief, relative paleness of the lower side.
    finish: vec4<f32>,
};

struct Light {
    // Position of a lamp, or direction to the sun; w: 1 for a lamp.
    place: vec4<f32>,
    // Axis of a lamp; w: texel size of the shadow map, in metres for a sun, in metres per metre for a lamp.
    axis: vec4<f32>,
    // Irradiance at normal incidence for a sun; intensity along the axis for a lamp.
    strength: vec4<f32>,
    // World-to-shadow-map matrix.
    shadow: mat4x4<f32>,
};

const SHADOWS = 1u;
const SSAO = 2u;
const NORMAL_MAPS = 4u;
const FOLIAGE = 8u;
const PI = 3.14159265359;

@group(0) @binding(1) var<storage, read> wears: array<Wear>;
@group(0) @binding(2) var<storage, read> lights: array<Light>;

@group(1) @binding(0) var reflected: texture_2d<f32>;
@group(1) @binding(1) var transmitted: texture_2d<f32>;
// Normal x and y, ambient occlusion, water film.
@group(1) @binding(2) var relief: texture_2d<f32>;
@group(1) @binding(3) var mask: texture_2d<f32>;
@group(1) @binding(4) var smooth_sampler: sampler;

@group(2) @binding(0) var shadow_maps: texture_depth_2d_array;
@group(2) @binding(1) var shadow_sampler: sampler_comparison;
@group(2) @binding(2) var occlusion: texture_2d<f32>;
@group(2) @binding(3) var sky: texture_2d<f32>;
@group(2) @binding(4) var screen_sampler: sampler;

struct Corner {
    @location(0) clip: vec4<f32>,
    @location(1) position: vec3<f32>,
    @location(2) normal: vec3<f32>,
    @location(3) uv: vec2<f32>,
    @location(4) part: u32,
};

struct Varying {
    @builtin(position) @invariant at: vec4<f32>,
    @location(0) position: vec3<f32>,
    @location(1) normal: vec3<f32>,
    @location(2) uv: vec2<f32>,
    @location(3) @interpolate(flat) part: u32,
};

// The lens model has already been applied to the vertices on the CPU.
@vertex
fn corner(in: Corner) -> Varying {
    return Varying(in.clip, in.position, in.normal, in.uv, in.part);
}

// Unit geometric normal facing the camera; `upper` is true on the upper side.
struct Facing {
    flat_normal: vec3<f32>,
    upper: bool,
};

fn facing(in: Varying) -> Facing {
    let towards = view.eye.xyz - in.position;
    var flat_normal = normalize(cross(dpdx(in.position), dpdy(in.position)));
    if dot(flat_normal, towards) < 0.0 {
        flat_normal = -flat_normal;
    }
    return Facing(flat_normal, dot(in.normal, flat_normal) >= 0.0);
}

// Labels test masks at their own texels, as rays do.
fn cut(uv: vec2<f32>) -> bool {
    let size = vec2<f32>(textureDimensions(mask));
    let texel = floor(uv * size);
    if any(texel < vec2<f32>(0.0)) || any(texel >= size) {
        return true;
    }
    return textureLoad(mask, vec2<i32>(texel), 0).r < 0.5;
}

struct Labels {
    // Part index plus one.
    @location(0) part: u32,
    // World position, metres; w: 1.
    @location(1) position: vec4<f32>,
    @location(2) normal: vec4<f32>,
};

@fragment
fn label(in: Varying) -> Labels {
    let side = facing(in);
    if cut(in.uv) {
        discard;
    }
    let smooth_normal = normalize(select(-in.normal, in.normal, side.upper));
    let seen = dot(smooth_normal, view.eye.xyz - in.position) > 0.0;
    return Labels(in.part + 1u, vec4<f32>(in.position, 1.0), vec4<f32>(select(side.flat_normal, smooth_normal, seen), 0.0));
}

fn shadow(light: Light, p: vec3<f32>, layer: i32) -> f32 {
    let q = light.shadow * vec4<f32>(p, 1.0);
    let ndc = q.xyz / q.w;
    if q.w <= 0.0 || any(abs(ndc.xy) > vec2<f32>(1.0)) || ndc.z > 1.0 {
        return 1.0;
    }
    let uv = ndc.xy * vec2<f32>(0.5, -0.5) + 0.5;
    let step = 1.0 / vec2<f32>(textureDimensions(shadow_maps));
    var sum = 0.0;
    for (var y = -1; y <= 1; y++) {
        for (var x = -1; x <= 1; x++) {
            let tap = uv + vec2<f32>(f32(x), f32(y)) * step;
            sum += textureSampleCompareLevel(shadow_maps, shadow_sampler, tap, layer, ndc.z);
        }
    }
    return sum / 9.0;
}

// GGX with height-correlated Smith masking and Schlick's Fresnel term; reflectance per irradiance and cosine.
fn gloss(n: vec3<f32>, wo: vec3<f32>, wi: vec3<f32>, alpha: f32, f0: f32) -> f32 {
    let h = normalize(wo + wi);
    let nh = max(dot(n, h), 0.0);
    let no = max(dot(n, wo), 1e-3);
    let ni = max(dot(n, wi), 1e-3);
    let a2 = alpha * alpha;
    let t = nh * nh * (a2 - 1.0) + 1.0;
    let d = a2 / (PI * t * t);
    let v = 0.5 / (ni * sqrt(no * no * (1.0 - a2) + a2) + no * sqrt(ni * ni * (1.0 - a2) + a2));
    let f = f0 + (1.0 - f0) * pow(1.0 - max(dot(wo, h), 0.0), 5.0);
    return d * v * f;
}

// Lazarov's and Karis' fit of a coat's reflectance under uniform ambient light.
fn gloss_around(no: f32, alpha: f32, f0: f32) -> f32 {
    let roughness = sqrt(alpha);
    let r = roughness * vec4<f32>(-1.0, -0.0275, -0.572, 0.022) + vec4<f32>(1.0, 0.0425, 1.04, -0.04);
    let a = min(r.x * r.x, exp2(-9.28 * no)) * r.x + r.y;
    return f0 * (-1.04 * a + r.z) + (1.04 * a + r.w);
}

fn irradiance(n: vec3<f32>) -> vec4<f32> {
    let e = view.ambient;
    let sum = e[0] * 0.282095
        + (e[1] * n.y + e[2] * n.z + e[3] * n.x) * 0.488603
        + (e[4] * n.x * n.y + e[5] * n.y * n.z + e[7] * n.x * n.z) * 1.092548
        + e[6] * 0.315392 * (3.0 * n.z * n.z - 1.0)
        + e[8] * 0.546274 * (n.x * n.x - n.y * n.y);
    return max(sum, vec4<f32>(0.0));
}

// Depth prepass, so that each pixel is shaded once.
@fragment
fn nearest(in: Varying) {
    if textureSample(mask, smooth_sampler, in.uv).r < 0.5 {
        discard;
    }
}

@fragment
fn shade(in: Varying) -> @location(0) vec4<f32> {
    let wear = wears[in.part];
    let effects = view.counts.w;
    let texel = textureSample(reflected, smooth_sampler, in.uv);
    let passed = textureSample(transmitted, smooth_sampler, in.uv);
    let fine = textureSample(relief, smooth_sampler, in.uv);
    let screen = textureSampleLevel(occlusion, screen_sampler, (in.at.xy + vec2<f32>(-1.0)) / vec2<f32>(view.counts.xy), 0.0).r
        + textureSampleLevel(occlusion, screen_sampler, (in.at.xy + vec2<f32>(1.0, -1.0)) / vec2<f32>(view.counts.xy), 0.0).r
        + textureSampleLevel(occlusion, screen_sampler, (in.at.xy + vec2<f32>(-1.0, 1.0)) / vec2<f32>(view.counts.xy), 0.0).r
        + textureSampleLevel(occlusion, screen_sampler, (in.at.xy + vec2<f32>(1.0)) / vec2<f32>(view.counts.xy), 0.0).r;
    let side = facing(in);
    let dx = dpdx(in.position);
    let dy = dpdy(in.position);
    let ux = dpdx(in.uv);
    let uy = dpdy(in.uv);
    let wo = normalize(view.eye.xyz - in.position);
    var n = normalize(in.normal);
    if (effects & NORMAL_MAPS) != 0u && wear.finish.y > 0.0 {
        let turn = sign(ux.x * uy.y - ux.y * uy.x);
        let along_u = (dx * uy.y - dy * ux.y) * turn;
        let along_v = (dy * ux.x - dx * uy.x) * turn;
        let xy = fine.xy * 2.0 - 1.0;
        let z = sqrt(max(1.0 - dot(xy, xy), 0.01));
        // The map stores normals; slopes are −x/z and −y/z.
        let lean = xy / z * wear.finish.y;
        n = normalize(n + normalize(along_u + vec3<f32>(1e-12)) * lean.x - normalize(along_v + vec3<f32>(1e-12)) * lean.y);
    }
    if !side.upper {
        n = -n;
    }
    let no = dot(n, wo);
    if no < 0.02 {
        n = normalize(n + wo * (0.02 - no));
    }
    var through = passed * wear.tint_transmitted;
    if (effects & FOLIAGE) == 0u {
        through = vec4<f32>(0.0);
    }
    var color = texel * wear.tint;
    if !side.upper {
        color = min(vec4<f32>(color.rgb * wear.finish.z, color.a), vec4<f32>(0.99) - through);
    }
    // The reflectance of the coat is not part of the pigments' reflectance.
    let coated = wear.finish.x < 1.0;
    // Wax covers the whole leaf, water a fraction of the soil.
    let shiny = select(fine.a, 1.0, coated);
    let f0 = select(0.02, 0.034, coated);
    let alpha = select(0.3, wear.finish.x, coated);
    color = max(color - vec4<f32>(select(0.0, 0.03, coated)), vec4<f32>(0.0));
    var sum = vec4<f32>(0.0);
    for (var i = 0u; i < view.counts.z; i++) {
        let light = lights[i];
        var wi = light.place.xyz;
        var strength = light.strength;
        var texel_size = light.axis.w;
        if light.place.w > 0.0 {
            let to = light.place.xyz - in.position;
            let distance = length(to);
            wi = to / distance;
            strength *= max(-dot(wi, light.axis.xyz), 0.0) / (distance * distance);
            texel_size *= distance;
        }
        let cosine = dot(n, wi);
        if (effects & SHADOWS) != 0u {
            let off = side.flat_normal * sign(dot(side.flat_normal, wi)) * texel_size * 2.0;
            strength *= shadow(light, in.position + off, i32(i));
        }
        if cosine > 0.0 {
            sum += strength * cosine * (color / PI + vec4<f32>(shiny * gloss(n, wo, wi, alpha, f0)));
        }
        // McAuley's energy-conserving wrapped diffuse: light from behind wraps around the edge of the leaf.
        sum += strength * through / PI * clamp((0.5 - cosine) / 2.25, 0.0, 1.0);
    }
    var open = fine.b;
    if (effects & SSAO) != 0u {
        open *= 0.25 * screen;
    }
    let around = irradiance(n) * color + irradiance(-n) * through;
    let mirrored = irradiance(reflect(-wo, n)) * (shiny * gloss_around(max(dot(n, wo), 0.0), alpha, f0));
    sum += (around + mirrored) / PI * open;
    return min(sum * view.eye.w, vec4<f32>(60000.0));
}

// Shadow map pass: uses only the light's matrix.
struct Caster {
    @builtin(position) at: vec4<f32>,
    @location(0) uv: vec2<f32>,
};

@group(3) @binding(0) var<uniform> from_light: mat4x4<f32>;

@vertex
fn caster(in: Corner) -> Caster {
    return Caster(from_light * vec4<f32>(in.position, 1.0), in.uv);
}

@fragment
fn cover(in: Caster) {
    if textureSample(mask, smooth_sampler, in.uv).r < 0.5 {
        discard;
    }
}

// Background.
@fragment
fn behind(@builtin(position) at: vec4<f32>) -> @location(0) vec4<f32> {
    return min(textureLoad(sky, vec2<i32>(at.xy), 0) * view.eye.w, vec4<f32>(60000.0));
}
