#include <gtest/gtest.h>

#include <tandem/studies/estimation/estimate.hpp>

#include "studies/mode_a_reference.hpp"

/// Mode A with only the soft roll-pitch prior, compared with costs and errors of an independent implementation.
namespace tandem {
namespace {

Estimate estimate(const Reference& reference, const AnySolver& solver) {
  return tandem::estimate(scenario_of(reference), {}, solver);
}

void expect_the_same_optimum(const Reference& reference, const Estimate& estimate) {
  SCOPED_TRACE(reference.scenario + " by " + estimate.summary.solver);
  EXPECT_TRUE(estimate.summary.converged()) << estimate.summary.message;
  EXPECT_LE(estimate.summary.cost, reference.cost * (1 + 1e-6));
  EXPECT_EQ(estimate.keyframes.size(), reference.keyframes);
  EXPECT_EQ(estimate.residual_blocks, reference.residual_blocks);
  ASSERT_EQ(reference.errors.size(), 16u);
  const double* expected = reference.errors.data();
  for (const std::optional<KeyframeType> type : std::initializer_list<std::optional<KeyframeType>>{
           KeyframeType::position, KeyframeType::pose, KeyframeType::none, std::nullopt}) {
    const ErrorSummary errors = summarise(estimate.errors, type);
    EXPECT_EQ(errors.n, expected[0]);
    EXPECT_NEAR(errors.position->mean, expected[1], 0.02 * expected[1]);
    EXPECT_NEAR(errors.position->std, expected[2], 0.02 * expected[2]);
    EXPECT_NEAR(errors.orientation->mean, expected[3], 0.02 * expected[3]);
    expected += 4;
  }
}

TEST(RecordedReference, GaussNewtonReachesReferenceCost) {
  TANDEM_NEEDS_SHARED(10);
  ASSERT_EQ(references().size(), 10u);
  for (const Reference& reference : references())
    expect_the_same_optimum(reference, estimate(reference, GaussNewtonOptions{}));
}

TEST(RecordedReference, IpoptReachesReferenceCost) {
  TANDEM_NEEDS_SHARED(10);
  if (!ipopt_available()) GTEST_SKIP() << "a build without Ipopt";
  for (const Reference& reference : references())
    expect_the_same_optimum(reference, estimate(reference, IpoptOptions{}));
}

TEST(RecordedReference, NloptReachesReferenceCostOnSmallScenarios) {
  TANDEM_NEEDS_SHARED(8);
  if (nlopt_algorithms().empty()) GTEST_SKIP() << "a build without NLopt";
  for (const Reference& reference : references()) {
    if (reference.keyframes >= 80) continue;
    SCOPED_TRACE(reference.scenario);
    const Summary summary = estimate(reference, NloptOptions{}).summary;
    EXPECT_TRUE(summary.converged()) << summary.message;
    EXPECT_LE(summary.cost, reference.cost * (1 + 1e-4));
  }
}

}  // namespace
}  // namespace tandem
