#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <tandem/studies/study/study_report.hpp>

#include "studies/scratch.hpp"

namespace tandem {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

/// Synthetic results: in replicate r, the error of the first model is 1 + r / 10. The error of the second model is 1.5
/// times as large.
struct SyntheticResults {
  Study study = parse_study(
      "name: made\nmodels: [constant-twist, mode-b]\nparameters: {start_position: [0, 2]}\nseeds: 40\n", "made.yaml");
  std::vector<TrialResult> results;

  SyntheticResults() {
    for (std::size_t i = 0; i < study.trials(); ++i) {
      const TrialPlace place = study.place(i);
      TrialResult& result = results.emplace_back();
      result.trial = i;
      result.status = "converged";
      const double error = (1 + double(place.replicate) / 10) * (place.model == 1 ? 1.5 : 1.0);
      result.set("at_position_error_m", error);
      result.set("raw_at_position_error_m", 2 * (1 + double(place.replicate) / 10));
      result.set("nees_chaser", place.model == 1 ? 24 : 6);
      result.set("nis_usbl", place.model == 1 ? 3 : 0.75);
      result.set("cost", 100 + (place.values[0] == 1 && place.replicate % 4 == 0 ? 1 : 0));
    }
  }
};

TEST(StudyTables, PairsAreComparedPerSeed) {
  const SyntheticResults made;
  const StudyTables tables = study_tables(made.study, made.results);
  ASSERT_EQ(tables.groups.size(), 4u);
  for (const StudyPair& pair : tables.pairs) {
    if (pair.metric != "at_position_error_m") continue;
    const double expected = pair.base == "raw" ? (pair.group->model == 1 ? 0.75 : 0.5) : 1.5;
    EXPECT_NEAR(pair.ratio.value, expected, 1e-12);
    EXPECT_NEAR(pair.ratio.low, expected, 1e-12) << "common noise cancels";
  }
}

TEST(StudyTables, VerdictsNameOptimismAndFactor) {
  const SyntheticResults made;
  const StudyTables tables = study_tables(made.study, made.results);
  std::vector<std::string> verdicts;
  for (const StudyConsistency& row : tables.consistency)
    if (row.group->cell == 0) verdicts.push_back(row.group->model_text + " " + row.metric + " " + row.verdict);
  EXPECT_THAT(verdicts, ElementsAre("constant-twist nees_chaser consistent",
                                    "constant-twist nis_usbl pessimistic by a factor 2.00",
                                    "mode-b nees_chaser optimistic by a factor 2.00", "mode-b nis_usbl consistent"));
}

/// The docking rate is a share. Its binomial interval stays within [0, 1], even if all runs dock.
TEST(StudyTables, SharesHaveWilsonIntervals) {
  const Study study = parse_study(
      "name: r\nmodels: [constant-twist]\nparameters: {rendezvous: [decoupled, pursuit]}\nseeds: 10\n", "r.yaml");
  std::vector<TrialResult> results(study.trials());
  for (std::size_t i = 0; i < results.size(); ++i) {
    results[i].trial = i;
    results[i].status = "converged";
    results[i].set("docked", study.place(i).values[0] == 0 || i < 6 ? 1 : 0);  // 10 of 10 dock, and 3 of 10
    results[i].set("dock_miss_m", 0.2 + 0.01 * double(i));
  }
  const StudyTables tables = study_tables(study, results);
  std::vector<Interval> docked;
  for (const StudyMean& mean : tables.means)
    if (mean.metric == "docked") docked.push_back(mean.mean);
  ASSERT_EQ(docked.size(), 2u);
  EXPECT_EQ(docked[0].value, 1.0);
  EXPECT_NEAR(docked[0].low, 0.7225, 1e-4);
  EXPECT_NEAR(docked[0].high, 1.0, 1e-12);
  EXPECT_NEAR(docked[1].low, 0.1078, 1e-4);
  EXPECT_NEAR(docked[1].high, 0.6032, 1e-4);
  const std::string text = study_report(study, tables);
  EXPECT_THAT(text, HasSubstr("100 % (72 … 100)"));
  EXPECT_THAT(text, HasSubstr("miss [m]"));
  EXPECT_EQ(text.find("raw"), std::string::npos) << "a rendezvous has no raw errors";
}

TEST(StudyTables, PlanarStudiesHaveFewerDegreesOfFreedom) {
  const Study study = parse_study("name: p\nmodels: [mode-b]\nparameters: {planar: [0, 1]}\nseeds: 20\n", "p.yaml");
  std::vector<TrialResult> results(study.trials());
  for (std::size_t i = 0; i < results.size(); ++i) {
    results[i].trial = i;
    results[i].status = "converged";
    results[i].set("nees_chaser", study.place(i).values[0] == 0 ? 6 : 3);
  }
  for (const StudyConsistency& row : study_tables(study, results).consistency) {
    EXPECT_EQ(row.degrees, row.group->planar ? 3 : 6);
    EXPECT_EQ(row.verdict, "consistent");
  }
}

TEST(StudyTables, CountsTrialsAtTheBestCost) {
  const SyntheticResults made;
  const StudyTables tables = study_tables(made.study, made.results);
  for (const StudyGroup& group : tables.groups) EXPECT_EQ(group.reached_best, group.cell == 0 ? 40u : 30u);
  EXPECT_THAT(study_report(made.study, tables), HasSubstr("75 % (60 … 86)"));
}

TEST(StudyTables, FailedTrialsAreCountedAndExcludedFromMeans) {
  SyntheticResults made;
  made.results[0].status = "failed";
  made.results[0].set("at_position_error_m", 1e6);
  const StudyTables tables = study_tables(made.study, made.results);
  EXPECT_EQ(tables.groups[0].trials, 40u);
  EXPECT_EQ(tables.groups[0].converged, 39u);
  for (const StudyMean& mean : tables.means) EXPECT_LT(mean.mean.value, 1e3) << mean.metric;
}

TEST(StudyTables, WritesFilesWithColumns) {
  const SyntheticResults made;
  const ScratchFolder folder;
  write_study_tables(made.study, study_tables(made.study, made.results), folder.path());
  EXPECT_THAT(files(folder.path()),
              testing::UnorderedElementsAre("tables.txt", "summary.csv", "pairs.csv", "consistency.csv", "timing.csv"));
  EXPECT_THAT(read_file(folder.path() / "summary.csv"),
              HasSubstr("cell,model,solver,metric,n,mean,low,high\nstart_position=0,constant-twist,automatic,"));
  EXPECT_THAT(trials_csv(made.study, made.results),
              HasSubstr("trial,replicate,start_position,model,solver,status,message,at_position_keyframes"));
}

}  // namespace
}  // namespace tandem
