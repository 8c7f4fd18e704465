#include <atomic>
#include <thread>

#include <gtest/gtest.h>

#include <tandem/lie/sek3.hpp>
#include <tandem/residuals/prior.hpp>
#include <tandem/residuals/relative_pose.hpp>
#include <tandem/solvers/fixed_lag/fixed_lag.hpp>

namespace tandem::testing {
namespace {

TEST(FixedLagThreads, ComputeCovariancesConcurrently) {
  FixedLag lag;
  std::vector<Variable<SE3>> x;
  const SE3 step = SE3::Exp(Vector<6>(1.0, 0.1, 0, 0, 0.02, 0.05));
  const Gaussian sigma(Eigen::VectorXd::Constant(6, 0.1));
  for (int k = 0; k < 40; ++k) {
    x.push_back(lag.add(k, k == 0 ? SE3() : lag.problem().value(x.back()) * step));
    if (k == 0) lag.problem().minimize(Prior<SE3>{SE3()}, sigma, {x[0]});
    if (k > 0) lag.problem().minimize(RelativePose<SE3>{step}, sigma, {x[std::size_t(k) - 1], x.back()});
  }
  ASSERT_TRUE(lag.update().converged());
  x.push_back(lag.add(40, lag.problem().value(x.back()) * step));
  lag.problem().minimize(RelativePose<SE3>{step}, sigma, {x[39], x[40]});
  ASSERT_TRUE(lag.extend());
  std::vector<Matrix<12, 12>> alone;
  const auto last = x.back();
  x.pop_back();
  for (const auto& v : x) alone.push_back(lag.covariance(v, last));
  std::atomic<int> differing = 0;
  std::vector<std::thread> threads;
  for (std::size_t thread = 0; thread < 4; ++thread)
    threads.emplace_back([&, thread] {
      for (std::size_t i = 0; i < 20 * x.size(); ++i) {
        const std::size_t k = (i + 10 * thread) % x.size();
        differing += lag.covariance(x[k], last) != alone[k];
      }
    });
  for (auto& thread : threads) thread.join();
  EXPECT_EQ(differing, 0);
}

}  // namespace
}  // namespace tandem::testing
