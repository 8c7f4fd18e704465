#pragma once

#include <tandem/lie/coefficients.hpp>
#include <tandem/lie/rn.hpp>
#include <tandem/lie/se2.hpp>
#include <tandem/lie/sek3.hpp>

namespace tandem {

/// Second derivatives of Exp and of the group product, contracted with a covector λ (a gradient with respect to right
/// perturbations):
///
///   hessian(v, λ)   Hessian of λᵀ Log(Exp(v)⁻¹ Exp(v + δ)) at δ = 0: the symmetric part of ∂(Jr(v)ᵀ λ)/∂v
///   bracket(λ)      matrix C with aᵀ C b = λᵀ [a, b], where Log(Exp(a) Exp(b)) = a + b + ½ [a, b] + …
///
/// The corresponding Hessian of Log at X is −Jr⁻ᵀ hessian(v, Jr⁻ᵀ λ) Jr⁻¹, with v = Log(X) and Jr = Jr(v). Specialised
/// for Rn, SE2, SO3 and SE_K(3).
template <LieGroup G>
struct ExpCurvature;

template <int N>
struct ExpCurvature<Rn<N>> {
  static Matrix<N, N> hessian(const Vector<N>&, const Vector<N>&) { return Matrix<N, N>::Zero(); }
  static Matrix<N, N> bracket(const Vector<N>&) { return Matrix<N, N>::Zero(); }
};

/// With λ = [a; m], the rows of Jrᵀ λ are Vᵀ a for ρ and aᵀ u + m for θ, where V = [A −θB; θB A] and u are blocks of Jr at
/// angle −θ.
template <class S>
struct ExpCurvature<BasicSE2<S>> {
  static Matrix<3, 3, S> hessian(const Vector<3, S>& v, const Vector<3, S>& lambda) {
    const S x = v[0], y = v[1], theta = v[2], a = lambda[0], b = lambda[1];
    const AngleCoefficients<S> k(theta * theta);
    // Derivatives of A, θB, B and θC with respect to θ.
    const S dC = -k.F, dB = k.E - 0.5 * k.C, square = theta * theta;
    const S of_A = -2. * theta * (k.C + square * dC), of_tB = k.B + 2. * square * dB, of_B = 2. * theta * dB;
    const S of_tC = k.C + 2. * square * dC;
    Matrix<3, 3, S> H = Matrix<3, 3, S>::Zero();
    H(0, 2) = H(2, 0) = 0.5 * (of_A * a - of_tB * b + theta * k.C * a + k.B * b);
    H(1, 2) = H(2, 1) = 0.5 * (of_tB * a + of_A * b + theta * k.C * b - k.B * a);
    H(2, 2) = a * (of_tC * x - of_B * y) + b * (of_tC * y + of_B * x);
    return H;
  }
  static Matrix<3, 3, S> bracket(const Vector<3, S>& lambda) {
    Matrix<3, 3, S> C = Matrix<3, 3, S>::Zero();
    C(1, 2) = lambda[0], C(2, 1) = -lambda[0];
    C(2, 0) = lambda[1], C(0, 2) = -lambda[1];
    return C;
  }
};

namespace detail {

/// Implementation for SO(3) (K = 0) and SE_K(3).
///
/// With λ = [a_1; …; a_K; m], the rows of ρ_k in Jrᵀ λ are J(θ) a_k and those of θ are Σ_k Q(ρ_k, θ) a_k + J(θ) m. J is
/// the left Jacobian of SO(3) and Q is Barfoot's (2017, eq. 7.86). Each term is differentiated. The derivatives of the
/// coefficients B, C, E, F with respect to θ² are dB, dC, dE, dF.
template <class G, int K>
struct ExpCurvatureWithRotation {
  using S = typename G::Scalar;
  using Mat3 = Matrix<3, 3, S>;
  using Vec3 = Vector<3, S>;

  static typename G::Jacobian hessian(const typename G::Tangent& v, const typename G::Tangent& lambda) {
    const Vec3 theta = v.template tail<3>(), m = lambda.template tail<3>();
    const Coefficients k(theta.squaredNorm());
    typename G::Jacobian H = G::Jacobian::Zero();
    Mat3 by_theta = jacobian_by_angle(theta, m, k);
    for (int i = 0; i < K; ++i) {
      const Vec3 rho = v.template segment<3>(3 * i), a = lambda.template segment<3>(3 * i);
      const Mat3 mixed = S(0.5) * (jacobian_by_angle(theta, a, k) + Q_by_rho(theta, a, k).transpose());
      H.template block<3, 3>(3 * i, 3 * K) = mixed;
      H.template block<3, 3>(3 * K, 3 * i) = mixed.transpose();
      by_theta += Q_by_angle(rho, theta, a, k);
    }
    H.template bottomRightCorner<3, 3>() = S(0.5) * (by_theta + by_theta.transpose());
    return H;
  }

  static typename G::Jacobian bracket(const typename G::Tangent& lambda) {
    typename G::Jacobian C = G::Jacobian::Zero();
    for (int i = 0; i < K; ++i) {
      const Mat3 a = skew(lambda.template segment<3>(3 * i));
      C.template block<3, 3>(3 * i, 3 * K) = -a;
      C.template block<3, 3>(3 * K, 3 * i) = -a;
    }
    C.template bottomRightCorner<3, 3>() = -skew(lambda.template tail<3>());
    return C;
  }

 private:
  struct Coefficients : AngleCoefficients<S> {
    S dB, dC, dE, dF;  ///< derivatives with respect to θ²

    [[gnu::always_inline]] explicit Coefficients(const S& x) : AngleCoefficients<S>(x) {
      const S &C = this->C, &E = this->E, &F = this->F;
      const auto series = [&]() -> std::array<S, 2> {
        return {
            -1. / 720 + x * (2. / 40320 + x * (-3. / 3628800 + x * (4. / 479001600 - x * (5. / 87178291200.)))),
            -1. / 2520 + x * (2. / 120960 + x * (-3. / 9979200 + x * (4. / 1245404160 - x * (5. / 217945728000.))))};
      };
      const auto closed = [&]() -> std::array<S, 2> {
        return {(0.5 * C - 2. * E) / x, (0.5 * C - E - 5. * F) / (2. * x)};
      };
      const std::array<S, 2> both = piecewise(x, AngleCoefficients<S>::kSeriesBelow, series, closed);
      dB = E - 0.5 * C;
      dC = -F;
      dE = both[0], dF = both[1];
    }
  };

  /// Returns ∂([θ]×² y)/∂θ.
  static Mat3 square_by_angle(const Vec3& theta, const Vec3& y) {
    return theta * y.transpose() + theta.dot(y) * Mat3::Identity() - S(2) * y * theta.transpose();
  }
  static Vec3 square(const Vec3& theta, const Vec3& y) { return theta.cross(theta.cross(y)); }

  /// Returns ∂(J(θ) a)/∂θ, with J = I + B [θ]× + C [θ]×².
  static Mat3 jacobian_by_angle(const Vec3& theta, const Vec3& a, const Coefficients& k) {
    const Vec3 slope = k.dB * theta.cross(a) + k.dC * square(theta, a);
    return k.C * square_by_angle(theta, a) - k.B * skew(a) + S(2) * slope * theta.transpose();
  }

  /// Returns ∂(Q(ρ, θ) a)/∂ρ.
  static Mat3 Q_by_rho(const Vec3& theta, const Vec3& a, const Coefficients& k) {
    const Mat3 W = skew(theta), A = skew(a);
    const Vec3 turned = theta.cross(a), twice = theta.cross(turned);
    const Mat3 WA = W * A;
    Mat3 M = S(-0.5) * A - k.C * (WA + skew(turned)) - k.E * (W * WA + skew(twice));
    M += ((3. * k.E - k.C) * turned - 2. * k.F * twice) * theta.transpose();
    return M;
  }

  /// Returns ∂(Q(ρ, θ) a)/∂θ.
  static Mat3 Q_by_angle(const Vec3& rho, const Vec3& theta, const Vec3& a, const Coefficients& k) {
    const Mat3 P = skew(rho), A = skew(a);
    const Vec3 p = rho.cross(a), turned = theta.cross(a), twice = theta.cross(turned);
    const S c = theta.dot(rho);
    const Mat3 square_a = square_by_angle(theta, a);
    // Q a = ½ ρ×a + C q1 + E q2 + F q3
    const Vec3 q1 = theta.cross(p) + rho.cross(turned) - c * turned;
    const Vec3 q2 = square(theta, p) + rho.cross(twice) + 3. * c * turned;
    const Vec3 q3 = -2. * c * twice;
    Mat3 M = k.C * (c * A - skew(p) - P * A - turned * rho.transpose());
    M += k.E * (square_by_angle(theta, p) + P * square_a + S(3) * turned * rho.transpose() - 3. * c * A);
    M -= 2. * k.F * (twice * rho.transpose() + c * square_a);
    M += S(2) * (k.dC * q1 + k.dE * q2 + k.dF * q3) * theta.transpose();
    return M;
  }
};

}  // namespace detail

template <class S>
struct ExpCurvature<BasicSO3<S>> : detail::ExpCurvatureWithRotation<BasicSO3<S>, 0> {};
template <int K, class S>
struct ExpCurvature<BasicSEK3<K, S>> : detail::ExpCurvatureWithRotation<BasicSEK3<K, S>, K> {};

/// Groups for which ExpCurvature is specialised.
template <class G>
concept HasExpCurvature = LieGroup<G> && requires(const typename G::Tangent& v) {
  ExpCurvature<G>::hessian(v, v);
};

}  // namespace tandem
