#include <cmath>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <tandem/lie/bundle.hpp>
#include <tandem/lie/rn.hpp>
#include <tandem/lie/se2.hpp>
#include <tandem/lie/sek3.hpp>
#include <tandem/residuals/relative_pose.hpp>
#include <tandem/residuals/testing.hpp>

namespace tandem {
namespace {

using ::testing::HasSubstr;

/// A correct residual whose values or Jacobians are modified by `spoil`.
template <class Spoil>
struct Spoilt {
  static constexpr std::string_view name = "spoilt";
  static constexpr int dim = 6;
  using States = std::tuple<SE3, SE3>;
  Spoil spoil;
  void operator()(const SE3& x, const SE3& y, Vector<6>& r, Matrix<6, 6>* Jx = nullptr,
                  Matrix<6, 6>* Jy = nullptr) const {
    RelativePose<>{}(x, y, r, Jx, Jy);
    spoil(r, Jx, Jy);
  }
};
template <class Spoil>
Spoilt(Spoil) -> Spoilt<Spoil>;

/// Log with its Jacobian with respect to left perturbations.
struct OnTheLeft {
  static constexpr std::string_view name = "on the left";
  static constexpr int dim = 6;
  using States = std::tuple<SE3>;
  void operator()(const SE3& x, Vector<6>& r, Matrix<6, 6>* J = nullptr) const {
    r = x.Log();
    if (J) *J = SE3::Jl_inverse(r);
  }
};

/// The identity; optionally leaves a row unset or adds to the Jacobian instead of setting it.
struct Partial {
  static constexpr std::string_view name = "partial";
  static constexpr int dim = 3;
  using States = std::tuple<R3>;
  bool set_all_rows, add;
  void operator()(const R3& x, Vector<3>& r, Matrix<3, 3>* J = nullptr) const {
    r.head<2>() = x.vector().head<2>();
    if (set_all_rows) r[2] = x.vector()[2];
    if (J && add) *J += Matrix<3, 3>::Identity();
    if (J && !add) J->setIdentity();
  }
};

/// Logarithm; undefined for x ≤ 0, or everywhere if `never`.
struct Positive {
  static constexpr std::string_view name = "logarithm";
  static constexpr int dim = 1;
  using States = std::tuple<Rn<1>>;
  bool never = false;
  void operator()(const Rn<1>& x, Vector<1>& r, Matrix<1, 1>* J = nullptr) const {
    if (never || !(x.vector()[0] > 0.0)) throw Error("logarithm: undefined for x <= 0");
    r[0] = std::log(x.vector()[0]);
    if (J) (*J)(0, 0) = 1.0 / x.vector()[0];
  }
};

using Rows6 = Vector<6>;
using Square6 = Matrix<6, 6>;

TEST(CheckJacobians, AcceptsCorrectJacobians) {
  const JacobianReport report = check_jacobians_at_random(Spoilt{[](Rows6&, Square6*, Square6*) {}}, 1, 40);
  EXPECT_LE(report.relative, 1e-9) << report.text;
}

TEST(CheckJacobians, FindsTheWrongEntry) {
  for (const double error : {1.0, 1e-3, 1e-7}) {
    const JacobianReport report = check_jacobians_at_random(Spoilt{[&](Rows6&, Square6*, Square6* Jy) {
                                                              if (Jy) (*Jy)(4, 2) += error;
                                                            }},
                                                            1, 4);
    EXPECT_NEAR(report.absolute, error, 1e-9);
    EXPECT_EQ(report.state, 1);
    EXPECT_EQ(report.row, 4);
    EXPECT_EQ(report.column, 2);
    EXPECT_THAT(report.text, HasSubstr("spoilt: state 1, row 4, column 2"));
    EXPECT_LT(report.resolution, 1e-9);
  }
}

TEST(CheckJacobians, FindsMissingInverseJacobian) {
  // The identity in place of Jr⁻¹(e) is correct at e = 0 only.
  const Spoilt residual{[](Rows6&, Square6*, Square6* Jy) {
    if (Jy) Jy->setIdentity();
  }};
  const SE3 x = SE3::Exp((Rows6() << 1.0, 2.0, 3.0, 0.1, 0.2, 0.3).finished());
  EXPECT_LE(check_jacobians(residual, x, x).relative, 1e-11);
  EXPECT_GE(check_jacobians_at_random(residual, 1, 4).relative, 0.1);
}

TEST(CheckJacobians, FindsLeftPerturbations) { EXPECT_GE(check_jacobians_at_random(OnTheLeft{}, 1, 4).relative, 0.1); }

TEST(CheckJacobians, FindsZeroJacobian) {
  const Spoilt residual{[](Rows6&, Square6* Jx, Square6* Jy) {
    if (Jx) Jx->setZero();
    if (Jy) Jy->setZero();
  }};
  EXPECT_GE(check_jacobians(residual, SE3(), SE3()).relative, 1.0);
}

TEST(CheckJacobians, FindsEntriesThatAreNotSetOrNotFinite) {
  EXPECT_LE(check_jacobians(Partial{true, false}, R3()).relative, 1e-12);
  const JacobianReport row = check_jacobians(Partial{false, false}, R3()),
                       added = check_jacobians(Partial{true, true}, R3());
  EXPECT_TRUE(std::isinf(row.relative));
  EXPECT_THAT(row.text, HasSubstr("partial: the value is not finite"));
  EXPECT_TRUE(std::isinf(added.relative));
  EXPECT_THAT(added.text, HasSubstr("partial: a Jacobian is not finite"));
}

TEST(CheckJacobians, FindsValuesThatDependOnTheRequestedJacobians) {
  const JacobianReport value = check_jacobians_at_random(Spoilt{[](Rows6& r, Square6* Jx, Square6* Jy) {
                                                           if (Jx && !Jy) r[3] += 1e-6;
                                                         }},
                                                         1, 4);
  EXPECT_TRUE(std::isinf(value.relative));
  EXPECT_THAT(value.text, HasSubstr("the value"));
  const JacobianReport jacobian = check_jacobians_at_random(Spoilt{[](Rows6&, Square6* Jx, Square6* Jy) {
                                                              if (Jy && !Jx) (*Jy)(0, 0) += 1e-6;
                                                            }},
                                                            1, 4);
  EXPECT_TRUE(std::isinf(jacobian.relative));
  EXPECT_THAT(jacobian.text, HasSubstr("a Jacobian"));
}

TEST(CheckJacobians, SkipsStatesWhereTheResidualIsUndefined) {
  // Works down to 0.003: there long steps are undefined and the check uses shorter ones.
  for (const double at : {0.003, 0.01, 0.1, 1.0, 30.0})
    EXPECT_LE(check_jacobians(Positive{}, Rn<1>(Vector<1>(at))).relative, 1e-9) << at;
  EXPECT_THROW(check_jacobians(Positive{}, Rn<1>(Vector<1>(-1.0))), Error);
  EXPECT_THROW(check_jacobians_at_random(Positive{true}, 1, 4), Error);
}

TEST(RandomStates, AreRepeatableAndHaveTheRequestedDistance) {
  using States = std::tuple<SE3, SE3, R3>;
  std::mt19937_64 a(5), b(5);
  for (int i = 0; i < 40; ++i) {
    const StateDistance distance = StateDistance(i % 4);
    const auto [x, y, p] = random_states<States>(a, distance);
    const auto [x2, y2, p2] = random_states<States>(b, distance);
    EXPECT_EQ(y.matrix(), y2.matrix());
    EXPECT_EQ(p.vector(), p2.vector());
    const double angle = (x.inverse() * y).rotation().Log().norm(), pi = std::numbers::pi;
    const auto expect_between = [&](double least, double most) {
      EXPECT_TRUE(angle >= least && angle <= most) << angle;
    };
    if (distance == StateDistance::tiny) expect_between(0.0, 1e-7);
    if (distance == StateDistance::large) expect_between(1.0, 3.0);
    if (distance == StateDistance::near_pi) expect_between(pi - 0.1001, pi - 0.999e-3);
  }
}

TEST(RandomStates, RotationDirectionsAreDetected) {
  const auto turning = []<class G>(const G&) {
    std::string rows;
    for (int k = 0; k < G::dof; ++k) rows += detail::is_rotation<G>(k) ? 'r' : 't';
    return rows;
  };
  EXPECT_EQ(turning(SE3()), "tttrrr");
  EXPECT_EQ(turning(SE2()), "ttr");
  EXPECT_EQ(turning(SO3()), "rrr");
  EXPECT_EQ(turning(SE23()), "ttttttrrr");
  EXPECT_EQ(turning(Bundle<SE2, R3, SO2>()), "ttrtttr");
}

}  // namespace
}  // namespace tandem
