//! The anchor cloud in a manifest.

use crate::network::{CloudEmitter, CloudKind, DELAY_SHAPES, Placement, PoseConvention};
use crate::published::{ConvMode, Projection};
use crate::scene::AnchorCloud;
use glam::Quat;
use serde::{Deserialize, Serialize};

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(in crate::scene) struct ManifestCloud {
    kind: String,
    pub(in crate::scene) heads: usize,
    pub(in crate::scene) max_norm: f32,
    convention: String,
    scale: f32,
    /// w, x, y, z.
    rotation: [f32; 4],
    translation: [f32; 3],
    /// How the convolution layers are used: off, causal or look-ahead.
    conv: String,
    /// Row of the time filter that its taps are; without one they are the averages of its diagonals.
    row: Option<usize>,
    /// Absent in files of scenes without any.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    emitter: Option<ManifestEmitter>,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct ManifestEmitter {
    position: [f32; 3],
    head_radius_m: f32,
    /// Absent where the head is a sphere.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    delay_shape_ms: Option<[f32; DELAY_SHAPES]>,
}

impl ManifestCloud {
    pub(in crate::scene) fn of(cloud: &AnchorCloud) -> Self {
        let parts = cloud.model.parts();
        let Placement { units_per_metre: scale, rotation: q, origin } = parts.placement;
        Self {
            kind: parts.kind.name().to_owned(),
            heads: parts.heads,
            max_norm: parts.max_norm,
            convention: parts.convention.name().to_owned(),
            scale,
            rotation: [q.w, q.x, q.y, q.z],
            translation: origin.to_array(),
            conv: cloud.conv.name().to_owned(),
            row: match cloud.projection {
                Projection::Diagonal => None,
                Projection::Row(row) => Some(row),
            },
            emitter: cloud.emitter.map(|e| ManifestEmitter {
                position: e.position.to_array(),
                head_radius_m: e.head_radius_m,
                delay_shape_ms: Some(e.delay_shape_ms).filter(|shape| shape.iter().any(|factor| *factor != 0.0)),
            }),
        }
    }

    pub(in crate::scene) fn emitter(&self) -> Option<CloudEmitter> {
        self.emitter.as_ref().map(|e| CloudEmitter {
            position: e.position.into(),
            head_radius_m: e.head_radius_m,
            delay_shape_ms: e.delay_shape_ms.unwrap_or_default(),
        })
    }

    pub(in crate::scene) fn conv(&self) -> Option<ConvMode> {
        ConvMode::from_name(&self.conv)
    }

    pub(in crate::scene) fn projection(&self) -> Projection {
        self.row.map_or(Projection::Diagonal, Projection::Row)
    }

    pub(in crate::scene) fn kind(&self) -> Option<CloudKind> {
        CloudKind::from_name(&self.kind)
    }

    pub(in crate::scene) fn convention(&self) -> Option<PoseConvention> {
        PoseConvention::from_name(&self.convention)
    }

    pub(in crate::scene) fn placement(&self) -> Placement {
        let [w, x, y, z] = self.rotation;
        let rotation = Quat::from_xyzw(x, y, z, w);
        Placement { units_per_metre: self.scale, rotation, origin: self.translation.into() }
    }
}
