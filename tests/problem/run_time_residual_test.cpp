#include <array>
#include <new>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <tandem/problem/file/problem_file.hpp>
#include <tandem/problem/nlp_evaluator.hpp>
#include <tandem/residuals/prior.hpp>

namespace tandem {
namespace {

using detail::GroupType;
using detail::ResidualFunctions;
using detail::RunTimeResidualType;

int prepared = 0;

/// e = x − number on R1, without a C++ type for each kind.
struct Offset {
  double number;
};

ResidualFunctions offset_functions(std::string_view name) {
  static constexpr std::array<int, 1> dofs{1};
  ResidualFunctions f{};
  f.name = name;
  f.type = &typeid(Offset);
  f.dim = f.arity = 1;
  f.dofs = dofs.data();
  f.size = sizeof(Offset);
  f.alignment = alignof(Offset);
  f.copy = [](const void* from, void* to) { ::new (to) Offset(*static_cast<const Offset*>(from)); };
  f.relocate = [](void* from, void* to) { ::new (to) Offset(*static_cast<const Offset*>(from)); };
  f.destroy = [](void*) {};
  f.evaluate = [](const void* residual, const void* const* x, double* r) {
    *r = static_cast<const Rn<1>*>(x[0])->vector()[0] - static_cast<const Offset*>(residual)->number;
  };
  f.linearize = [](const void* residual, const void* const* x, const int* offset, double* r, double* const* J) {
    *r = static_cast<const Rn<1>*>(x[0])->vector()[0] - static_cast<const Offset*>(residual)->number;
    if (offset[0] >= 0) *J[0] = 1.0;
  };
  return f;
}

std::vector<const GroupType*> vector_states() {
  for (const GroupType* group : detail::group_types())
    if (group->type == typeid(Rn<1>)) return {group};
  return {};
}

class RunTimeResidual : public ::testing::Test {
 protected:
  RunTimeResidual() { problem_.minimize(Prior<Rn<1>>{Rn<1>()}, Gaussian{1.0}, {x_}); }
  Block minimize(const RunTimeResidualType& type, double number) {
    const Offset offset{number};
    const std::array<VariableHandle, 1> x{x_};
    return problem_.minimize(type, &offset, x, Gaussian{1.0});
  }
  double cost() { return NlpEvaluator(problem_).cost(); }

  Problem problem_;
  Variable<Rn<1>> x_ = problem_.add(Rn<1>(), "x");
  ResidualFunctions f_ = offset_functions("offset"), g_ = offset_functions("other offset");
  RunTimeResidualType offset_{f_, false, vector_states(), nullptr}, other_{g_, false, vector_states(), nullptr};
  RunTimeResidualType bound_{f_, true, vector_states(), nullptr};
};

TEST_F(RunTimeResidual, AddsItsCost) {
  minimize(offset_, 2.0);
  EXPECT_DOUBLE_EQ(cost(), 2.0);
}

TEST_F(RunTimeResidual, KeepsTypesApartThatShareTheirCppType) {
  const Block a = minimize(offset_, 2.0), b = minimize(other_, 2.0);
  EXPECT_NE(a.pool, b.pool);
  EXPECT_EQ(problem_.describe(a), "offset of x");
  EXPECT_EQ(problem_.describe(b), "other offset of x");
}

TEST_F(RunTimeResidual, IsCopiedWithItsProblem) {
  minimize(offset_, 2.0);
  Problem copy = problem_.copy();
  EXPECT_DOUBLE_EQ(NlpEvaluator(copy).cost(), 2.0);
}

TEST_F(RunTimeResidual, IsNotWrittenToFiles) {
  minimize(offset_, 2.0);
  EXPECT_THAT([this] { problem_text(problem_); },
              ::testing::ThrowsMessage<BadInputError>(::testing::HasSubstr("defined at run time")));
}

TEST_F(RunTimeResidual, RejectsWrongVariablesAndBounds) {
  const Offset offset{0.0};
  const Variable<R2> y = problem_.add(R2(), "y");
  const std::array<VariableHandle, 1> other_group{y};
  const std::array<VariableHandle, 2> two{x_, x_};
  const std::array<VariableHandle, 1> x{x_};
  const std::array<double, 1> zero{0.0};
  const std::array<double, 2> zeros{0.0, 0.0};
  EXPECT_THROW(problem_.minimize(offset_, &offset, other_group, Gaussian{1.0}), BadInputError);
  EXPECT_THROW(problem_.minimize(offset_, &offset, two, Gaussian{1.0}), BadInputError);
  EXPECT_THROW(problem_.minimize(bound_, &offset, x, Gaussian{1.0}), BadInputError);
  EXPECT_THROW(problem_.subject_to(bound_, &offset, x, zeros, zeros), BadInputError);
  EXPECT_THROW(problem_.subject_to(offset_, &offset, x, zero, zero), BadInputError);
  EXPECT_EQ(problem_.num_soft_blocks(), 1);
  EXPECT_EQ(problem_.num_hard_blocks(), 0);
  problem_.subject_to(bound_, &offset, x, zero, zero);
  EXPECT_EQ(problem_.num_hard_blocks(), 1);
}

TEST_F(RunTimeResidual, IsPreparedOnceForEachEvaluation) {
  const RunTimeResidualType type(f_, false, vector_states(), [](const detail::PoolBase& pool, bool) {
    const void* x = nullptr;
    for (int i = 0; i < pool.size(); ++i) pool.points(i, &x);
    EXPECT_EQ(static_cast<const Rn<1>*>(x)->vector()[0], 0.0);
    ++prepared;
  });
  for (int i = 0; i < 100; ++i) minimize(type, 1.0);
  NlpEvaluator nlp(problem_);
  prepared = 0;
  nlp.cost();
  EXPECT_EQ(prepared, 1);
  Eigen::VectorXd gradient(nlp.num_unknowns());
  nlp.gradient(gradient);
  EXPECT_EQ(prepared, 2);
  EXPECT_DOUBLE_EQ(gradient[0], -100.0);
}

}  // namespace
}  // namespace tandem
