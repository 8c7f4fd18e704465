// SO3, SE2, SE3 and SE23 against values computed with 60 digits.

#include <fstream>
#include <iostream>
#include <string>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <tandem/lie/se2.hpp>
#include <tandem/lie/sek3.hpp>
#include <tandem/lie/testing.hpp>

#include "shared_data.hpp"

namespace tandem {
namespace {

// Rounding the true value to double costs up to 1.1e-16; the tolerance allows about twenty rounding errors.
constexpr double kTolerance = 2e-15;

Eigen::MatrixXd matrix(const nlohmann::json& rows) {
  Eigen::MatrixXd m(rows.size(), rows.at(0).size());
  for (Eigen::Index i = 0; i < m.rows(); ++i)
    for (Eigen::Index j = 0; j < m.cols(); ++j)
      m(i, j) = rows.at(static_cast<std::size_t>(i)).at(static_cast<std::size_t>(j)).get<double>();
  return m;
}

template <LieGroup G>
void compare(const nlohmann::json& sample, check::Errors& errors) {
  ASSERT_EQ(sample.at("tangent").size(), static_cast<std::size_t>(G::dof));
  typename G::Tangent v;
  for (int i = 0; i < G::dof; ++i) v[i] = sample.at("tangent").at(static_cast<std::size_t>(i)).get<double>();
  const G x = G::Exp(v);
  errors.compare("Exp", check::dense(x.matrix()), matrix(sample.at("exp")));
  errors.compare("Log", check::dense(x.Log()), check::dense(v));
  errors.compare("Ad(Exp)", check::dense(x.Ad()), matrix(sample.at("adjoint_of_exp")));
  errors.compare("Jl", check::dense(G::Jl(v)), matrix(sample.at("left_jacobian")));
  errors.compare("Jr", check::dense(G::Jr(v)), matrix(sample.at("right_jacobian")));
  errors.compare("Jl_inverse", check::dense(G::Jl_inverse(v)), matrix(sample.at("left_jacobian_inverse")));
  errors.compare("Jr_inverse", check::dense(G::Jr_inverse(v)), matrix(sample.at("right_jacobian_inverse")));
}

template <LieGroup G>
void compare_all(const std::string& name) {
  TANDEM_NEEDS_SHARED(34 * 7);
  std::ifstream file(shared_path("reference/lie_groups.json"));
  ASSERT_TRUE(file) << "cannot read " << shared_path("reference/lie_groups.json");
  check::Errors errors;
  int samples = 0;
  for (const nlohmann::json& sample : nlohmann::json::parse(file)) {
    if (sample.at("group") != name) continue;
    compare<G>(sample, errors);
    ++samples;
  }
  EXPECT_EQ(samples, 34);
  EXPECT_EQ(errors.report(kTolerance), "");
  std::cout << name << ": largest error " << errors.largest() << '\n';
}

TEST(Oracle, SO3) { compare_all<SO3>("SO3"); }
TEST(Oracle, SE2) { compare_all<SE2>("SE2"); }
TEST(Oracle, SE3) { compare_all<SE3>("SE3"); }
TEST(Oracle, SE23) { compare_all<SE23>("SE23"); }

}  // namespace
}  // namespace tandem
