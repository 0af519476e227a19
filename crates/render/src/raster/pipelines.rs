//! Render pipelines of each pass: shaders, bind group layouts, formats.

use super::gpu::Gpu;
use super::vertices::STRIDE;
use furrow_base::math::ToInt;
use wgpu::{
    BindGroupLayout, BindGroupLayoutDescriptor, BindGroupLayoutEntry, BindingType, BufferBindingType, ColorTargetState,
    ColorWrites, CompareFunction, DepthBiasState, DepthStencilState, FragmentState, MultisampleState,
    PipelineCompilationOptions, PipelineLayoutDescriptor, PrimitiveState, RenderPipeline, RenderPipelineDescriptor,
    SamplerBindingType, ShaderModule, ShaderModuleDescriptor, ShaderSource, ShaderStages, StencilState, TextureFormat,
    TextureSampleType, TextureViewDimension, VertexBufferLayout, VertexState, VertexStepMode, vertex_attr_array,
};

/// Radiance of R, G, B, NIR.
pub(super) const RADIANCE: TextureFormat = TextureFormat::Rgba16Float;
/// Part at each pixel centre, from 1.
pub(super) const PARTS: TextureFormat = TextureFormat::R32Uint;
/// World position at each pixel centre.
pub(super) const POSITIONS: TextureFormat = TextureFormat::Rgba32Float;
/// Normal at each pixel centre.
pub(super) const NORMALS: TextureFormat = TextureFormat::Rgba16Float;
/// Ambient occlusion (1 where the whole sky is visible).
pub(super) const AMBIENT_OCCLUSION: TextureFormat = TextureFormat::R8Unorm;
/// Depth.
pub(super) const DEPTH: TextureFormat = TextureFormat::Depth32Float;

/// Bind group layouts and pipelines.
pub(super) struct Pipelines {
    /// View, per-part parameters, lights.
    pub(super) frame: BindGroupLayout,
    /// Textures of a sheet (material and mask).
    pub(super) sheet: BindGroupLayout,
    /// Shadow maps, ambient occlusion, sky.
    pub(super) around: BindGroupLayout,
    /// Matrix of a shadow map.
    pub(super) caster: BindGroupLayout,
    /// No bindings.
    pub(super) nothing: BindGroupLayout,
    /// Positions and normals.
    pub(super) surface: BindGroupLayout,
    /// Shadow map pass: depth from a light.
    pub(super) shadow: RenderPipeline,
    /// Label pass: ids, positions, normals.
    pub(super) label: RenderPipeline,
    /// Screen-space ambient occlusion pass.
    pub(super) occlude: RenderPipeline,
    /// Depth prepass of the image, with one and four samples per pixel.
    pub(super) nearest: [RenderPipeline; 2],
    /// Shading pass of the image, likewise.
    pub(super) shade: [RenderPipeline; 2],
    /// Background pass, likewise.
    pub(super) behind: [RenderPipeline; 2],
}

/// Samples per pixel of the image: without and with MSAA.
pub(super) const SAMPLES: [u32; 2] = [1, 4];

fn entry(binding: u32, ty: BindingType) -> BindGroupLayoutEntry {
    BindGroupLayoutEntry { binding, visibility: ShaderStages::VERTEX_FRAGMENT, ty, count: None }
}

fn texture(binding: u32, sample_type: TextureSampleType) -> BindGroupLayoutEntry {
    entry(binding, BindingType::Texture { sample_type, view_dimension: TextureViewDimension::D2, multisampled: false })
}

fn buffer(binding: u32, ty: BufferBindingType) -> BindGroupLayoutEntry {
    entry(binding, BindingType::Buffer { ty, has_dynamic_offset: false, min_binding_size: None })
}

impl Pipelines {
    pub(super) fn new(gpu: &Gpu) -> Self {
        let device = &gpu.device;
        let layout = |entries: &[BindGroupLayoutEntry]| {
            device.create_bind_group_layout(&BindGroupLayoutDescriptor { label: None, entries })
        };
        let storage = BufferBindingType::Storage { read_only: true };
        let fine = TextureSampleType::Float { filterable: true };
        let exact = TextureSampleType::Float { filterable: false };
        let filtering = BindingType::Sampler(SamplerBindingType::Filtering);
        let frame = layout(&[buffer(0, BufferBindingType::Uniform), buffer(1, storage), buffer(2, storage)]);
        let sheet =
            layout(&[texture(0, fine), texture(1, fine), texture(2, fine), texture(3, fine), entry(4, filtering)]);
        let maps = BindingType::Texture {
            sample_type: TextureSampleType::Depth,
            view_dimension: TextureViewDimension::D2Array,
            multisampled: false,
        };
        let comparing = BindingType::Sampler(SamplerBindingType::Comparison);
        let around =
            layout(&[entry(0, maps), entry(1, comparing), texture(2, fine), texture(3, exact), entry(4, filtering)]);
        let caster = layout(&[buffer(0, BufferBindingType::Uniform)]);
        let surface = layout(&[texture(0, exact), texture(1, exact)]);
        let nothing = layout(&[]);
        let module = |source: &'static str| {
            device
                .create_shader_module(ShaderModuleDescriptor { label: None, source: ShaderSource::Wgsl(source.into()) })
        };
        let scene = module(concat!(include_str!("view.wgsl"), include_str!("scene.wgsl")));
        let occlusion = module(concat!(include_str!("view.wgsl"), include_str!("occlusion.wgsl")));
        let pass = |of: &PipelineParameters<'_>| of.pipeline(gpu);
        let all = [Some(&frame), Some(&sheet), Some(&around)];
        let draw = PipelineParameters { vertex: "corner", corners: true, ..PipelineParameters::of(&scene, &all) };
        let back = PipelineParameters { depth: Some(CompareFunction::Always), ..PipelineParameters::of(&scene, &all) };
        let nearest = SAMPLES
            .map(|samples| pass(&PipelineParameters { fragment: "nearest", samples, layouts: &all[..2], ..draw }));
        let depth = Some(CompareFunction::Equal);
        let shade = SAMPLES.map(|samples| {
            pass(&PipelineParameters { fragment: "shade", samples, targets: &[RADIANCE], depth, ..draw })
        });
        let behind = SAMPLES.map(|samples| {
            pass(&PipelineParameters { vertex: "screen", fragment: "behind", samples, targets: &[RADIANCE], ..back })
        });
        let label = pass(&PipelineParameters {
            vertex: "corner",
            fragment: "label",
            targets: &[PARTS, POSITIONS, NORMALS],
            corners: true,
            ..PipelineParameters::of(&scene, &[Some(&frame), Some(&sheet)])
        });
        let shadow = pass(&PipelineParameters {
            vertex: "caster",
            fragment: "cover",
            depth: Some(CompareFunction::LessEqual),
            corners: true,
            ..PipelineParameters::of(&scene, &[Some(&nothing), Some(&sheet), Some(&nothing), Some(&caster)])
        });
        let occlude = pass(&PipelineParameters {
            vertex: "screen",
            fragment: "occlude",
            targets: &[AMBIENT_OCCLUSION],
            depth: None,
            ..PipelineParameters::of(&occlusion, &[Some(&frame), Some(&surface)])
        });
        Self { frame, sheet, around, caster, nothing, surface, shadow, label, occlude, nearest, shade, behind }
    }
}

/// Parameters of a pipeline.
#[derive(Clone, Copy)]
struct PipelineParameters<'a> {
    module: &'a ShaderModule,
    layouts: &'a [Option<&'a BindGroupLayout>],
    vertex: &'a str,
    fragment: &'a str,
    targets: &'a [TextureFormat],
    samples: u32,
    /// `true` to draw vertices, `false` for one full-screen triangle.
    corners: bool,
    /// Depth test; `None` for a pass without depth. Depth is reversed (1 near, 0 far) except in shadow maps.
    depth: Option<CompareFunction>,
}

impl<'a> PipelineParameters<'a> {
    fn of(module: &'a ShaderModule, layouts: &'a [Option<&'a BindGroupLayout>]) -> Self {
        Self {
            module,
            layouts,
            vertex: "",
            fragment: "",
            targets: &[],
            samples: 1,
            corners: false,
            depth: Some(CompareFunction::Greater),
        }
    }

    fn pipeline(&self, gpu: &Gpu) -> RenderPipeline {
        let attributes =
            vertex_attr_array![0 => Float32x4, 1 => Float32x3, 2 => Float32x3, 3 => Float32x2, 4 => Uint32];
        let corners = VertexBufferLayout {
            array_stride: STRIDE.to_u64() * 4,
            step_mode: VertexStepMode::Vertex,
            attributes: &attributes,
        };
        let buffers = if self.corners { vec![Some(corners)] } else { Vec::new() };
        let layout = gpu.device.create_pipeline_layout(&PipelineLayoutDescriptor {
            label: None,
            bind_group_layouts: self.layouts,
            immediate_size: 0,
        });
        let targets: Vec<Option<ColorTargetState>> = self
            .targets
            .iter()
            .map(|format| Some(ColorTargetState { format: *format, blend: None, write_mask: ColorWrites::ALL }))
            .collect();
        gpu.device.create_render_pipeline(&RenderPipelineDescriptor {
            label: Some(self.fragment),
            layout: Some(&layout),
            vertex: VertexState {
                module: self.module,
                entry_point: Some(self.vertex),
                compilation_options: PipelineCompilationOptions::default(),
                buffers: &buffers,
            },
            // No culling: leaves have two sides.
            primitive: PrimitiveState::default(),
            depth_stencil: self.depth.map(|compare| DepthStencilState {
                format: DEPTH,
                depth_write_enabled: Some(matches!(compare, CompareFunction::Greater | CompareFunction::LessEqual)),
                depth_compare: Some(compare),
                stencil: StencilState::default(),
                bias: DepthBiasState::default(),
            }),
            multisample: MultisampleState { count: self.samples, ..Default::default() },
            fragment: Some(FragmentState {
                module: self.module,
                entry_point: Some(self.fragment),
                compilation_options: PipelineCompilationOptions::default(),
                targets: &targets,
            }),
            multiview_mask: None,
            cache: None,
        })
    }
}
