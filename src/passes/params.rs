//! Numbers of one dispatch.

use crate::scene::Scene;
use glam::DVec3;

#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Value {
    F32(f32),
    I32(i32),
    Vec2([f32; 2]),
    Vec3([f32; 3]),
    Vec4([f32; 4]),
}

/// Numbers of one dispatch, by the names that the shader gives them.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Params(pub Vec<(&'static str, Value)>);

fn finite(value: f64) -> f32 {
    value.clamp(-f64::from(f32::MAX), f64::from(f32::MAX)) as f32
}

impl Params {
    /// Clamped to what is finite: shaders need not keep infinities.
    pub fn f32(mut self, name: &'static str, value: f64) -> Params {
        self.0.push((name, Value::F32(finite(value))));
        self
    }

    pub fn i32(mut self, name: &'static str, value: u32) -> Params {
        self.0.push((name, Value::I32(value as i32)));
        self
    }

    pub fn vec2(mut self, name: &'static str, value: [f64; 2]) -> Params {
        self.0.push((name, Value::Vec2(value.map(finite))));
        self
    }

    pub fn vec4(mut self, name: &'static str, value: [f64; 4]) -> Params {
        self.0.push((name, Value::Vec4(value.map(finite))));
        self
    }

    pub fn vec3(mut self, name: &'static str, value: impl Into<DVec3>) -> Params {
        self.0.push((name, Value::Vec3(value.into().to_array().map(finite))));
        self
    }
}

/// The rays of a scene, as every shader that casts or retraces them names them.
pub fn ray_params(scene: &Scene) -> Params {
    let rays = &scene.rays;
    Params::default()
        .vec3("origin", rays.origin)
        .vec3("origin_dx", rays.origin_dx)
        .vec3("origin_dy", rays.origin_dy)
        .vec3("direction", rays.direction)
        .vec3("direction_dx", rays.direction_dx)
        .vec3("direction_dy", rays.direction_dy)
}
