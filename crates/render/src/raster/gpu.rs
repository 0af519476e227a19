//! The GPU: opening it, uploading and reading back data.

use furrow_base::math::ToInt;
use furrow_base::{Error, Result};
use std::sync::{Arc, Mutex, PoisonError};
use wgpu::util::{BufferInitDescriptor, DeviceExt};
use wgpu::{
    Adapter, Backends, Buffer, BufferDescriptor, BufferUsages, COPY_BYTES_PER_ROW_ALIGNMENT, CommandEncoderDescriptor,
    Device, DeviceDescriptor, Extent3d, Instance, InstanceDescriptor, MapMode, PollType, PowerPreference, Queue,
    RequestAdapterOptions, TexelCopyBufferInfo, TexelCopyBufferLayout, Texture, TextureDescriptor, TextureDimension,
    TextureFormat, TextureUsages, TextureView, TextureViewDescriptor,
};

/// A GPU, or a software implementation.
pub(super) struct Gpu {
    pub(super) device: Device,
    pub(super) queue: Queue,
    name: String,
    /// First error reported by the device.
    fault: Arc<Mutex<Option<String>>>,
}

impl Gpu {
    /// Opens the fastest adapter. If there is none, returns [`Kind::Missing`](furrow_base::error::Kind::Missing) with
    /// the name of a package that provides one.
    pub(super) fn open() -> Result<Self> {
        let instance = Instance::new(InstanceDescriptor {
            backends: Backends::VULKAN,
            ..InstanceDescriptor::new_without_display_handle()
        });
        let options =
            RequestAdapterOptions { power_preference: PowerPreference::HighPerformance, ..Default::default() };
        let adapter = pollster::block_on(instance.request_adapter(&options)).map_err(|_| {
            Error::missing("--engine raster needs a Vulkan driver, and none was found").help(
                "apt-get install mesa-vulkan-drivers libvulkan1 \
                 installs one that runs on any processor",
            )
        })?;
        let name = name(&adapter);
        let wanted = DeviceDescriptor { required_limits: adapter.limits(), ..Default::default() };
        let (device, queue) = pollster::block_on(adapter.request_device(&wanted))
            .map_err(|e| Error::missing(format!("{name} cannot be used: {e}")).help("update its driver"))?;
        let fault = Arc::new(Mutex::new(None));
        let first_fault = Arc::clone(&fault);
        device.on_uncaptured_error(Arc::new(move |e: wgpu::Error| {
            first_fault.lock().unwrap_or_else(PoisonError::into_inner).get_or_insert_with(|| e.to_string());
        }));
        Ok(Self { device, queue, name, fault })
    }

    /// Returns [`Kind::Missing`](furrow_base::error::Kind::Missing) if an operation failed, nearly always for lack of
    /// memory. The error is permanent: among images rendered concurrently, the affected one cannot be identified.
    pub(super) fn check(&self) -> Result<()> {
        match self.fault.lock().unwrap_or_else(PoisonError::into_inner).as_deref().map(str::trim_end) {
            Some(words) => Err(Error::missing(format!("{}: {words}", self.name)).help("try a smaller --width")),
            None => Ok(()),
        }
    }

    /// Name and driver, which may change the last bits.
    pub(super) fn name(&self) -> &str {
        &self.name
    }

    /// Creates a buffer with this content.
    pub(super) fn buffer(&self, usage: BufferUsages, contents: &[u8]) -> Buffer {
        // Empty bindings are not allowed.
        let contents = if contents.is_empty() { &[0; 256] } else { contents };
        self.device.create_buffer_init(&BufferInitDescriptor { label: None, contents, usage })
    }

    /// Creates a render target that can be read back or sampled by other passes.
    pub(super) fn target(&self, (width, height): (u32, u32), format: TextureFormat, samples: u32) -> Texture {
        let once = TextureUsages::TEXTURE_BINDING | TextureUsages::COPY_SRC;
        let usage = TextureUsages::RENDER_ATTACHMENT | if samples == 1 { once } else { TextureUsages::empty() };
        self.texture((width, height), 1, 1, format, samples, usage)
    }

    /// Creates a texture with the given numbers of layers, mip levels and samples.
    pub(super) fn texture(
        &self,
        (width, height): (u32, u32),
        layers: u32,
        levels: u32,
        format: TextureFormat,
        samples: u32,
        usage: TextureUsages,
    ) -> Texture {
        self.device.create_texture(&TextureDescriptor {
            label: None,
            size: Extent3d { width, height, depth_or_array_layers: layers },
            mip_level_count: levels,
            sample_count: samples,
            dimension: TextureDimension::D2,
            format,
            usage,
            view_formats: &[],
        })
    }

    /// Creates a texture and uploads its mip levels, finest first.
    pub(super) fn picture(&self, size: (u32, u32), format: TextureFormat, levels: &[Vec<u8>]) -> TextureView {
        let usage = TextureUsages::TEXTURE_BINDING | TextureUsages::COPY_DST;
        let texture = self.texture(size, 1, levels.len().to_u32(), format, 1, usage);
        let bytes = format.block_copy_size(None).unwrap_or(4);
        for (level, data) in (0..).zip(levels) {
            let (width, height) = ((size.0 >> level).max(1), (size.1 >> level).max(1));
            let mut to = texture.as_image_copy();
            to.mip_level = level;
            let layout = TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(width * bytes), rows_per_image: None };
            self.queue.write_texture(to, data, layout, Extent3d { width, height, depth_or_array_layers: 1 });
        }
        view(&texture)
    }

    /// Reads back a target, row by row without the row padding that GPUs require.
    pub(super) fn read(&self, texture: &Texture) -> Result<Vec<u8>> {
        let (width, height) = (texture.width(), texture.height());
        let row = width * texture.format().block_copy_size(None).unwrap_or(4);
        let padded = row.next_multiple_of(COPY_BYTES_PER_ROW_ALIGNMENT);
        let buffer = self.device.create_buffer(&BufferDescriptor {
            label: None,
            size: u64::from(padded) * u64::from(height),
            usage: BufferUsages::COPY_DST | BufferUsages::MAP_READ,
            mapped_at_creation: false,
        });
        let mut encoder = self.device.create_command_encoder(&CommandEncoderDescriptor::default());
        let layout = TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(padded), rows_per_image: None };
        encoder.copy_texture_to_buffer(
            texture.as_image_copy(),
            TexelCopyBufferInfo { buffer: &buffer, layout },
            texture.size(),
        );
        self.queue.submit([encoder.finish()]);
        buffer.map_async(MapMode::Read, .., |_| ());
        self.check()?;
        let lost = |e: &dyn std::fmt::Display| {
            Error::missing(format!("{} stopped answering: {e}", self.name)).help("try a smaller --width")
        };
        self.device.poll(PollType::wait_indefinitely()).map_err(|e| lost(&e))?;
        let mapped = buffer.get_mapped_range(..).map_err(|e| lost(&e))?;
        Ok(mapped.chunks(padded.to_usize()).flat_map(|line| &line[..row.to_usize()]).copied().collect())
    }
}

/// Returns a view of a whole texture.
pub(super) fn view(texture: &Texture) -> TextureView {
    texture.create_view(&TextureViewDescriptor::default())
}

fn name(adapter: &Adapter) -> String {
    let info = adapter.get_info();
    format!("{}, {} {}", info.name, info.driver, info.driver_info)
}
