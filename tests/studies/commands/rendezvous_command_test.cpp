#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "run_tandem.hpp"

namespace tandem {
namespace {

using testing::EndsWith;
using testing::HasSubstr;
using testing::UnorderedElementsAre;

TEST(RendezvousCommand, RunsMethodsOverSeeds) {
  const ScratchFolder scratch;
  const auto out = scratch.path() / "out";
  const Outcome run = run_tandem({"rendezvous", "--methods", "pursuit", "--seeds", "3", "--seed", "5", "--duration",
                                  "20", "--out", out, "--plots", "off"});
  ASSERT_EQ(run.status, 0) << run.errors;
  EXPECT_THAT(run.output, HasSubstr("pursuit"));
  EXPECT_THAT(files(out), UnorderedElementsAre("runs.csv", "rendezvous.csv", "summary.json", "run.yaml"));
  const auto summary = nlohmann::json::parse(read_file(out / "summary.json"));
  EXPECT_EQ(summary["methods"]["pursuit"]["runs"], 3);
  EXPECT_THAT(read_file(out / "runs.csv"), HasSubstr("pursuit,7,"));
}

TEST(RendezvousCommand, RunWithoutPlansHasNoPlanTimes) {
  const ScratchFolder scratch;
  const auto out = scratch.path() / "out";  // no fix arrives within 3 s, so that no plan is made
  ASSERT_EQ(run_tandem({"rendezvous", "--duration", "3", "--out", out, "--plots", "off"}).status, 0);
  EXPECT_THAT(read_file(out / "runs.csv"), EndsWith(",0,0,0,,\n"));
}

TEST(RendezvousCommand, RejectsInvalidUsage) {
  EXPECT_THAT(rejection({"rendezvous", "--methods", "pursuti"}), HasSubstr("did you mean pursuit?"));
  EXPECT_THAT(rejection({"rendezvous", "--keep-out", "4.2"}),
              HasSubstr("the standoff of 4.5 m must exceed the keep-out"));
  EXPECT_THAT(rejection({"rendezvous", "--horizon", "1"}), HasSubstr("must be 2 to 500 s"));
  EXPECT_THAT(rejection({"rendezvous", "--vehicle", "nothing.yaml"}), HasSubstr("there is no vehicle"));
}

}  // namespace
}  // namespace tandem
