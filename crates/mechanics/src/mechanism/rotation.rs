//! Rotations in space by Euler parameters, and sequences of Euler angles.

use crate::mechanism::vector::{add, cross, dot, norm, product, scaled, subtract};
use crate::{Error, Result};
use autodiff::Scalar;

/// A rotation in space: the orientation of a body or marker relative to the axes that it is placed in.
///
/// It is stored as Euler parameters (a unit quaternion) e = (cos ½α, u sin ½α) of the rotation by the angle α about the unit
/// vector u. A rotation maps components in the rotated axes to components in the axes of reference.
///
/// An axis of length zero gives a rotation of NaN. An analysis then rejects the mechanism, naming the part that uses
/// it.
///
/// # Examples
///
/// ```
/// use linkwright_mechanics::mechanism::Rotation;
/// let quarter = Rotation::<f64>::about_z(std::f64::consts::FRAC_PI_2);
/// let [x, y, z] = quarter.rotate([1.0, 0.0, 0.0]);
/// assert!(x.abs() < 1e-15 && (y - 1.0).abs() < 1e-15 && z == 0.0);
/// ```
///
/// # Sources
/// Nikravesh, *Computer-Aided Analysis of Mechanical Systems* (1988), Chapter 6.
#[derive(Clone, Copy, Debug)]
pub struct Rotation<S> {
    e: [S; 4],
}

/// Largest deviation of R Rᵀ from the identity that is accepted as rounding of a given matrix.
const ORTHONORMAL: f64 = 1e-6;

/// Sine of the angle between two directions below which they count as parallel.
const PARALLEL: f64 = 1e-9;

/// cos β below which the first and the last axis of three rotations count as parallel: it is rounding.
const SINGULAR: f64 = 1e-12;

impl<S: Scalar> Rotation<S> {
    /// No rotation.
    pub fn identity() -> Self {
        Self { e: [1.0, 0.0, 0.0, 0.0].map(S::from) }
    }

    /// The rotation with the given Euler parameters (scalar first), which are normalized.
    pub fn euler_parameters(e: [S; 4]) -> Self {
        let inverse = square(&e).sqrt().recip();
        Self { e: e.map(|x| x * inverse) }
    }

    /// The rotation by `angle` (rad) about `axis`, a vector of any length but zero.
    pub fn about(axis: [S; 3], angle: S) -> Self {
        let (sin, cos) = (angle * 0.5).sin_cos();
        let [x, y, z] = scaled(unit(axis), sin);
        Self { e: [cos, x, y, z] }
    }

    /// The rotation by `angle` (rad) about the x-axis.
    pub fn about_x(angle: S) -> Self {
        Self::about_axis(0, angle)
    }

    /// The rotation by `angle` (rad) about the y-axis.
    pub fn about_y(angle: S) -> Self {
        Self::about_axis(1, angle)
    }

    /// The rotation by `angle` (rad) about the z-axis.
    pub fn about_z(angle: S) -> Self {
        Self::about_axis(2, angle)
    }

    fn about_axis(axis: usize, angle: S) -> Self {
        let (sin, cos) = (angle * 0.5).sin_cos();
        let mut e = [cos, S::zero(), S::zero(), S::zero()];
        e[1 + axis] = sin;
        Self { e }
    }

    /// The rotation by three `angles` (rad) about the axes of `sequence`, each about an axis of the already rotated frame.
    pub fn euler_angles(sequence: EulerSequence, angles: [S; 3]) -> Self {
        let [a, b, c] = sequence.axes();
        Self::about_axis(a, angles[0]).then(Self::about_axis(b, angles[1])).then(Self::about_axis(c, angles[2]))
    }

    /// A rotation whose z-axis is along `axis`; use [`Rotation::from_z_x`] if the direction of x matters.
    ///
    /// It is the shortest rotation from z, or from −z after half a turn about x if the axis points downwards.
    pub fn z_along(axis: [S; 3]) -> Self {
        let [x, y, z] = unit(axis);
        let (zero, one) = (S::zero(), S::from(1.0));
        if z.re() >= 0.0 {
            Self::euler_parameters([one + z, -y, x, zero])
        } else {
            Self::euler_parameters([-y, one - z, zero, x])
        }
    }

    /// The rotation whose z-axis is along `z` and whose x-axis is as near as possible to `x`, which must not be parallel.
    pub fn from_z_x(z: [S; 3], x: [S; 3]) -> Self {
        let z = unit(z);
        let x = normal_part(x, z);
        Self::of_columns([x, cross(z, x), z])
    }

    /// The rotation whose x-axis is along `x` and whose z-axis is as near as possible to `z`, which must not be parallel.
    pub fn from_x_z(x: [S; 3], z: [S; 3]) -> Self {
        let x = unit(x);
        let z = normal_part(z, x);
        Self::of_columns([x, cross(z, x), z])
    }

    /// The rotation with the given matrix, row by row, such as one exported from a CAD system.
    ///
    /// # Errors
    /// [`Error::Definition`] if the matrix is not orthonormal to 1e-6, or is a reflection.
    pub fn from_matrix(rows: [[S; 3]; 3]) -> Result<Self> {
        let column = |k: usize| [rows[0][k], rows[1][k], rows[2][k]];
        let columns = [column(0), column(1), column(2)];
        let product = |i: usize, j: usize| dot(columns[i], columns[j]).re() - if i == j { 1.0 } else { 0.0 };
        let error =
            (0..9).map(|k| product(k / 3, k % 3).abs()).fold(0.0, |a: f64, b| if b > a || b.is_nan() { b } else { a });
        let determinant = dot(cross(columns[0], columns[1]), columns[2]).re();
        if !(error <= ORTHONORMAL) || determinant < 0.0 {
            let why = format!("it is no rotation: R Rᵀ − I has an entry of {error:.1e}, and det R = {determinant:.3}");
            let remedy = "give orthogonal rows of length one with more digits, and a right-handed frame";
            return Err(Error::definition("the orientation matrix", why, remedy));
        }
        Ok(Self::of_columns(columns))
    }

    /// Euler parameters of a matrix with the given columns, by the largest of the four (Shepperd's method).
    fn of_columns([x, y, z]: [[S; 3]; 3]) -> Self {
        let (xx, yy, zz) = (x[0], y[1], z[2]);
        let one = S::from(1.0);
        let squares = [one + xx + yy + zz, one + xx - yy - zz, one - xx + yy - zz, one - xx - yy + zz];
        let largest = (1..4).fold(0, |a, b| if squares[b].re() > squares[a].re() { b } else { a });
        let (wx, wy, wz) = (y[2] - z[1], z[0] - x[2], x[1] - y[0]);
        let (xy, yz, zx) = (x[1] + y[0], y[2] + z[1], z[0] + x[2]);
        let s = squares[largest];
        Self::euler_parameters(match largest {
            0 => [s, wx, wy, wz],
            1 => [wx, s, xy, zx],
            2 => [wy, xy, s, yz],
            _ => [wz, zx, yz, s],
        })
    }

    /// This rotation followed by `other` about the rotated axes: the matrix product R R_other.
    pub fn then(self, other: Self) -> Self {
        Self { e: quaternion_product(&self.e, &other.e) }
    }

    /// The inverse rotation.
    pub fn inverse(self) -> Self {
        Self { e: conjugate(&self.e) }
    }

    /// Components in the axes of reference of a vector with the components `v` in the rotated axes.
    pub fn rotate(self, v: [S; 3]) -> [S; 3] {
        product(&matrix(&self.e), v)
    }

    /// Rotation matrix, row by row.
    pub fn matrix(self) -> [[S; 3]; 3] {
        matrix(&self.e)
    }

    /// Euler parameters, scalar first.
    pub fn parameters(self) -> [S; 4] {
        self.e
    }
}

/// The unit vector along `v`; NaN if its length is zero.
fn unit<S: Scalar>(v: [S; 3]) -> [S; 3] {
    // The square of a very long or very short vector may overflow or underflow.
    let largest = v.iter().fold(0.0f64, |most, x| most.max(x.re().abs()));
    let v = v.map(|x| x / S::from(largest));
    scaled(v, dot(v, v).sqrt().recip())
}

/// The unit vector along the part of `v` normal to the unit vector `axis`; NaN if both are parallel.
fn normal_part<S: Scalar>(v: [S; 3], axis: [S; 3]) -> [S; 3] {
    let v = unit(v);
    let part = subtract(v, scaled(axis, dot(axis, v)));
    let is_parallel = dot(part, part).re() < PARALLEL * PARALLEL;
    scaled(unit(part), S::from(if is_parallel { f64::NAN } else { 1.0 }))
}

/// Axes of three successive rotations, each about an axis of the already rotated frame.
///
/// With the axes i, j, k the rotation is R = R_i(α) R_j(β) R_k(γ). `Zyx` are yaw, pitch and roll; `Zxz` are precession,
/// nutation and spin. At β = ±π/2 (three different axes) or β = 0, π (first axis equal to the last) only the sum or the difference
/// of α and γ is determined: there γ is zero, and α contains both.
///
/// # Sources
/// Diebel, *Representing Attitude: Euler Angles, Unit Quaternions, and Rotation Vectors* (2006), Section 8.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[allow(missing_docs)]
pub enum EulerSequence {
    Xyz,
    Xzy,
    Yxz,
    Yzx,
    Zxy,
    Zyx,
    Xyx,
    Xzx,
    Yxy,
    Yzy,
    Zxz,
    Zyz,
}

impl EulerSequence {
    /// All sequences.
    pub const ALL: [Self; 12] = [
        Self::Xyz,
        Self::Xzy,
        Self::Yxz,
        Self::Yzx,
        Self::Zxy,
        Self::Zyx,
        Self::Xyx,
        Self::Xzx,
        Self::Yxy,
        Self::Yzy,
        Self::Zxz,
        Self::Zyz,
    ];

    /// Numbers of the three axes: 0 for x, 1 for y, 2 for z.
    pub fn axes(self) -> [usize; 3] {
        match self {
            Self::Xyz => [0, 1, 2],
            Self::Xzy => [0, 2, 1],
            Self::Yxz => [1, 0, 2],
            Self::Yzx => [1, 2, 0],
            Self::Zxy => [2, 0, 1],
            Self::Zyx => [2, 1, 0],
            Self::Xyx => [0, 1, 0],
            Self::Xzx => [0, 2, 0],
            Self::Yxy => [1, 0, 1],
            Self::Yzy => [1, 2, 1],
            Self::Zxz => [2, 0, 2],
            Self::Zyz => [2, 1, 2],
        }
    }

    /// Returns whether only the sum or the difference of the first and the last angle of the rotation matrix `r` is determined.
    pub fn is_singular(self, r: &[[f64; 3]; 3]) -> bool {
        let [i, j, last] = self.axes();
        let k = 3 - i - j;
        let column = if last == k { k } else { i };
        r[j][column].hypot(r[k][column]) < SINGULAR
    }

    /// The angles (rad) of the rotation matrix `r`: α and γ from −π to π, β from −π/2 to π/2, or from 0 to π if the first axis
    /// is the last.
    ///
    /// The rotation by the three angles is `r`, even in and near the singular positions ([`EulerSequence::is_singular`]). There the angles
    /// have no derivatives: those of the result hold γ at zero.
    pub fn angles<T: Scalar>(self, r: &[[T; 3]; 3]) -> [T; 3] {
        let [i, j, last] = self.axes();
        let k = 3 - i - j;
        let is_cyclic = (j + 3 - i) % 3 == 1;
        let signed = |x: T| if is_cyclic { x } else { -x };
        let (sin, cos, [first_sin, first_cos]) = if last == k {
            let normal = norm([T::zero(), r[j][k], r[k][k]]);
            (signed(r[i][k]), normal, [-signed(r[j][k]), r[k][k]])
        } else {
            let normal = norm([T::zero(), r[j][i], r[k][i]]);
            (normal, r[i][i], [r[j][i], -signed(r[k][i])])
        };
        let beta = sin.atan2(cos);
        if self.is_singular(&r.map(|row| row.map(|x| x.re()))) {
            return [signed(r[k][j]).atan2(r[j][j]), beta, T::zero()];
        }
        let alpha = first_sin.atan2(first_cos);
        // R_i(−α) R has in row j what γ is, for any α, even where α is inaccurate.
        let (s, c) = alpha.sin_cos();
        let row = |column: usize| r[j][column] * c + signed(r[k][column]) * s;
        let gamma = if last == k { signed(row(i)).atan2(row(j)) } else { (-signed(row(k))).atan2(row(j)) };
        [alpha, beta, gamma]
    }
}

/// Euler parameters of the rotation with the parameters `a`, followed by that with the parameters `b` about the rotated axes.
#[inline(always)]
pub(crate) fn quaternion_product<T: Scalar>(a: &[T; 4], b: &[T; 4]) -> [T; 4] {
    let ([a0, a1, a2, a3], [b0, b1, b2, b3]) = (*a, *b);
    let (a, b) = ([a1, a2, a3], [b1, b2, b3]);
    let [x, y, z] = add(add(scaled(b, a0), scaled(a, b0)), cross(a, b));
    [a0 * b0 - dot(a, b), x, y, z]
}

/// Euler parameters of the inverse rotation.
#[inline(always)]
pub(crate) fn conjugate<T: Scalar>(e: &[T; 4]) -> [T; 4] {
    [e[0], -e[1], -e[2], -e[3]]
}

/// |e|².
#[inline(always)]
pub(crate) fn square<T: Scalar>(e: &[T; 4]) -> T {
    e[0] * e[0] + e[1] * e[1] + e[2] * e[2] + e[3] * e[3]
}

/// Rotation matrix E Lᵀ / |e|² of Euler parameters, row by row: it does not depend on their length.
#[inline(always)]
pub(crate) fn matrix<T: Scalar>(e: &[T; 4]) -> [[T; 3]; 3] {
    let [e0, e1, e2, e3] = *e;
    let scale = square(e).recip();
    let twice = scale * 2.0;
    let (a, b, c, d) = (e0 * e0, e1 * e1, e2 * e2, e3 * e3);
    let (xy, yz, zx) = (e1 * e2, e2 * e3, e3 * e1);
    let (wx, wy, wz) = (e0 * e1, e0 * e2, e0 * e3);
    [
        [(a + b - c - d) * scale, (xy - wz) * twice, (zx + wy) * twice],
        [(xy + wz) * twice, (a - b + c - d) * scale, (yz - wx) * twice],
        [(zx - wy) * twice, (yz + wx) * twice, (a - b - c + d) * scale],
    ]
}

/// E(e) d, half the angular velocity in the axes of reference for the rates d of unit Euler parameters.
#[inline(always)]
pub(crate) fn e_times<T: Scalar>(e: &[T; 4], d: &[T; 4]) -> [T; 3] {
    [
        e[0] * d[1] - e[1] * d[0] - e[3] * d[2] + e[2] * d[3],
        e[0] * d[2] - e[2] * d[0] + e[3] * d[1] - e[1] * d[3],
        e[0] * d[3] - e[3] * d[0] - e[2] * d[1] + e[1] * d[2],
    ]
}

/// E(e)ᵀ w.
#[inline(always)]
pub(crate) fn e_transposed_times<T: Scalar>(e: &[T; 4], w: [T; 3]) -> [T; 4] {
    [
        -(e[1] * w[0] + e[2] * w[1] + e[3] * w[2]),
        e[0] * w[0] + e[3] * w[1] - e[2] * w[2],
        e[0] * w[1] - e[3] * w[0] + e[1] * w[2],
        e[0] * w[2] + e[2] * w[0] - e[1] * w[1],
    ]
}

/// L(e) d, half the angular velocity in the rotated axes for the rates d of unit Euler parameters.
pub(crate) fn l_times<T: Scalar>(e: &[T; 4], d: &[T; 4]) -> [T; 3] {
    [
        e[0] * d[1] - e[1] * d[0] + e[3] * d[2] - e[2] * d[3],
        e[0] * d[2] - e[2] * d[0] - e[3] * d[1] + e[1] * d[3],
        e[0] * d[3] - e[3] * d[0] + e[2] * d[1] - e[1] * d[2],
    ]
}

/// L(e)ᵀ w.
pub(crate) fn l_transposed_times<T: Scalar>(e: &[T; 4], w: [T; 3]) -> [T; 4] {
    [
        -(e[1] * w[0] + e[2] * w[1] + e[3] * w[2]),
        e[0] * w[0] - e[3] * w[1] + e[2] * w[2],
        e[0] * w[1] + e[3] * w[0] - e[1] * w[2],
        e[0] * w[2] - e[2] * w[0] + e[1] * w[1],
    ]
}

/// sin² ½α below which functions of a rotation angle are computed by their power series.
const SMALL: f64 = 1e-3;

/// Rotation vector α u of a rotation matrix' Euler parameters, with α from 0 to π (its direction jumps at π).
///
/// It is smooth at α = 0.
pub(crate) fn rotation_vector<T: Scalar>(e: &[T; 4]) -> [T; 3] {
    let scale = square(e).sqrt().recip() * if e[0].re() < 0.0 { -1.0 } else { 1.0 };
    let [cos, x, y, z] = e.map(|x| x * scale);
    let half = [x, y, z];
    let s2 = dot(half, half);
    let ratio = if s2.re() < SMALL {
        // arcsin(s) / s.
        [35.0 / 1152.0, 5.0 / 112.0, 3.0 / 40.0, 1.0 / 6.0].into_iter().fold(T::from(63.0 / 2816.0), |a, c| a * s2 + c)
            * s2
            + 1.0
    } else {
        let sin = norm(half);
        sin.atan2(cos) / sin
    };
    scaled(half, ratio * 2.0)
}

/// Torque T⁻ᵀ m about the fixed axes that does the work m·δθ for a rotation vector θ.
///
/// A small rotation δφ about the fixed axes after the rotation changes θ by
/// δθ = δφ − ½ θ × δφ + c θ × (θ × δφ) with c = (1 − ½α cot ½α)/α².
///
/// # Sources
/// Ibrahimbegović, Frey & Kožar, *Int. J. Numer. Methods Eng.* 38 (1995) 3653–3673.
pub(crate) fn torque_of_rotation_vector<T: Scalar>(theta: [T; 3], m: [T; 3]) -> [T; 3] {
    let square = dot(theta, theta);
    let c = if square.re() < 0.1 {
        let series = [1.0 / 47_900_160.0, 1.0 / 1_209_600.0, 1.0 / 30_240.0, 1.0 / 720.0, 1.0 / 12.0];
        series.into_iter().fold(T::from(691.0 / 1_307_674_368_000.0), |a, c| a * square + c)
    } else {
        let half = square.sqrt() * 0.5;
        let (sin, cos) = half.sin_cos();
        (-half * cos / sin + 1.0) / square
    };
    let once = cross(theta, m);
    add(add(m, scaled(once, T::from(0.5))), scaled(cross(theta, once), c))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::elements::element_tests::close;
    use autodiff::Jet2;

    fn sample() -> Rotation<f64> {
        Rotation::euler_parameters([0.3, -0.5, 0.7, 0.2])
    }

    fn flat(m: [[f64; 3]; 3]) -> Vec<f64> {
        m.as_flattened().to_vec()
    }

    #[test]
    fn a_third_of_a_turn_about_the_diagonal_permutes_the_axes() {
        let third = Rotation::about([2.0, 2.0, 2.0], 2.0 * std::f64::consts::FRAC_PI_3);
        close(&flat(third.matrix()), &[0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0]);
        close(&flat(third.then(third).then(third).matrix()), &flat(Rotation::<f64>::identity().matrix()));
        close(&third.inverse().rotate([0.0, 1.0, 0.0]), &[1.0, 0.0, 0.0]);
    }

    #[test]
    fn the_angles_of_every_sequence_are_recovered() {
        for sequence in EulerSequence::ALL {
            let angles = [0.4, 0.9, -2.1];
            close(&sequence.angles(&Rotation::euler_angles(sequence, angles).matrix()), &angles);
        }
    }

    /// Only the sum or the difference of the first and the last angle is determined: the last is zero.
    #[test]
    fn the_angles_of_a_singular_position_are_those_of_its_rotation() {
        use std::f64::consts::{FRAC_PI_2, PI};
        for sequence in EulerSequence::ALL {
            let [first, _, last] = sequence.axes();
            let singular = if first == last { [0.0, PI] } else { [-FRAC_PI_2, FRAC_PI_2] };
            for beta in singular {
                let rotation = Rotation::euler_angles(sequence, [0.7, beta, -0.3]);
                let angles = sequence.angles(&rotation.matrix());
                assert_eq!(angles[2], 0.0);
                close(&flat(Rotation::euler_angles(sequence, angles).matrix()), &flat(rotation.matrix()));
                assert!(sequence.is_singular(&rotation.matrix()));
                let moving = rotation.matrix().map(|row| row.map(|x| Jet2::new(x, 0.1, 0.0)));
                assert!(sequence.angles(&moving).iter().all(|angle| angle.v1.is_finite()));
            }
            // Near it, the first angle is inaccurate, and the last one belongs to it.
            for near in [1e-3, 1e-6, 1e-9, 1e-11] {
                let rotation = Rotation::euler_angles(sequence, [0.7, singular[1] - near, -0.3]);
                let angles = sequence.angles(&rotation.matrix());
                assert!(!sequence.is_singular(&rotation.matrix()));
                close(&flat(Rotation::euler_angles(sequence, angles).matrix()), &flat(rotation.matrix()));
            }
        }
        // The pitch of a body whose axis x points downwards, as an exact matrix: yaw + roll = 90°.
        let matrix = [[0.0, -1.0, 0.0], [0.0, 0.0, -1.0], [1.0, 0.0, 0.0]];
        close(&EulerSequence::Zyx.angles(&matrix), &[FRAC_PI_2, -FRAC_PI_2, 0.0]);
    }

    #[test]
    fn directions_have_any_length_and_parallel_ones_make_no_rotation() {
        for length in [1e-200, 1.0, 1e200] {
            let axis = [3.0 * length, 0.0, 4.0 * length];
            close(&Rotation::z_along(axis).rotate([0.0, 0.0, 1.0]), &[0.6, 0.0, 0.8]);
            close(&Rotation::from_z_x(axis, [0.0, length, 0.0]).rotate([0.0, 0.0, 1.0]), &[0.6, 0.0, 0.8]);
            close(&Rotation::about(axis, 0.5).parameters(), &Rotation::about([0.6, 0.0, 0.8], 0.5).parameters());
        }
        let nearly = [0.1f64 * 3.0, 0.1, 0.2];
        for rotation in
            [Rotation::from_z_x(nearly, [0.3, 0.1, 0.2]), Rotation::<f64>::from_x_z(nearly, [-0.6, -0.2, -0.4])]
        {
            assert!(rotation.parameters().into_iter().all(f64::is_nan));
        }
    }

    #[test]
    fn matrices_and_axes_make_rotations() {
        for e in [[1.0, 0.2, 0.1, 0.3], [0.1, 1.0, 0.2, 0.3], [0.1, 0.2, 1.0, 0.3], [0.1, 0.2, 0.3, 1.0]] {
            let rotation = Rotation::euler_parameters(e);
            close(&Rotation::from_matrix(rotation.matrix()).unwrap().parameters(), &rotation.parameters());
        }
        for axis in [[0.3, -0.4, 0.5], [0.3, 0.4, -0.5], [0.0, 0.0, -2.0], [0.0, 0.0, 3.0], [1.0, 0.0, 0.0]] {
            let unit = scaled(axis, 1.0 / norm(axis));
            close(&Rotation::z_along(axis).rotate([0.0, 0.0, 1.0]), &unit);
            let framed = Rotation::from_z_x(axis, [0.1, 1.0, 0.2]);
            close(&framed.rotate([0.0, 0.0, 1.0]), &unit);
            assert!(dot(framed.rotate([0.0, 1.0, 0.0]), [0.1, 1.0, 0.2]).abs() < 1e-14);
            let framed = Rotation::from_x_z(axis, [0.1, 1.0, 0.2]);
            close(&framed.rotate([1.0, 0.0, 0.0]), &unit);
            assert!(dot(framed.rotate([0.0, 1.0, 0.0]), [0.1, 1.0, 0.2]).abs() < 1e-14);
        }
        let sheared = [[1.0, 0.1, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        let mirrored = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, -1.0]];
        for matrix in [sheared, mirrored, [[f64::NAN; 3]; 3]] {
            assert!(Rotation::from_matrix(matrix).unwrap_err().to_string().contains("no rotation"));
        }
        assert!(Rotation::about([0.0f64; 3], 1.0).parameters()[1].is_nan());
    }

    #[test]
    fn angular_velocities_are_those_of_the_matrix() {
        // Ṙ = [ω]× R in the axes of reference and Ṙ = R [ω]× in the rotated ones, for Euler parameters of any length.
        let (e, d) = ([0.6, -1.0, 1.4, 0.4], [0.3, 0.2, -0.5, 0.7]);
        let jets: [Jet2<f64>; 4] = std::array::from_fn(|k| Jet2::new(e[k], d[k], 0.0));
        let rate = matrix(&jets).map(|row| row.map(|x| x.v1));
        let (r, factor) = (matrix(&e), 2.0 / square(&e));
        let (w, b) = (scaled(e_times(&e, &d), factor), scaled(l_times(&e, &d), factor));
        for v in [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]] {
            close(&product(&rate, v), &cross(w, product(&r, v)));
            close(&product(&rate, v), &product(&r, cross(b, v)));
        }
        let along = |row: [f64; 4]| row.iter().zip(d).map(|(a, b)| a * b).sum::<f64>();
        close(&[along(e_transposed_times(&e, [1.0, 2.0, 3.0]))], &[dot([1.0, 2.0, 3.0], e_times(&e, &d))]);
        close(&[along(l_transposed_times(&e, [1.0, 2.0, 3.0]))], &[dot([1.0, 2.0, 3.0], l_times(&e, &d))]);
    }

    #[test]
    fn rotation_vectors_and_their_torques() {
        let axis = [2.0 / 7.0, -3.0 / 7.0, 6.0 / 7.0];
        for angle in [0.0, 1e-9, 0.05, 0.0632, 0.0633, 0.31, 0.32, 1.7, 3.1] {
            let theta = scaled(axis, angle);
            let rotation = Rotation::about(axis, angle);
            close(&rotation_vector(&rotation.parameters()), &theta);
            close(&rotation_vector(&rotation.parameters().map(|x| -2.0 * x)), &theta);
            // A small rotation δφ after the rotation does the work of the torque: the derivative of m·θ.
            let m = [0.3, 0.5, -0.2];
            let torque = torque_of_rotation_vector(theta, m);
            for (k, torque) in torque.into_iter().enumerate() {
                let (zero, one) = (Jet2::from(0.0), Jet2::new(0.0, 1.0, 0.0));
                let mut small = [zero; 3];
                small[k] = one;
                let [x, y, z] = scaled(small, Jet2::from(0.5));
                let constant = Rotation { e: rotation.parameters().map(Jet2::from) };
                let moved = rotation_vector(&Rotation { e: [Jet2::from(1.0), x, y, z] }.then(constant).parameters());
                let work: f64 = (0..3).map(|i| m[i] * moved[i].v1).sum();
                assert!((work - torque).abs() < 1e-12, "{angle}: {work} {torque}");
            }
        }
        close(&rotation_vector(&sample().parameters()).map(|x| x * 0.0), &[0.0; 3]);
    }
}
