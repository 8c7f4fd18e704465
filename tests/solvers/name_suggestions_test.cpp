#include <gtest/gtest.h>

#include <tandem/solvers/name_suggestions.hpp>

namespace tandem {
namespace {

TEST(NearNames, SuggestsTheNearestName) {
  const std::vector<std::string> known{"mumps", "mu_init", "mu_strategy", "max_iter", "tol"};
  EXPECT_EQ(did_you_mean("mu_stratgey", known), "; did you mean mu_strategy?");
  EXPECT_EQ(did_you_mean("max_iters", known), "; did you mean max_iter?");
  EXPECT_EQ(did_you_mean("MU_INIT", known), "; did you mean mu_init?");
  EXPECT_EQ(did_you_mean("mump", known), "; did you mean mumps?");
  EXPECT_EQ(did_you_mean("tlo", known), "; did you mean tol?");
}

TEST(NearNames, SuggestsNothingIfNoNameIsNear) {
  EXPECT_EQ(did_you_mean("hessian", {"mumps", "tol"}), "");
  EXPECT_EQ(did_you_mean("", {"mumps"}), "");
  EXPECT_EQ(did_you_mean("x", {}), "");
}

}  // namespace
}  // namespace tandem
