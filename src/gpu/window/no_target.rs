//! The target of presentation in a build without the feature `view`. No value of it exists, so nothing here is ever called.

use crate::gpu::device_selection::Candidate;
use crate::gpu::error::GpuError;
use ash::{Entry, Instance};
use std::ffi::CStr;

/// See the module with the feature `view`.
pub enum Target {}

impl Target {
    pub fn extensions(&self, _: &Entry) -> Result<Vec<&'static CStr>, GpuError> {
        match *self {}
    }

    pub fn check_support(&self, _: &Entry, _: &Instance, _: &mut Candidate) {
        match *self {}
    }

    pub fn is_monitor(&self) -> bool {
        match *self {}
    }
}
