//! The shaders as SPIR-V: [`reflect()`] reads the interface that a module declares. The other modules rewrite a shader when its
//! pipeline is made: for a scene (`strip_bindings`, `volumes_to_layers`), for a software device (`hoist_uniforms`, `texture_to_storage`,
//! `storage_to_texel_buffer`), for a validation layer (`specialize`, `dead_code`), for fault injection (`mutate`), and for programs without
//! arrays of images (`one_layer`).

mod classes;
pub mod dead_code;
pub(crate) mod hoist_uniforms;
mod module;
pub mod mutants;
pub mod mutate;
pub mod one_layer;
mod reflect;
pub mod specialize;
pub(crate) mod storage_to_texel_buffer;
pub(crate) mod strip_bindings;
pub(crate) mod texture_to_storage;
pub(crate) mod volumes_to_layers;

pub use classes::{classes, has_votes};
pub use module::{EMBEDDED, SOURCES, SpirvError, embedded, set_tool_version, words};
pub use reflect::{Access, Binding, Constant, Dimension, Kind, Member, Module, reflect};
