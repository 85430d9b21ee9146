//! What a texel is made of, and how many there are.

#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Shape {
    Two([u32; 2]),
    Layers([u32; 3]),
    Three([u32; 3]),
    /// Bytes.
    Buffer(u32),
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Format {
    R8,
    R16,
    R16f,
    R32f,
    Rg16,
    Rg16f,
    Rg32f,
    Rgba16f,
    Rgba32f,
    Rgba8,
    /// Bits.
    R32u,
    Rg32u,
    /// 32-bit floats of a buffer.
    Floats,
}

impl Format {
    pub fn channels(self) -> usize {
        match self {
            Format::R8 | Format::R16 | Format::R16f | Format::R32f | Format::R32u | Format::Floats => 1,
            Format::Rg16 | Format::Rg16f | Format::Rg32f | Format::Rg32u => 2,
            Format::Rgba16f | Format::Rgba32f | Format::Rgba8 => 4,
        }
    }

    pub fn channel_bytes(self) -> usize {
        match self {
            Format::R8 | Format::Rgba8 => 1,
            Format::R16 | Format::Rg16 | Format::R16f | Format::Rg16f | Format::Rgba16f => 2,
            Format::R32f | Format::Rg32f | Format::Rgba32f | Format::Floats | Format::R32u | Format::Rg32u => 4,
        }
    }

    pub fn texel_bytes(self) -> usize {
        self.channels() * self.channel_bytes()
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

    /// Slices of a 3D image, layers of an array, 1 otherwise: what a barrier tells apart.
    pub fn parts(self) -> u32 {
        match self {
            Shape::Layers(n) | Shape::Three(n) => n[2],
            _ => 1,
        }
    }
}
