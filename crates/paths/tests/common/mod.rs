//! What the tests of files share.

#![allow(dead_code, unreachable_pub, reason = "each test uses a part of it")]

use base64::Engine;
use serde_json::{Value, json};

/// A glTF file in the making.
pub struct Gltf {
    pub json: Value,
    pub bytes: Vec<u8>,
}

impl Gltf {
    pub fn new() -> Self {
        let json = json!({
            "asset": {"version": "2.0"},
            "nodes": [], "animations": [], "accessors": [], "bufferViews": [],
            "cameras": [{"type": "perspective", "perspective": {"yfov": 0.8, "znear": 0.1}, "name": "Lens"}],
        });
        Self { json, bytes: Vec::new() }
    }

    fn add(&mut self, list: &str, value: Value) -> usize {
        let list = self.json[list].as_array_mut().unwrap();
        list.push(value);
        list.len() - 1
    }

    /// A node; its number.
    pub fn node(&mut self, node: Value) -> usize {
        self.add("nodes", node)
    }

    /// An accessor over new bytes; its number.
    pub fn accessor(&mut self, component: u32, kind: &str, count: usize, bytes: &[u8]) -> usize {
        let view = json!({"buffer": 0, "byteOffset": self.bytes.len(), "byteLength": bytes.len()});
        self.bytes.extend_from_slice(bytes);
        self.bytes.resize(self.bytes.len().next_multiple_of(4), 0);
        let view = self.add("bufferViews", view);
        let accessor = json!({"bufferView": view, "componentType": component, "type": kind, "count": count});
        self.add("accessors", accessor)
    }

    /// An accessor of floats; its number.
    pub fn floats(&mut self, kind: &str, values: &[f32]) -> usize {
        let width = match kind {
            "SCALAR" => 1,
            "VEC3" => 3,
            _ => 4,
        };
        let bytes: Vec<u8> = values.iter().flat_map(|v| v.to_le_bytes()).collect();
        self.accessor(5126, kind, values.len() / width, &bytes)
    }

    /// An animation with no channel; its number.
    pub fn animation(&mut self, name: &str) -> usize {
        self.add("animations", json!({"name": name, "channels": [], "samplers": []}))
    }

    /// A channel of an animation between accessors.
    pub fn channel(&mut self, animation: usize, node: usize, path: &str, interpolation: &str, [input, output]: [usize; 2]) {
        let animation = &mut self.json["animations"][animation];
        let samplers = animation["samplers"].as_array_mut().unwrap();
        samplers.push(json!({"input": input, "output": output, "interpolation": interpolation}));
        let sampler = samplers.len() - 1;
        let channel = json!({"sampler": sampler, "target": {"node": node, "path": path}});
        animation["channels"].as_array_mut().unwrap().push(channel);
    }

    /// A channel over new accessors.
    pub fn animate(&mut self, animation: usize, node: usize, path: &str, interpolation: &str, times: &[f32], values: &[f32]) {
        let input = self.floats("SCALAR", times);
        let output = self.floats(if path == "rotation" { "VEC4" } else { "VEC3" }, values);
        self.channel(animation, node, path, interpolation, [input, output]);
    }

    /// JSON whose buffer is a file beside it.
    pub fn beside(&self, uri: &str) -> Vec<u8> {
        let mut json = self.json.clone();
        json["buffers"] = json!([{"byteLength": self.bytes.len(), "uri": uri}]);
        serde_json::to_vec_pretty(&json).unwrap()
    }

    /// JSON with its buffer inside.
    pub fn embedded(&self) -> Vec<u8> {
        let coded = base64::engine::general_purpose::STANDARD.encode(&self.bytes);
        self.beside(&format!("data:application/octet-stream;base64,{coded}"))
    }

    /// A GLB file.
    pub fn glb(&self) -> Vec<u8> {
        let mut json = self.json.clone();
        json["buffers"] = json!([{"byteLength": self.bytes.len()}]);
        let mut json = serde_json::to_vec(&json).unwrap();
        json.resize(json.len().next_multiple_of(4), b' ');
        let size = |length: usize| u32::try_from(length).unwrap().to_le_bytes();
        let mut file = b"glTF".to_vec();
        file.extend(2_u32.to_le_bytes());
        file.extend(size(12 + 8 + json.len() + 8 + self.bytes.len()));
        file.extend(size(json.len()));
        file.extend(b"JSON");
        file.extend(json);
        file.extend(size(self.bytes.len()));
        file.extend(b"BIN\0");
        file.extend(&self.bytes);
        file
    }
}

/// A camera on a cart that goes round: the cart's node moves and turns, the camera's nods, under a root that scales and turns.
pub fn cart() -> Gltf {
    let mut gltf = Gltf::new();
    let half = std::f32::consts::FRAC_1_SQRT_2;
    let root = gltf.node(json!({"name": "root", "children": [1], "scale": [2.0, 2.0, 2.0], "translation": [0.0, 1.0, 0.0]}));
    let cart = gltf.node(json!({"name": "cart", "children": [2]}));
    let camera = gltf.node(json!({"name": "eye", "camera": 0, "translation": [0.0, 0.5, 0.0]}));
    assert_eq!((root, cart, camera), (0, 1, 2));
    let animation = gltf.animation("ride");
    gltf.animate(animation, cart, "translation", "LINEAR", &[0.5, 2.5], &[0.0, 0.0, 0.0, 0.0, 0.0, -2.0]);
    gltf.animate(animation, cart, "rotation", "LINEAR", &[0.5, 1.5], &[0.0, 0.0, 0.0, 1.0, 0.0, half, 0.0, half]);
    gltf.animate(animation, camera, "translation", "STEP", &[0.0, 2.0], &[0.0, 0.5, 0.0, 0.0, 0.75, 0.0]);
    gltf
}
