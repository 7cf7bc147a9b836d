//! Softmax over rows with a derivative of its own: burn's is made of its parts, which takes a training's longest arrays through
//! memory a dozen times.

use burn::backend::autodiff::checkpoint::base::Checkpointer;
use burn::backend::autodiff::checkpoint::strategy::CheckpointStrategy;
use burn::backend::autodiff::grads::Gradients;
use burn::backend::autodiff::ops::{Backward, Ops, OpsKind, unary};
use burn::backend::tensor::FloatTensor;
use burn::backend::{Autodiff, Backend, Dispatch, TensorMetadata, backend_extension};
use burn::tensor::Tensor;

/// Softmax over the last dimension.
pub(crate) fn softmax<const D: usize>(x: Tensor<D>) -> Tensor<D> {
    Tensor::from_dispatch(<Dispatch as SoftmaxRows>::softmax_rows(x.into_dispatch()))
}

#[backend_extension(Flex, Cube: cfg(feature = "gpu"), Autodiff)]
pub(crate) trait SoftmaxRows: Backend {
    fn softmax_rows(x: FloatTensor<Self>) -> FloatTensor<Self> {
        let last = x.shape().num_dims() - 1;
        Self::softmax(x, last)
    }
}

impl SoftmaxRows for burn::backend::Flex {}

#[cfg(feature = "gpu")]
impl SoftmaxRows for burn::backend::Cube {}

/// For `y = softmax(x)`: `dL/dx = y (dL/dy - sum of y dL/dy)`.
#[derive(Debug)]
struct SoftmaxStep;

impl<B: Backend> Backward<B, 1> for SoftmaxStep {
    type State = FloatTensor<B>;

    fn backward(self, ops: Ops<Self::State, 1>, gradients: &mut Gradients, _: &mut Checkpointer) {
        let y = ops.state;
        let last = y.shape().num_dims() - 1;
        unary::<B, _>(ops.parents, ops.node, gradients, |by_y| {
            let product = B::float_mul(by_y, y.clone());
            let sums = B::float_sum_dim(product.clone(), last);
            B::float_sub(product, B::float_mul(y, sums))
        });
    }
}

impl<B: SoftmaxRows, C: CheckpointStrategy> SoftmaxRows for Autodiff<B, C> {
    fn softmax_rows(x: FloatTensor<Self>) -> FloatTensor<Self> {
        let y = B::softmax_rows(x.primitive().clone());
        match SoftmaxStep.prepare::<C>([x.node()]).compute_bound().stateful() {
            OpsKind::Tracked(prep) => prep.finish(y.clone(), y),
            OpsKind::UnTracked(prep) => prep.finish(y),
        }
    }
}
