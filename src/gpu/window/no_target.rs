//! Takes the place of `window` in a build without the feature `view`: there is no target, so nothing of this is ever called.

use crate::gpu::device_selection::Candidate;
use crate::gpu::error::GpuError;
use ash::{Entry, Instance};
use std::ffi::CStr;

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
