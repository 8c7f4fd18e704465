#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "run_tandem.hpp"

namespace tandem {
namespace {

using testing::HasSubstr;
using Json = nlohmann::json;

/// Returns the summary of estimate without the solve time.
Json estimated(const std::string& threads) {
  const Outcome run = run_tandem({"estimate", "docking_a", "--max-keyframes", "400", "--solver", "augmented-lagrangian",
                                  "--non-holonomic", "hard", "--threads", threads, "--json"});
  EXPECT_EQ(run.status, 0) << run.errors;
  Json json = Json::parse(run.output);
  EXPECT_EQ(json.erase("solve_seconds"), 1u);
  return json;
}

TEST(ThreadsOption, ResultDoesNotDependOnThreads) {
  const Json one = estimated("1");
  for (const char* threads : {"0", "2", "3"}) EXPECT_EQ(estimated(threads), one) << threads;
}

TEST(ThreadsOption, ExistsForEveryCommandThatSolves) {
  for (const char* command :
       {"estimate", "navigate", "track", "models", "compare", "calibrate", "plan", "rendezvous", "paper"})
    EXPECT_THAT(run_tandem({command, "--help-all"}).output, HasSubstr("--threads N")) << command;
  EXPECT_THAT(rejection({"estimate", "docking_a", "--threads", "-1"}), HasSubstr("--threads"));
  EXPECT_THAT(rejection({"estimate", "docking_a", "--threads", "some"}), HasSubstr("--threads"));
}

}  // namespace
}  // namespace tandem
