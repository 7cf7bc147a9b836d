//! A node, its parents, and where they put it over time.

use super::curve::Curve;
use super::document::Document;
use super::subject::Subject;
use crate::PathFileError;
use glam::{DAffine3, DMat4, DQuat, DVec3, DVec4};
use gltf::json::animation::{Property, Sampler};
use gltf::json::validation::Checked;

/// A node and its parents, the node last.
pub(super) struct Chain {
    links: Vec<Link>,
}

/// A node's place in its parent, and what moves it.
struct Link {
    translation: DVec3,
    rotation: DQuat,
    scale: DVec3,
    translations: Option<Curve<DVec3>>,
    rotations: Option<Curve<DVec4>>,
    scales: Option<Curve<DVec3>>,
}

impl Chain {
    pub(super) fn new(document: &mut Document<'_, '_>, subject: &Subject) -> Result<Self, PathFileError> {
        let links = subject.chain.iter().map(|node| Link::new(document, subject.animation, *node));
        let links = links.collect::<Result<Vec<_>, _>>()?;
        Ok(Self { links })
    }

    /// From the node's axes to the world's.
    pub(super) fn world(&self, t_s: f64) -> DAffine3 {
        self.links.iter().map(|link| link.local(t_s)).fold(DAffine3::IDENTITY, |parent, local| parent * local)
    }

    /// All times of keys, rising, each once.
    pub(super) fn keys(&self) -> Vec<f64> {
        let mut times: Vec<f64> = self.links.iter().flat_map(Link::times).copied().collect();
        times.sort_by(f64::total_cmp);
        times.dedup();
        times
    }
}

impl Link {
    fn new(document: &mut Document<'_, '_>, animation: usize, index: usize) -> Result<Self, PathFileError> {
        let node = document.root.nodes.get(index);
        let (mut translation, mut rotation, mut scale) = (DVec3::ZERO, DQuat::IDENTITY, DVec3::ONE);
        if let Some(node) = node {
            if let Some(m) = node.matrix {
                (scale, rotation, translation) = DMat4::from_cols_array(&m.map(f64::from)).to_scale_rotation_translation();
            }
            translation = node.translation.map_or(translation, |t| DVec3::from_array(t.map(f64::from)));
            rotation = node.rotation.map_or(rotation, |r| DQuat::from_array(r.0.map(f64::from)).normalize());
            scale = node.scale.map_or(scale, |s| DVec3::from_array(s.map(f64::from)));
        }
        if !(translation.is_finite() && rotation.is_finite() && scale.is_finite()) {
            return Err(document.wrong(format!("node {index}"), "a transform", "one that is not finite"));
        }
        let sampler = |document: &Document<'_, '_>, property| sampler(document, animation, index, property);
        let of = |property| format!("animation {animation}, {property} of node {index}");
        let mut link = Self { translation, rotation, scale, translations: None, rotations: None, scales: None };
        if let Some(sampler) = sampler(document, Property::Translation)? {
            link.translations = Some(Curve::read(document, &of("translation"), &sampler, DVec3::from_array)?);
        }
        if let Some(sampler) = sampler(document, Property::Rotation)? {
            link.rotations = Some(Curve::read(document, &of("rotation"), &sampler, DVec4::from_array)?);
        }
        if let Some(sampler) = sampler(document, Property::Scale)? {
            link.scales = Some(Curve::read(document, &of("scale"), &sampler, DVec3::from_array)?);
        }
        Ok(link)
    }

    fn local(&self, t_s: f64) -> DAffine3 {
        let translation = self.translations.as_ref().map_or(self.translation, |c| c.vector(t_s));
        let rotation = self.rotations.as_ref().map_or(self.rotation, |c| c.rotation(t_s));
        let scale = self.scales.as_ref().map_or(self.scale, |c| c.vector(t_s));
        DAffine3::from_scale_rotation_translation(scale, rotation, translation)
    }

    fn times(&self) -> impl Iterator<Item = &f64> {
        let vectors = [&self.translations, &self.scales].into_iter().flatten().flat_map(Curve::times_s);
        vectors.chain(self.rotations.iter().flat_map(Curve::times_s))
    }
}

/// What moves a property of a node, if anything does.
fn sampler(
    document: &Document<'_, '_>,
    animation: usize,
    node: usize,
    property: Property,
) -> Result<Option<Sampler>, PathFileError> {
    let Some(animated) = document.root.animations.get(animation) else { return Ok(None) };
    let aims = |c: &&gltf::json::animation::Channel| c.target.node.value() == node && c.target.path == Checked::Valid(property);
    let Some(channel) = animated.channels.iter().find(aims) else { return Ok(None) };
    match animated.samplers.get(channel.sampler.value()) {
        Some(sampler) => Ok(Some(sampler.clone())),
        None => {
            let expected = format!("a channel with one of {} samplers", animated.samplers.len());
            Err(document.wrong(format!("animation {animation}"), expected, format!("number {}", channel.sampler.value())))
        }
    }
}
