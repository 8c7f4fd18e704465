#pragma once

#include <algorithm>
#include <random>
#include <tuple>

#include <Eigen/Dense>

#include <tandem/lie/bundle.hpp>
#include <tandem/lie/rn.hpp>
#include <tandem/lie/se2.hpp>
#include <tandem/lie/sek3.hpp>
#include <tandem/problem/nlp_evaluator.hpp>
#include <tandem/residuals/constant_twist.hpp>
#include <tandem/residuals/prior.hpp>
#include <tandem/residuals/relative_pose.hpp>
#include <tandem/residuals/roll_pitch.hpp>
#include <tandem/residuals/twist_components.hpp>
#include <tandem/residuals/usbl_position.hpp>

/// A problem that covers all features: several groups, blocks that read one variable twice, full and diagonal noise,
/// robust losses in all their regions, and all types of bounds.
namespace tandem::testing {

using Body = Bundle<SO3, R3>;

inline const Gaussian kUnit3{1.0, 1.0, 1.0};

inline Eigen::VectorXd gradient(NlpEvaluator& nlp) {
  Eigen::VectorXd g(nlp.num_unknowns());
  nlp.gradient(g);
  return g;
}

/// Position of a point p carried by a body [m]: e = R p + x.
struct Carried {
  static constexpr std::string_view name = "carried point";
  static constexpr int dim = 3;
  using States = std::tuple<Body, R3>;
  auto fields() { return std::tie(); }
  void operator()(const Body& s, const R3& p, Vector<3>& r, Matrix<3, 6>* Js = nullptr,
                  Matrix<3, 3>* Jp = nullptr) const {
    r = s.get<0>().act(p.vector()) + s.get<1>().vector();
    if (Js) *Js << s.get<0>().act_jacobian(p.vector()), Matrix<3, 3>::Identity();
    if (Jp) *Jp = s.get<0>().matrix();
  }
};

/// Horizontal distance from the point m of a planar pose to a point in space [m]: e = p_xy − q m.
struct Below {
  static constexpr std::string_view name = "below";
  static constexpr int dim = 2;
  using States = std::tuple<SE2, R3>;
  Vector<2> m;
  auto fields() { return std::tie(m); }
  void operator()(const SE2& q, const R3& p, Vector<2>& r, Matrix<2, 3>* Jq = nullptr,
                  Matrix<2, 3>* Jp = nullptr) const {
    r = p.vector().head<2>() - q.act(m);
    if (Jq) *Jq = -q.act_jacobian(m);
    if (Jp) *Jp << Matrix<2, 2>::Identity(), Vector<2>::Zero();
  }
};

struct MixedVariables {
  Variable<SE3> a, b;
  Variable<R3> p;
  Variable<SE2> q;
  Variable<SE3> c;
  Variable<Body> s;
};

MixedVariables add_mixed_variables(Problem& problem);

/// Calls f(residual, noise, variables, loss) for each cost.
template <class F>
void each_mixed_cost(const MixedVariables& v, F f) {
  const Vector<6> sigmas{0.5, 0.4, 0.6, 0.2, 0.3, 0.25};
  Matrix<6, 6> mixing = Matrix<6, 6>::Identity();
  for (int i = 0; i < 6; ++i)
    for (int j = 0; j < i; ++j) mixing(i, j) = 0.3 * std::sin(1.0 + i + 2.0 * j);
  const Gaussian full = Gaussian::covariance(0.2 * mixing * mixing.transpose());
  const Gaussian planar = Gaussian::information(Matrix<3, 3>{{4.0, 1.0, 0.5}, {1.0, 3.0, -0.7}, {0.5, -0.7, 2.0}});

  f(Prior<SE3>{SE3()}, full, std::tuple(v.a), Loss{});
  f(RelativePose<SE3>{SE3::Exp(0.3 * sigmas)}, Gaussian(sigmas), std::tuple(v.a, v.b), Loss{});
  f(RelativePose<SE3>{SE3::Exp(-0.2 * sigmas), SE3::Exp(sigmas), SE3::Exp(-sigmas)}, full, std::tuple(v.c, v.b),
    Huber(0.5));
  f(ConstantTwist<SE3>{1.0, 0.7}, full, std::tuple(v.a, v.b, v.c), Cauchy(1.5));
  f(ConstantTwist<SE3>{1.0, 1.3}, Gaussian(sigmas), std::tuple(v.a, v.b, v.a), Loss{});  // reads a twice
  f(ConstantTwist<SE3>{0.5, 1.0}, Gaussian(sigmas), std::tuple(v.c, v.c, v.a), Loss{});  // reads c twice
  f(UsblPosition<SE3, R3>{{0.2, 0.3, 1.0}}, Gaussian{0.3, 0.4, 0.5}, std::tuple(v.b, v.p), Huber(100.0));
  f(UsblPosition<SE3, R3>{{0.7, 0.1, 0.9}}, Gaussian{0.3, 0.4, 0.5}, std::tuple(v.c, v.p), GemanMcClure(4.0));
  f(UsblPosition<SE3>{{0.1, 0.2, 0.3}, SE3::Exp(sigmas), {0.4, 0.5, 0.6}}, Gaussian{0.6, 0.4, 0.5},
    std::tuple(v.b, v.b), Tukey(20.0));  // reads b twice
  f(Prior<SE2>{SE2::Exp({0.1, 0.3, 0.4})}, planar, std::tuple(v.q), Cauchy(0.7));
  f(Below{{0.5, -0.3}}, Gaussian{0.4, 0.7}, std::tuple(v.q, v.p), Loss{});
  f(Carried{}, Gaussian{0.7, 0.6, 0.5}, std::tuple(v.s, v.p), Loss{});
  f(Prior<Body>{Body()}, full, std::tuple(v.s), Loss{});
  f(Prior<R3>{R3({0.1, -0.3, 0.9})}, Gaussian{0.4, 0.3, 0.5}, std::tuple(v.p),
    Cauchy(0.8));  // linear except for its loss
}

/// Calls f(residual, bounds, variables) for each constraint, in the order of the rows: residuals of one type are
/// adjacent.
template <class F>
void each_mixed_constraint(const MixedVariables& v, F f) {
  f(TwistComponents<SE3, sway | heave>{0.8}, Bounds<2>(equal_to(0.0)), std::tuple(v.a, v.b));
  f(TwistComponents<SE3, sway | heave>{0.5}, Bounds<2>(between(-0.1, 0.3)), std::tuple(v.c, v.b));
  f(RollPitch<SE3>{}, Bounds<2>(at_most(0.2)), std::tuple(v.c));
  f(ConstantTwist<SE3>{1.0, 0.6}, Bounds<6>(at_least(-1.0)), std::tuple(v.b, v.a, v.b));  // reads b twice
  f(Below{{0.2, 0.1}}, Bounds<2>(equal_to(0.5)), std::tuple(v.q, v.p));
  f(Carried{}, Bounds<3>(at_least(0.4)), std::tuple(v.s, v.p));
}

struct MixedProblem {
  Problem problem;
  MixedVariables v = add_mixed_variables(problem);

  MixedProblem();
};

Eigen::VectorXd random_vector(Eigen::Index n, double size, unsigned seed);

/// Returns ∂f/∂δ by central differences of fourth order. With truncation h⁴ and rounding 1e-16/h the error is about
/// 1e-12 for values and derivatives of size 1.
template <class F>
Eigen::MatrixXd differences(const Eigen::VectorXd& at, F f) {
  constexpr double h = 1e-3;
  Eigen::MatrixXd J;
  for (Eigen::Index k = 0; k < at.size(); ++k) {
    const auto value = [&](double step) {
      Eigen::VectorXd x = at;
      x[k] += step;
      return Eigen::VectorXd(f(x));
    };
    const Eigen::VectorXd d = (8.0 * (value(h) - value(-h)) - (value(2 * h) - value(-2 * h))) / (12.0 * h);
    if (k == 0) J.resize(d.size(), at.size());
    J.col(k) = d;
  }
  return J;
}

inline Eigen::VectorXd hessian_values(const NlpEvaluator& nlp) {
  return Eigen::VectorXd::Zero(nlp.hessian_pattern().nonzeros());
}

Eigen::MatrixXd dense(const SymmetricPattern& pattern, const Eigen::VectorXd& values);

/// Returns the pattern in reverse block order with one extra block, like a Cholesky factor with fill-in.
SymmetricPattern reversed(const SymmetricPattern& natural);

Eigen::MatrixXd dense_jacobian(NlpEvaluator& nlp);

}  // namespace tandem::testing

// Instantiated in mixed_problem.cpp.
namespace tandem::detail {
extern template class StateStore<testing::Body>;
extern template struct FunctionsOf<testing::Carried>;
extern template struct FunctionsOf<testing::Below>;
extern template struct FunctionsOf<Prior<testing::Body>>;
}  // namespace tandem::detail
