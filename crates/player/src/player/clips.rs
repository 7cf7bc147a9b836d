//! AV-Cloud's own model, clip by clip.

use crate::Ears;
use promenade_core::network::{CloudModel, Listener, Masks, Network, Placement};
use promenade_core::published::{ClipRenderer, PublishedError};
use promenade_core::{Pose, StftGrid};

/// A clip renderer with what it needs to hear a pose: network and masks.
pub struct ClipPlayer {
    placement: Placement,
    renderer: ClipRenderer,
    network: Network,
    masks: Masks,
    listener: Listener,
}

impl ClipPlayer {
    /// Prepares a model whose frames lie on a grid.
    ///
    /// # Errors
    /// A model or a grid that the published head does not take.
    pub fn new(model: &CloudModel, grid: StftGrid) -> Result<Self, PublishedError> {
        let renderer = ClipRenderer::new(model, grid)?;
        let (network, masks, listener) = (Network::new(model), Masks::new(&model.sizes()), model.listener(&Pose::IDENTITY));
        Ok(Self { placement: model.parts().placement, renderer, network, masks, listener })
    }

    /// Decodes the pose that the next clips are heard from.
    pub fn listen(&mut self, pose: &Pose) {
        self.listener = self.placement.listener(pose);
        self.network.decode(&self.listener, &mut self.masks);
    }

    /// Both ears of one clip, up to its last whole hop.
    ///
    /// # Errors
    /// A clip of another length than the model's.
    pub fn render(&mut self, dry: &[f32]) -> Result<Ears, PublishedError> {
        let mut ears = [(); 2].map(|()| vec![0.0; self.renderer.out_samples()]);
        let [left, right] = &mut ears;
        self.renderer.render(dry, &self.masks, &self.listener, [left, right])?;
        Ok(ears)
    }

    /// Both ears of a sound of any length, as overlapping clips; `pose_at` is given the seconds of each clip's middle.
    ///
    /// # Errors
    /// A model whose clips cannot overlap.
    pub fn render_long(&mut self, dry: &[f32], pose_at: &mut dyn FnMut(f64) -> Pose) -> Result<Ears, PublishedError> {
        self.renderer.render_long(dry, |seconds, masks| {
            let listener = self.placement.listener(&pose_at(seconds));
            self.network.decode(&listener, masks);
            listener
        })
    }
}
