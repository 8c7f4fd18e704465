#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "run_tandem.hpp"

namespace tandem {
namespace {

using testing::EndsWith;
using testing::HasSubstr;
using testing::UnorderedElementsAre;

TEST(RendezvousCommand, RunsEachMethodOverTheSeeds) {
  const ScratchFolder scratch;
  const auto out = scratch.path() / "out";
  const Outcome run = run_tandem({"rendezvous", "--methods", "pursuit", "--seeds", "3", "--seed", "5", "--time-limit",
                                  "20", "--out", out, "--plots", "off"});
  ASSERT_EQ(run.status, 0) << run.errors;
  EXPECT_THAT(run.output, HasSubstr("pursuit"));
  EXPECT_THAT(files(out), UnorderedElementsAre("runs.csv", "rendezvous.csv", "summary.json"));
  const auto summary = nlohmann::json::parse(read_file(out / "summary.json"));
  EXPECT_EQ(summary["methods"]["pursuit"]["runs"], 3);
  EXPECT_THAT(read_file(out / "runs.csv"), HasSubstr("pursuit,7,"));
}

TEST(RendezvousCommand, ARunWithoutAPlanHasNoTimesOfPlans) {
  const ScratchFolder scratch;
  const auto out = scratch.path() / "out";  // no fix comes in 3 s: it still searches
  ASSERT_EQ(run_tandem({"rendezvous", "--time-limit", "3", "--out", out, "--plots", "off"}).status, 0);
  EXPECT_THAT(read_file(out / "runs.csv"), EndsWith(",0,0,0,,\n"));
}

TEST(RendezvousCommand, WhatIsWrongIsOneSentence) {
  EXPECT_THAT(refusal({"rendezvous", "--methods", "pursuti"}), HasSubstr("did you mean pursuit?"));
  EXPECT_THAT(refusal({"rendezvous", "--keep-out", "4.2"}), HasSubstr("the standoff, 4.5 m, is inside the keep-out"));
  EXPECT_THAT(refusal({"rendezvous", "--horizon", "1"}), HasSubstr("2 to 500 s ahead"));
  EXPECT_THAT(refusal({"rendezvous", "--vehicle", "nothing.yaml"}), HasSubstr("there is no vehicle"));
}

}  // namespace
}  // namespace tandem
