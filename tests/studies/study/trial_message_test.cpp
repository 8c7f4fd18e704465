#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <tandem/studies/study/trial_message.hpp>

#include "studies/scratch.hpp"

namespace tandem {
namespace {

TEST(TrialMessage, RoundTripsExactly) {
  TrialResult result;
  result.trial = 1234567;
  result.status = "failed";
  result.message = std::string("a\0b", 3);
  result.set("cost", 0.1 + 0.2);
  result.set("violation", -0.0);
  const TrialResult read = deserialized(serialized(result));
  EXPECT_EQ(read.trial, result.trial);
  EXPECT_EQ(read.status, result.status);
  EXPECT_EQ(read.message, result.message);
  EXPECT_EQ(read.metrics, result.metrics);
}

TEST(TrialMessage, RejectsWrongLength) {
  const std::string bytes = serialized(TrialResult());
  for (const std::string& wrong :
       {bytes.substr(0, bytes.size() - 1), bytes + "x", std::string(), std::string(16, '\xff')})
    EXPECT_THAT(error_of([&] { deserialized(wrong); }), testing::HasSubstr("a trial message is"));
}

}  // namespace
}  // namespace tandem
