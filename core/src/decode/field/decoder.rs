//! Follows poses through a field.

use crate::decode::field::Cell;
use crate::decode::{Change, Decoder};
use crate::{LiveParams, Pose, Scene, TransferFunction};
use std::sync::Arc;

/// A listener's place in a scene's field.
pub(crate) struct FieldDecoder {
    scene: Arc<Scene>,
    cell: Cell,
    pose: Pose,
    transfer: TransferFunction,
}

impl FieldDecoder {
    /// `None` where the scene has no field.
    pub(crate) fn new(scene: &Arc<Scene>) -> Option<Self> {
        let (cell, transfer) = (scene.field()?.cell(), scene.shape().silent());
        Some(Self { scene: Arc::clone(scene), cell, pose: Pose::IDENTITY, transfer })
    }
}

impl Decoder for FieldDecoder {
    fn follow(&mut self, pose: &Pose, whole: bool, _params: &LiveParams) -> bool {
        let Some(field) = self.scene.field().filter(|_| whole || *pose != self.pose) else { return false };
        self.pose = *pose;
        field.locate(pose, &mut self.cell);
        field.masks(&mut self.cell, &mut self.transfer);
        true
    }

    fn update_filters(&mut self, change: &Change) {
        let Some(field) = self.scene.field() else { return };
        let late = field.shape().taps;
        for hop in (0..late).filter(|tap| change.names_tap(*tap)) {
            field.taps(&mut self.cell, hop..hop + 1, &mut self.transfer);
        }
        // All hops of the late part have one row of gains.
        if change.filters.iter().any(|hop| hop >= late) {
            field.taps(&mut self.cell, late..late + 1, &mut self.transfer);
        }
    }

    fn transfer(&self) -> &TransferFunction {
        &self.transfer
    }
}
