#include <set>
#include <string>

#include <gtest/gtest.h>

#include <tandem/solvers/option_fields.hpp>
#include <tandem/solvers/replanning/damped_sqp_option_fields.hpp>

namespace tandem {
namespace {

struct Anything {
  template <class T>
  operator T() const;
};
/// Returns the number of members of an aggregate; its base class counts as one.
template <class T, class... Known>
constexpr int members() {
  if constexpr (requires { T{Known{}..., Anything{}}; })
    return members<T, Known..., Anything>();
  else
    return sizeof...(Known);
}

struct Names {
  std::set<std::string> all;
  template <class T, class... Values>
  void operator()(const char* name, T&, const Values&...) {
    EXPECT_TRUE(all.insert(name).second) << name;
  }
};
template <class Options>
int visited() {
  Options options;
  Names names;
  visit_options(options, names);
  return int(names.all.size());
}

TEST(OptionFields, VisitsEveryMemberOfTheOptions) {
  constexpr int callbacks = 2;  // stop and progress
  EXPECT_EQ(visited<SolverOptions>(), members<SolverOptions>() - callbacks);
  EXPECT_EQ(visited<LevenbergMarquardtOptions>() - visited<SolverOptions>(), members<LevenbergMarquardtOptions>() - 1);
  EXPECT_EQ(visited<AugmentedLagrangianOptions>() - visited<LevenbergMarquardtOptions>(),
            members<AugmentedLagrangianOptions>() - 1);
  EXPECT_EQ(visited<GaussNewtonOptions>(), visited<LevenbergMarquardtOptions>());
  EXPECT_EQ(visited<IpoptOptions>() - visited<SolverOptions>(), members<IpoptOptions>() - 1);
  EXPECT_EQ(visited<DampedSqp::Options>(), members<DampedSqp::Options>() - callbacks);
}

}  // namespace
}  // namespace tandem
