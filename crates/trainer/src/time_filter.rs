//! AV-Cloud's time filters as a graph that can be differentiated (Chen and Shlizerman, "AV-Cloud", NeurIPS 2024, section 3.3;
//! names and layouts of weights as in `promenade_core::published`).

use crate::network::Graph;
use crate::weights::NEIGHBOURS;
use burn::tensor::Tensor;
use burn::tensor::activation::relu;

impl Graph {
    /// Filters masked magnitudes, `[listener][frame][band]`, by one matrix over frames for all bands, and adds a bias: both are
    /// sums over anchors of spherical harmonics, `[anchor][harmonic][listener]`, times features.
    #[must_use]
    pub(crate) fn harmonic_filter(&self, masked: &Tensor<3>, harmonics: Tensor<3>) -> Tensor<3> {
        let [batch, frames, bands] = masked.dims();
        let [anchors, count, _] = harmonics.dims();
        // Band weights of each anchor, [listener][anchor][band].
        let by_band = self.get("time_freq_weights").reshape([anchors, bands, count]).matmul(harmonics).permute([2, 0, 1]);
        let by_frame = by_band.clone().reshape([batch * anchors, bands]).matmul(self.get("time_weights"));
        let by_frame = by_frame.reshape([batch, anchors, frames]) * (1.0 / (bands as f64).sqrt());
        let features = self.get("_acoustic_features_t") * (1.0 / (anchors as f64).sqrt());
        let inputs = features.clone().slice([0..anchors, 0..frames]);
        let biases = features.slice([0..anchors, frames..2 * frames]);
        let kernel = by_frame.swap_dims(1, 2).matmul(inputs.unsqueeze::<3>());
        kernel.matmul(masked.clone()) + biases.transpose().unsqueeze::<3>().matmul(by_band)
    }

    /// Filters masked magnitudes, `[listener][frame][band]`, by a matrix over frames and neighbouring bands that a network
    /// makes of each band's embedding, and adds a bias. Kernels are sums of one matrix per hidden unit, so they are never
    /// formed.
    #[must_use]
    pub(crate) fn hyper_filter(&self, masked: &Tensor<3>, embedding: &Tensor<3>) -> Tensor<3> {
        let [batch, frames, bands] = masked.dims();
        let width = embedding.dims()[2];
        let rows = batch * bands;
        let below = Tensor::zeros([batch, NEIGHBOURS - 1, frames], &masked.device());
        let padded = Tensor::cat(vec![below, masked.clone().swap_dims(1, 2)], 1);
        let lower = |by: usize| {
            let first = NEIGHBOURS - 1 - by;
            padded.clone().slice([0..batch, first..first + bands, 0..frames])
        };
        let inputs = Tensor::cat((0..NEIGHBOURS).map(lower).collect(), 2).reshape([rows, NEIGHBOURS * frames]);
        let embedding = embedding.clone().reshape([rows, width]);
        let hidden = relu(self.linear("post_process.weight_model.0", embedding.clone()));
        let units = hidden.dims()[1];
        let by_unit = self.get("post_process.weight_model.2.weight").reshape([NEIGHBOURS * frames, frames * units]);
        let by_unit = inputs.clone().matmul(by_unit).reshape([rows, frames, units]);
        let live = (by_unit * hidden.unsqueeze_dim::<3>(1)).sum_dim(2).reshape([rows, frames]);
        let constant = self.get("post_process.weight_model.2.bias").reshape([NEIGHBOURS * frames, frames]);
        let bias = self.linear("post_process.bias_model.2", relu(self.linear("post_process.bias_model.0", embedding)));
        (live + inputs.matmul(constant) + bias).reshape([batch, bands, frames]).swap_dims(1, 2)
    }
}
