#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "run_tandem.hpp"

namespace tandem {
namespace {

using testing::HasSubstr;
using testing::StartsWith;
using OrderedJson = nlohmann::ordered_json;

/// Runs a command with --json and expects a document that starts with its schema.
OrderedJson document(std::vector<std::string> words, const std::string& schema) {
  words.push_back("--json");
  const Outcome run = run_tandem(words);
  EXPECT_EQ(run.status, 0) << schema << ": " << run.errors;
  EXPECT_THAT(run.output, StartsWith("{\n  \"schema\": \"tandem." + schema + "/1\",\n"));
  return OrderedJson::parse(run.output, nullptr, false);
}

TEST(JsonDocuments, EveryCommandHasOne) {
  const ScratchFolder scratch;
  const std::string docking = scratch.path() / "docking", dive = scratch.path() / "dive", out = scratch.path() / "out",
                    study = scratch.path() / "study", problem = scratch.path() / "problem.json";
  const OrderedJson simulated =
      document({"simulate", "docking", "--minutes", "1", "--seed", "4", "--out", docking}, "simulate");
  EXPECT_EQ(simulated["folder"], docking);
  EXPECT_EQ(simulated["seed"], 4);
  EXPECT_EQ(simulated["parameters"]["minutes"], 1);
  document({"simulate", "dive", "--minutes", "1", "--out", dive}, "simulate");
  document({"estimate", docking, "--out", out, "--plots", "off", "--write-problem", problem}, "estimate");
  EXPECT_THAT(read_file(out + "/summary.json"), StartsWith("{\n  \"schema\": \"tandem.estimate/1\",\n"));
  document({"navigate", dive}, "navigate");
  document({"track", docking}, "track");
  document({"models", docking, "--models", "constant-twist"}, "models");
  document({"compare", docking, "--solvers", "gauss-newton", "--constraints", "off"}, "compare");
  document({"calibrate", docking, "--free", "usbl.x", "--folds", "0"}, "calibrate");
  document({"plan", "docking_a", "--at", "60", "--horizon", "5", "--goal=-6,0,-3.4"}, "plan");
  document({"rendezvous", "--duration", "3", "--methods", "pursuit"}, "rendezvous");
  document({"solve", problem}, "solve");
  document({"scenarios"}, "scenarios");
  document({"info", docking}, "info");
  document({"export", out, "--format", "tum", "--out", scratch.path() / "tum"}, "export");
  const std::string log = scratch.write("log.csv", "t,depth_m\n0,1\n1,1\n");
  document({"import", log, "--list"}, "import-list");
  const std::string map =
      scratch.write("map.yaml", "sensors:\n  depth: {type: depth, from: log, fields: {depth: depth_m}}\n");
  document({"import", log, "--map", map, "--out", scratch.path() / "imported"}, "import");
  document({"paper", "fig3"}, "paper");
  EXPECT_EQ(document({"report", out}, "report")["page"], out + "/report.html");
  EXPECT_GT(document({"study", "list"}, "study-list")["studies"].size(), 10u);
  const std::string file = scratch.write("small.yaml",
                                         "name: small\nquestion: Does it run?\nparameters: {minutes: 1}\n"
                                         "models: [constant-twist]\nseeds: 2\n");
  const OrderedJson run = document({"study", "run", file, "--out", study}, "study");
  EXPECT_EQ(run["finished"], 2);
  EXPECT_EQ(document({"study", "show", study}, "study"), run);
  document({"study", "export", study, "--plots", "off"}, "study");
  document({"study", "trial", study, "1", "--out", scratch.path() / "trial"}, "study-trial");
}

TEST(JsonDocuments, LinesOfTrackHaveSchema) {
  const Outcome run = run_tandem({"track", "docking_a", "--until", "5", "--json-lines"});
  ASSERT_EQ(run.status, 0) << run.errors;
  EXPECT_THAT(run.output, StartsWith("{\"schema\":\"tandem.track-line/1\",\"t\":"));
}

/// The run file of a study survives `study export` into the same folder.
TEST(JsonDocuments, ExportKeepsRunFileOfStudy) {
  const ScratchFolder scratch;
  const std::string file = scratch.write("small.yaml",
                                         "name: small\nquestion: Does it run?\nparameters: {minutes: 1}\n"
                                         "models: [constant-twist]\nseeds: 1\n");
  const std::string out = scratch.path() / "out";
  ASSERT_EQ(run_tandem({"study", "run", file, "--out", out, "-q"}).status, 0);
  const std::string run_file = read_file(out + "/run.yaml");
  EXPECT_THAT(run_file, HasSubstr("\naction: run\n"));
  ASSERT_EQ(run_tandem({"study", "export", out, "--plots", "off", "-q"}).status, 0);
  EXPECT_EQ(read_file(out + "/run.yaml"), run_file);
}

}  // namespace
}  // namespace tandem
