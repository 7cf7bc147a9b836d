//! Arithmetic on a few vectors at a time.
//!
//! As functions with loops: a closure, or an iterator over vectors, is compiled without the vector instructions of what it is
//! used in.

use pulp::Simd;

macro_rules! each {
    ($(#[$doc:meta] $name:ident = $op:ident($($argument:ident),+);)+) => { $(
        #[$doc]
        #[inline(always)]
        pub(crate) fn $name<S: Simd, const V: usize>(simd: S, $($argument: [S::f32s; V]),+) -> [S::f32s; V] {
            let mut out = [simd.splat_f32s(0.0); V];
            for v in 0..V {
                out[v] = simd.$op($($argument[v]),+);
            }
            out
        }
    )+ };
}

each! {
    /// `a + b`.
    plus = add_f32s(a, b);
    /// `a - b`.
    minus = sub_f32s(a, b);
    /// `a b`.
    times = mul_f32s(a, b);
    /// `a / b`.
    over = div_f32s(a, b);
    /// `a b + c`, in one rounding where the machine can.
    times_plus = mul_add_e_f32s(a, b, c);
    /// The larger.
    larger = max_f32s(a, b);
    /// The smaller.
    smaller = min_f32s(a, b);
    /// Square root.
    root = sqrt_f32s(a);
}

/// One number in all lanes.
#[inline(always)]
pub(crate) fn all<S: Simd, const V: usize>(simd: S, number: f32) -> [S::f32s; V] {
    [simd.splat_f32s(number); V]
}

/// The first vectors of a slice.
#[inline(always)]
pub(crate) fn load<S: Simd, const V: usize>(simd: S, x: &[f32]) -> [S::f32s; V] {
    let mut vectors = [simd.splat_f32s(0.0); V];
    for (v, x) in vectors.iter_mut().zip(S::as_simd_f32s(&x[..V * S::F32_LANES]).0) {
        *v = *x;
    }
    vectors
}
