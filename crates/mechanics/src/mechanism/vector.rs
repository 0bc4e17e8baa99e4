//! Vectors of three components.

use autodiff::Scalar;

/// a · b.
#[inline(always)]
pub fn dot<T: Scalar>(a: [T; 3], b: [T; 3]) -> T {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// a × b.
#[inline(always)]
pub fn cross<T: Scalar>(a: [T; 3], b: [T; 3]) -> [T; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// a + b.
#[inline(always)]
pub fn add<T: Scalar>(a: [T; 3], b: [T; 3]) -> [T; 3] {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

/// a − b.
#[inline(always)]
pub fn subtract<T: Scalar>(a: [T; 3], b: [T; 3]) -> [T; 3] {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

/// s a.
#[inline(always)]
pub fn scaled<T: Scalar>(a: [T; 3], s: T) -> [T; 3] {
    a.map(|x| x * s)
}

/// |a|, with derivatives of zero at a = 0.
pub fn norm<T: Scalar>(a: [T; 3]) -> T {
    let square = dot(a, a);
    if square.re() == 0.0 { T::zero() } else { square.sqrt() }
}

/// M a, for a matrix by rows.
#[inline(always)]
pub fn product<T: Scalar>(m: &[[T; 3]; 3], a: [T; 3]) -> [T; 3] {
    m.map(|row| dot(row, a))
}

/// Mᵀ a, for a matrix by rows.
#[inline(always)]
pub fn transposed_product<T: Scalar>(m: &[[T; 3]; 3], a: [T; 3]) -> [T; 3] {
    [0, 1, 2].map(|k| m[0][k] * a[0] + m[1][k] * a[1] + m[2][k] * a[2])
}
