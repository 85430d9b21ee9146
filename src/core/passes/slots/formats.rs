//! Shapes and formats of the memory of slots.

#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Shape {
    Two([u32; 2]),
    Layers([u32; 3]),
    Three([u32; 3]),
    /// A buffer of this many bytes.
    Buffer(u32),
}

/// The format of a slot's texels. The numbers are those of SPIR-V's image formats; what no shader declares has one beyond them.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Format {
    R8 = 15,
    R16 = 14,
    R16f = 9,
    R32f = 3,
    Rg16 = 12,
    Rg16f = 7,
    Rg32f = 6,
    Rgba16f = 2,
    Rgba32f = 1,
    Rgba8 = 4,
    /// 8 bits a channel, blue first, as most windows store their pixels.
    Bgra8 = 1000,
    /// 32 bits of an unsigned integer.
    R32u = 33,
    Rg32u = 35,
    /// A buffer of 32-bit floats.
    Floats = 1001,
}

impl Format {
    pub fn channels(self) -> usize {
        match self {
            Format::R8 | Format::R16 | Format::R16f | Format::R32f | Format::R32u | Format::Floats => 1,
            Format::Rg16 | Format::Rg16f | Format::Rg32f | Format::Rg32u => 2,
            Format::Rgba16f | Format::Rgba32f | Format::Rgba8 | Format::Bgra8 => 4,
        }
    }

    pub fn channel_bytes(self) -> usize {
        match self {
            Format::R8 | Format::Rgba8 | Format::Bgra8 => 1,
            Format::R16 | Format::Rg16 | Format::R16f | Format::Rg16f | Format::Rgba16f => 2,
            Format::R32f | Format::Rg32f | Format::Rgba32f | Format::Floats | Format::R32u | Format::Rg32u => 4,
        }
    }

    pub fn texel_bytes(self) -> usize {
        self.channels() * self.channel_bytes()
    }
}

/// Values that the CPU computed from a scene, as the bytes of texels of a format: 8 bits of 0..1 for `R8`, otherwise the bits of the f32 values.
pub fn encoded(format: Format, values: &[f32]) -> Vec<u8> {
    match format {
        Format::R8 => values.iter().map(|value| (value * 255.0).round() as u8).collect(),
        _ => bytemuck::cast_slice(values).to_vec(),
    }
}

impl Shape {
    pub fn texels(self) -> u64 {
        match self {
            Shape::Two([w, h]) => u64::from(w) * u64::from(h),
            Shape::Layers(n) | Shape::Three(n) => n.iter().map(|n| u64::from(*n)).product(),
            Shape::Buffer(bytes) => u64::from(bytes) / 4,
        }
    }

    /// Number of texels along x, y and z; x varies fastest. A buffer counts as one row of 32-bit floats.
    pub fn size(self) -> [usize; 3] {
        match self {
            Shape::Two([w, h]) => [w as usize, h as usize, 1],
            Shape::Layers(n) | Shape::Three(n) => n.map(|n| n as usize),
            Shape::Buffer(bytes) => [bytes as usize / Format::Floats.texel_bytes(), 1, 1],
        }
    }

    /// Number of parts that barriers distinguish: slices of a 3D image, layers of an array, otherwise 1.
    pub fn parts(self) -> u32 {
        match self {
            Shape::Layers(n) | Shape::Three(n) => n[2],
            _ => 1,
        }
    }
}
