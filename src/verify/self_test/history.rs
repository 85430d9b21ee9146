//! Public bugs of drivers that occurred in practice, and the injected fault that recreates each. They show that the checks detect real
//! bugs, not only invented ones.

/// A publicly reported bug of a driver, and the injected fault that recreates it.
pub struct KnownBug {
    /// Name of the injected fault.
    pub fault: &'static str,
    /// The driver that had the bug, or the layer above it.
    pub driver: &'static str,
    /// What the driver did wrong.
    pub what: &'static str,
    /// Where it was reported: an address or a file.
    pub source: &'static str,
}

/// All known bugs, in the order of the table in docs/verify.md.
pub const KNOWN_BUGS: &[KnownBug] = &[
    KnownBug {
        fault: "half precision",
        driver: "Intel, Skylake (OpenGL ES)",
        what: "mix() was computed with 16 bits and lost what blending needs",
        source: "https://github.com/WebGLSamples/WebGLSamples.github.io/issues/4",
    },
    KnownBug {
        fault: "wrong rounding",
        driver: "lavapipe, LLVM 20",
        what: "a filtered value between two levels of 8 bits came out one level too low",
        source: "https://github.com/gfx-rs/wgpu/issues/8617",
    },
    KnownBug {
        fault: "gamma left out",
        driver: "MoltenVK",
        what: "a specialization constant was not applied to the workgroup's size, which kept its default",
        source: "https://github.com/KhronosGroup/MoltenVK/issues/188",
    },
    KnownBug {
        fault: "dropped barrier",
        driver: "RADV, GFX11.5",
        what: "dispatches of one submission read zeros although barriers stand between them; one submission each was right",
        source: "https://github.com/kvark/blade/issues/356",
    },
    KnownBug {
        fault: "off-by-one LUT",
        driver: "Intel HD 530, macOS 10.12",
        what: "integer arithmetic gave the address of another entry of a look-up table",
        source: "https://github.com/servo/webrender/pull/1810",
    },
    KnownBug {
        fault: "lost last step",
        driver: "Mesa 17.1.3, Intel",
        what: "a loop that is left early inside another block ended at another iteration",
        source: "https://github.com/mc-imperial/shader-compiler-bugs/issues/75",
    },
    KnownBug {
        fault: "parameters of the dispatch before",
        driver: "NVIDIA 516",
        what: "uniform buffers as close as the stated alignment allows were read at another offset",
        source: "https://github.com/scenerygraphics/scenery/pull/486",
    },
    KnownBug {
        fault: "lost register",
        driver: "AMD Adrenalin 24.12 and 25.6, RX 5700",
        what: "with many values alive a shader wrote wrong data",
        source: "https://github.com/GPUOpen-Drivers/AMD-Gfx-Drivers/issues/59",
    },
    KnownBug {
        fault: "nearest neighbour",
        driver: "lavapipe, Mesa 25.0.7 and 26.2.6",
        what: "the immutable sampler of a pushed descriptor set was lost, and that of an earlier push was used",
        source: "tools/drivers.d/pushed_immutable_sampler.c",
    },
    KnownBug {
        fault: "driver crash",
        driver: "RADV",
        what: "SIGFPE in vkCreateComputePipelines with a specialized workgroup size and subgroup operations",
        source: "https://github.com/baldurk/renderdoc/issues/3803",
    },
    KnownBug {
        fault: "stale slice",
        driver: "OpenGL ES below wgpu",
        what: "a copy of a 3D texture wrote its first slice, and all others kept what they held",
        source: "https://github.com/gfx-rs/wgpu/issues/9992",
    },
    KnownBug {
        fault: "wrong row pitch",
        driver: "gfx-hal below WebRender",
        what: "rows of an upload that are not as long as the copy's alignment were shifted, each by more",
        source: "https://github.com/szeged/webrender/issues/89",
    },
];

/// The public bugs that an injected fault of this name recreates.
pub(super) fn of(fault: &str) -> impl Iterator<Item = &'static KnownBug> {
    KNOWN_BUGS.iter().filter(move |bug| bug.fault == fault)
}
