//! Renders one image of a scene: shadow maps, labels, ambient occlusion, shading, and readback.

use super::LabelledImage;
use super::gpu::{Gpu, view};
use super::lights::{Lights, SHADOW_SIZE};
use super::pipelines::{AMBIENT_OCCLUSION, DEPTH, NORMALS, PARTS, POSITIONS, Pipelines, RADIANCE, SAMPLES};
use super::textures::SceneTextures;
use super::vertices::Vertices;
use crate::film::{Accumulator, Film};
use crate::render::{LabelMap, label};
use crate::scene::Scene;
use crate::scene::tag::Tag;
use crate::settings::{Technique, Techniques};
use furrow_base::geometry::Window;
use furrow_base::math::{Spectrum, ToFloat, ToInt, Vec3, Vec4};
use furrow_base::{Error, Result};
use furrow_optics::light::{Form, Light};
use wgpu::{
    AddressMode, BindGroup, BindGroupDescriptor, BindGroupEntry, BindGroupLayout, BindingResource, Buffer,
    BufferUsages, Color, CommandEncoder, CommandEncoderDescriptor, CompareFunction, FilterMode, IndexFormat, LoadOp,
    MipmapFilterMode, Operations, RenderPass, RenderPassColorAttachment, RenderPassDepthStencilAttachment,
    RenderPassDescriptor, RenderPipeline, Sampler, SamplerDescriptor, StoreOp, Texture, TextureUsages, TextureView,
    TextureViewDescriptor, TextureViewDimension,
};

/// Radius of the ambient occlusion, metres: about the height of a leaf above the ground.
const OCCLUSION_RADIUS: f32 = 0.03;
/// Maximum anisotropy of texture sampling.
const ANISOTROPY: u16 = 4;
/// Floats of the view in the shader's layout.
const VIEW: usize = 48;

/// GPU resources of one scene.
struct Stage<'a> {
    gpu: &'a Gpu,
    pipelines: &'a Pipelines,
    vertices: &'a Vertices,
    corners: Buffer,
    indices: Buffer,
    frame: BindGroup,
    sheets: Vec<BindGroup>,
}

/// Renders a scene.
pub(super) fn draw(gpu: &Gpu, pipelines: &Pipelines, scene: &Scene, techniques: &Techniques) -> Result<LabelledImage> {
    let limits = gpu.device.limits();
    let size = (scene.camera.width(), scene.camera.height());
    if size.0.max(size.1) > limits.max_texture_dimension_2d {
        return Err(Error::missing(format!("{} × {} pixels are more than {} supports", size.0, size.1, gpu.name()))
            .help(format!("use at most {} in each direction", limits.max_texture_dimension_2d)));
    }
    let sheets = SceneTextures::new(scene, gpu, limits.max_texture_dimension_2d);
    let vertices = Vertices::new(scene, &sheets.worn, sheets.all.len());
    let lights = Lights::new(scene, &vertices.corners, techniques);
    let corners = bytemuck::cast_slice(&vertices.corners);
    let most = limits.max_buffer_size.min(u64::from(u32::MAX));
    if corners.len().to_u64() > most {
        return Err(Error::input(format!("{} triangles are more than {} can hold", scene.triangles(), gpu.name())));
    }
    let scale = scale(scene);
    let storage = |bytes: &[u8]| gpu.buffer(BufferUsages::STORAGE, bytes);
    let frame = bind(
        gpu,
        &pipelines.frame,
        &[
            gpu.buffer(BufferUsages::UNIFORM, bytemuck::cast_slice(&seen(scene, &lights, techniques, scale)))
                .as_entire_binding(),
            storage(bytemuck::cast_slice(&sheets.wears)).as_entire_binding(),
            storage(bytemuck::cast_slice(&lights.each)).as_entire_binding(),
        ],
    );
    let smooth = sampler(gpu, AddressMode::ClampToEdge, ANISOTROPY);
    let groups = sheets.all.iter().map(|sheet| {
        let textures =
            [&sheet.reflected, &sheet.transmitted, &sheet.relief, &sheet.mask].map(BindingResource::TextureView);
        let [a, b, c, d] = textures;
        bind(gpu, &pipelines.sheet, &[a, b, c, d, BindingResource::Sampler(&smooth)])
    });
    let stage = Stage {
        gpu,
        pipelines,
        corners: gpu.buffer(BufferUsages::VERTEX, corners),
        indices: gpu.buffer(BufferUsages::INDEX, bytemuck::cast_slice(&vertices.indices)),
        frame,
        sheets: groups.collect(),
        vertices: &vertices,
    };
    let mut encoder = gpu.device.create_command_encoder(&CommandEncoderDescriptor::default());
    let shadows = stage.shadows(&mut encoder, &lights, techniques.has(Technique::Shadows));
    let [parts, positions, normals] = stage.labels(&mut encoder, size);
    let ambient_occlusion = stage.ambient_occlusion(&mut encoder, size, &positions, &normals);
    // The pixels that show the sky are known only after the labels are read back.
    gpu.queue.submit([encoder.finish()]);
    let labels = read_labels(gpu, scene, &parts, &positions, &normals)?;
    let sky = sky(gpu, scene, &labels);
    let mut encoder = gpu.device.create_command_encoder(&CommandEncoderDescriptor::default());
    let picture = stage.picture(
        &mut encoder,
        size,
        &[&shadows, &view(&ambient_occlusion), &sky],
        techniques.has(Technique::Msaa),
    );
    gpu.queue.submit([encoder.finish()]);
    let radiance = gpu.read(&picture)?;
    gpu.check()?;
    Ok(LabelledImage { film: film(scene, &labels, &radiance, 1.0 / scale), labels })
}

/// Factor that scales radiance to about one.
fn scale(scene: &Scene) -> f32 {
    let strength = |light: &Light| match light.form() {
        // The sun counts with its normal irradiance, whatever its elevation.
        Form::Distant { normal_irradiance, .. } => normal_irradiance,
        Form::Area { .. } | Form::Dome { .. } | Form::Unsupported => light.horizontal_irradiance(),
    };
    let all = scene.lights.iter().map(strength).fold(Spectrum::ZERO, |sum, s| sum + s);
    std::f32::consts::PI / all.max().max(1e-6)
}

/// Parameters of the view in the shader's layout.
fn seen(scene: &Scene, lights: &Lights, techniques: &Techniques, scale: f32) -> [f32; VIEW] {
    let camera = &scene.camera;
    let mut all = [0.0; VIEW];
    all[..4].copy_from_slice(&camera.pose().position.extend(scale).to_array());
    for (to, from) in all[4..40].chunks_mut(4).zip(&lights.ambient) {
        to.copy_from_slice(&from.to_array());
    }
    let shown = [Technique::Shadows, Technique::Ssao, Technique::NormalMaps, Technique::Foliage];
    let effects = (0..).zip(shown).map(|(bit, effect)| u32::from(techniques.has(effect)) << bit).sum();
    let counts = [camera.width(), camera.height(), lights.each.len().to_u32(), effects];
    all[40..44].copy_from_slice(&counts.map(f32::from_bits));
    all[44..46].copy_from_slice(&[camera.intrinsics()[0].to_f32(), OCCLUSION_RADIUS]);
    all
}

fn bind(gpu: &Gpu, layout: &BindGroupLayout, resources: &[BindingResource<'_>]) -> BindGroup {
    let entries: Vec<BindGroupEntry<'_>> = (0..)
        .zip(resources)
        .map(|(binding, resource)| BindGroupEntry { binding, resource: resource.clone() })
        .collect();
    gpu.device.create_bind_group(&BindGroupDescriptor { label: None, layout, entries: &entries })
}

fn sampler(gpu: &Gpu, edge: AddressMode, anisotropy_clamp: u16) -> Sampler {
    gpu.device.create_sampler(&SamplerDescriptor {
        address_mode_u: edge,
        address_mode_v: edge,
        mag_filter: FilterMode::Linear,
        min_filter: FilterMode::Linear,
        mipmap_filter: MipmapFilterMode::Linear,
        anisotropy_clamp,
        ..Default::default()
    })
}

fn depth(view: &TextureView, load: LoadOp<f32>) -> RenderPassDepthStencilAttachment<'_> {
    let depth_ops = Some(Operations { load, store: StoreOp::Store });
    RenderPassDepthStencilAttachment { view, depth_ops, stencil_ops: None }
}

fn color<'a>(view: &'a TextureView, resolve_target: Option<&'a TextureView>) -> RenderPassColorAttachment<'a> {
    let ops = Operations { load: LoadOp::Clear(Color::TRANSPARENT), store: StoreOp::Store };
    RenderPassColorAttachment { view, depth_slice: None, resolve_target, ops }
}

impl Stage<'_> {
    fn pass<'e>(
        &self,
        encoder: &'e mut CommandEncoder,
        colors: &[Option<RenderPassColorAttachment<'_>>],
        depth: Option<RenderPassDepthStencilAttachment<'_>>,
    ) -> RenderPass<'e> {
        let mut pass = encoder.begin_render_pass(&RenderPassDescriptor {
            color_attachments: colors,
            depth_stencil_attachment: depth,
            ..Default::default()
        });
        pass.set_vertex_buffer(0, self.corners.slice(..));
        pass.set_index_buffer(self.indices.slice(..), IndexFormat::Uint32);
        pass
    }

    /// Draws all triangles, sheet by sheet.
    fn triangles(&self, pass: &mut RenderPass<'_>, pipeline: &RenderPipeline) {
        pass.set_pipeline(pipeline);
        for (sheet, indices) in self.sheets.iter().zip(&self.vertices.of_sheet) {
            pass.set_bind_group(1, sheet, &[]);
            pass.draw_indexed(indices.clone(), 0, 0..1);
        }
    }

    /// Renders a shadow map for each light; a single empty map if there are none.
    fn shadows(&self, encoder: &mut CommandEncoder, lights: &Lights, wanted: bool) -> TextureView {
        let count = if wanted { lights.each.len() } else { 0 };
        let usage = TextureUsages::RENDER_ATTACHMENT | TextureUsages::TEXTURE_BINDING;
        let side = if count > 0 { SHADOW_SIZE } else { 1 };
        let maps = self.gpu.texture((side, side), count.max(1).to_u32(), 1, DEPTH, 1, usage);
        let empty: [BindGroup; 2] = std::array::from_fn(|_| bind(self.gpu, &self.pipelines.nothing, &[]));
        for light in 0..count {
            let layer = maps.create_view(&TextureViewDescriptor {
                dimension: Some(TextureViewDimension::D2),
                base_array_layer: light.to_u32(),
                array_layer_count: Some(1),
                ..Default::default()
            });
            let matrix = self.gpu.buffer(BufferUsages::UNIFORM, bytemuck::cast_slice(lights.matrix(light)));
            let caster = bind(self.gpu, &self.pipelines.caster, &[matrix.as_entire_binding()]);
            let mut pass = self.pass(encoder, &[], Some(depth(&layer, LoadOp::Clear(1.0))));
            pass.set_bind_group(0, &empty[0], &[]);
            pass.set_bind_group(2, &empty[1], &[]);
            pass.set_bind_group(3, &caster, &[]);
            self.triangles(&mut pass, &self.pipelines.shadow);
        }
        maps.create_view(&TextureViewDescriptor {
            dimension: Some(TextureViewDimension::D2Array),
            ..Default::default()
        })
    }

    /// Renders part, position and normal at each pixel centre.
    fn labels(&self, encoder: &mut CommandEncoder, size: (u32, u32)) -> [Texture; 3] {
        let targets = [PARTS, POSITIONS, NORMALS].map(|format| self.gpu.target(size, format, 1));
        let views = targets.each_ref().map(view);
        let behind = view(&self.gpu.target(size, DEPTH, 1));
        let mut pass = self.pass(
            encoder,
            &views.each_ref().map(|v| Some(color(v, None))),
            Some(depth(&behind, LoadOp::Clear(0.0))),
        );
        pass.set_bind_group(0, &self.frame, &[]);
        self.triangles(&mut pass, &self.pipelines.label);
        drop(pass);
        targets
    }

    /// Renders the screen-space ambient occlusion.
    fn ambient_occlusion(
        &self,
        encoder: &mut CommandEncoder,
        size: (u32, u32),
        positions: &Texture,
        normals: &Texture,
    ) -> Texture {
        let target = self.gpu.target(size, AMBIENT_OCCLUSION, 1);
        let (positions, normals) = (view(positions), view(normals));
        let of = [BindingResource::TextureView(&positions), BindingResource::TextureView(&normals)];
        let surface = bind(self.gpu, &self.pipelines.surface, &of);
        let mut pass = self.pass(encoder, &[Some(color(&view(&target), None))], None);
        pass.set_pipeline(&self.pipelines.occlude);
        pass.set_bind_group(0, &self.frame, &[]);
        pass.set_bind_group(1, &surface, &[]);
        pass.draw(0..3, 0..1);
        drop(pass);
        target
    }

    /// Renders radiance; `around` are the shadow maps, the ambient occlusion and the sky.
    fn picture(
        &self,
        encoder: &mut CommandEncoder,
        size: (u32, u32),
        around: &[&TextureView; 3],
        smooth: bool,
    ) -> Texture {
        let which = usize::from(smooth);
        let comparing = self.gpu.device.create_sampler(&SamplerDescriptor {
            mag_filter: FilterMode::Linear,
            min_filter: FilterMode::Linear,
            compare: Some(CompareFunction::LessEqual),
            ..Default::default()
        });
        let clamped = sampler(self.gpu, AddressMode::ClampToEdge, 1);
        let [maps, ambient_occlusion, sky] = around.map(BindingResource::TextureView);
        let sampled = [BindingResource::Sampler(&comparing), BindingResource::Sampler(&clamped)];
        let [comparing, clamped] = sampled;
        let around = bind(self.gpu, &self.pipelines.around, &[maps, comparing, ambient_occlusion, sky, clamped]);
        let result = self.gpu.target(size, RADIANCE, 1);
        let many = smooth.then(|| view(&self.gpu.target(size, RADIANCE, SAMPLES[which])));
        let shown = view(&result);
        let target = match &many {
            Some(many) => color(many, Some(&shown)),
            None => color(&shown, None),
        };
        let behind = view(&self.gpu.target(size, DEPTH, SAMPLES[which]));
        // Depth prepass, so that only the nearest surface is shaded.
        let mut pass = self.pass(encoder, &[], Some(depth(&behind, LoadOp::Clear(0.0))));
        pass.set_bind_group(0, &self.frame, &[]);
        self.triangles(&mut pass, &self.pipelines.nearest[which]);
        drop(pass);
        let mut pass = self.pass(encoder, &[Some(target)], Some(depth(&behind, LoadOp::Load)));
        pass.set_bind_group(0, &self.frame, &[]);
        pass.set_bind_group(2, &around, &[]);
        if let Some(any) = self.sheets.first() {
            pass.set_bind_group(1, any, &[]);
            pass.set_pipeline(&self.pipelines.behind[which]);
            pass.draw(0..3, 0..1);
        }
        self.triangles(&mut pass, &self.pipelines.shade[which]);
        drop(pass);
        result
    }
}

/// Converts the id buffer to labels.
fn read_labels(gpu: &Gpu, scene: &Scene, parts: &Texture, positions: &Texture, normals: &Texture) -> Result<LabelMap> {
    let window = Window::full(scene.camera.width(), scene.camera.height());
    let (parts, positions, normals) = (gpu.read(parts)?, gpu.read(positions)?, gpu.read(normals)?);
    let pose = scene.camera.pose();
    let count = (window.width() * window.height()).to_usize();
    let mut map = LabelMap {
        window,
        parts: vec![label::NONE; count],
        tags: vec![Tag::default(); count],
        depth: vec![f32::INFINITY; count],
        normals: vec![Vec3::ZERO; count],
    };
    let words = parts.as_chunks::<4>().0;
    let places = positions.as_chunks::<16>().0;
    let facing = normals.as_chunks::<8>().0;
    for (i, ((part, place), normal)) in words.iter().zip(places).zip(facing).enumerate() {
        let Some(part) = u32::from_le_bytes(*part).checked_sub(1) else { continue };
        let [x, y, z, _] = bytemuck::cast::<_, [f32; 4]>(*place);
        map.parts[i] = part;
        map.tags[i] = scene.parts[part.to_usize()].tag;
        let (eye, _) = scene.camera.centre_ray(i.to_u32() % window.width(), i.to_u32() / window.width());
        map.depth[i] = (Vec3::new(x, y, z) - eye).dot(pose.axes.z_axis);
        map.normals[i] = halves(*normal).truncate().normalize_or_zero();
    }
    Ok(map)
}

/// Decodes four half floats.
fn halves(bytes: [u8; 8]) -> Vec4 {
    let pairs = bytes.as_chunks::<2>().0;
    Vec4::from_array(std::array::from_fn(|i| half(u16::from_le_bytes(pairs[i]))))
}

/// Decodes an IEEE 754 binary16 number. Infinities do not occur in the shader output.
fn half(bits: u16) -> f32 {
    let (exponent, fraction) = (i32::from(bits >> 10 & 31), f32::from(bits & 1023) / 1024.0);
    let size = if exponent == 0 { fraction * 2f32.powi(-14) } else { (1.0 + fraction) * 2f32.powi(exponent - 15) };
    if bits >> 15 == 1 { -size } else { size }
}

/// Background image: radiance of sky, sun and environment map where the labels are empty; a single texel if they never
/// are.
fn sky(gpu: &Gpu, scene: &Scene, labels: &LabelMap) -> TextureView {
    let window = labels.window;
    let (width, height) = (window.width(), window.height());
    let camera = &scene.camera;
    let radiance = |x: u32, y: u32| {
        let (_, direction) = camera.centre_ray(x, y);
        scene.lights.iter().map(|l: &Light| l.seen(direction)).fold(Spectrum::ZERO, |sum, l| sum + l).to_array()
    };
    let seen = labels.parts.contains(&label::NONE);
    let size = if seen { (width, height) } else { (1, 1) };
    let texels: Vec<[f32; 4]> = if seen {
        (0..height).flat_map(|y| (0..width).map(move |x| (x, y))).map(|(x, y)| radiance(x, y)).collect()
    } else {
        vec![[0.0; 4]]
    };
    gpu.picture(size, wgpu::TextureFormat::Rgba32Float, &[bytemuck::cast_slice(&texels).to_vec()])
}

/// Converts the image to a film.
fn film(scene: &Scene, labels: &LabelMap, radiance: &[u8], unscale: f32) -> Film {
    let forward = scene.camera.pose().axes.z_axis;
    let width = labels.window.width().to_usize();
    let pixels = radiance.as_chunks::<8>().0.iter().enumerate().map(|(i, bytes)| {
        let mut pixel = Accumulator::default();
        pixel.add(Spectrum(halves(*bytes) * unscale));
        if labels.parts[i] != label::NONE {
            let (_, direction) = scene.camera.centre_ray((i % width).to_u32(), (i / width).to_u32());
            let distance = labels.depth[i] / direction.dot(forward).max(1e-6);
            pixel.add_first(labels.parts[i], Spectrum::ZERO, labels.normals[i], distance);
        }
        pixel.finish()
    });
    Film { window: labels.window, pixels: pixels.collect() }
}
