#include <set>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <tandem/studies/study/study.hpp>

#include "studies/scratch.hpp"

namespace tandem {
namespace {

using testing::HasSubstr;

const char* const kGaps =
    "name: gaps\nquestion: how long?\n"
    "parameters: {minutes: 2, gap: [5, 20.0], loss: ['off', 'cauchy:2']}\n"
    "models: [constant-twist, 'surge:0,2.5']\nsolvers: [automatic, ipopt]\nseeds: 3\ncovariances: false\n";

TEST(Study, ParsesYaml) {
  const Study study = parse_study(kGaps, "gaps.yaml");
  EXPECT_EQ(study.name, "gaps");
  EXPECT_EQ(study.cells(), 4u);
  EXPECT_EQ(study.trials(), 4u * 2 * 2 * 3);
  EXPECT_FALSE(study.covariances);
  const TrialSettings settings = study.settings(study.place(study.trials() - 1));
  EXPECT_EQ(settings.docking.minutes, 2);
  EXPECT_EQ(settings.docking.gap, 20);
  EXPECT_EQ(settings.loss.kind, Loss::Kind::cauchy);
  EXPECT_EQ(study.cell_text(study.place(0)), "gap=5, loss=off");
  EXPECT_TRUE(std::holds_alternative<GaussNewtonOptions>(study.solver(study.place(0))));
  EXPECT_TRUE(std::holds_alternative<AugmentedLagrangianOptions>(study.solver(study.place(2))))
      << "the model has hard limits";
}

TEST(Study, TrialNumbersMapToDistinctPlaces) {
  const Study study = parse_study(kGaps, "gaps.yaml");
  std::set<std::vector<std::size_t>> places;
  for (std::size_t i = 0; i < study.trials(); ++i) {
    const TrialPlace place = study.place(i);
    EXPECT_LT(place.replicate, study.seeds);
    places.insert({place.replicate, place.values[0], place.values[1], place.values[2], place.model, place.solver});
  }
  EXPECT_EQ(places.size(), study.trials());
}

/// The hash depends on the settings, not on the layout of the file. All trials of one replicate share a seed.
TEST(Study, HashDependsOnlyOnSettings) {
  const Study study = parse_study(kGaps, "gaps.yaml");
  std::string same = kGaps;
  same.replace(same.find("20.0"), 4, "2e1");
  same.replace(same.find("how long?"), 9, "how far?");
  EXPECT_EQ(parse_study(same, "b.yaml").hash(), study.hash());
  for (const auto& [from, to] : {std::pair{"20.0", "21"}, {"seeds: 3", "seeds: 4"}, {"ipopt", "gauss-newton"}}) {
    std::string other = kGaps;
    other.replace(other.find(from), std::string(from).size(), to);
    EXPECT_NE(parse_study(other, "b.yaml").hash(), study.hash()) << to;
  }
  EXPECT_EQ(study.settings(study.place(0)).docking.seed, study.settings(study.place(15)).docking.seed);
  EXPECT_NE(study.settings(study.place(0)).docking.seed, study.settings(study.place(16)).docking.seed);
}

/// Hashes and seeds must not change between versions, or existing studies cannot be resumed.
TEST(Study, HashesAreStable) {
  EXPECT_EQ(parse_study(kGaps, "gaps.yaml").hash(), 0xccfee258dfee0ce4u);
  EXPECT_EQ(parse_study(kGaps, "gaps.yaml").seed_of(1), 485298502654236380u);
}

TEST(Study, ErrorsNameFileLineAndKey) {
  const auto refused = [](const std::string& from, const std::string& to) {
    std::string text = kGaps;
    text.replace(text.find(from), from.size(), to);
    return error_of([&] { parse_study(text, "gaps.yaml"); });
  };
  EXPECT_THAT(refused("gap:", "gapp:"), HasSubstr("gaps.yaml:3: unknown key 'gapp' in parameters; did you mean gap?"));
  EXPECT_THAT(refused("[5, 20.0]", "[]"), HasSubstr("gaps.yaml:3: gap is empty: the grid has no trials"));
  EXPECT_THAT(refused("[constant-twist, 'surge:0,2.5']", "[]"), HasSubstr("models is empty"));
  EXPECT_THAT(refused("gap: [5, 20.0]", "newest: hypotheses"), HasSubstr("parameter newest needs parameter window"));
  EXPECT_THAT(refused("gap: [5, 20.0]", "chance: 1"), HasSubstr("parameter chance needs parameter rendezvous"));
  EXPECT_THAT(refused("gap: [5, 20.0]", "rendezvous: decoupled"), HasSubstr("parameter rendezvous replaces models"));
  EXPECT_THAT(refused("[5, 20.0]", "[5, 5.0]"), HasSubstr("gap lists '5' twice"));
  EXPECT_THAT(refused("[5, 20.0]", "[5, 1000]"), HasSubstr("gap takes a number from 0 to 600, not 1000"));
  EXPECT_THAT(refused("constant-twist", "constant-twits"), HasSubstr("did you mean"));
  EXPECT_THAT(refused("ipopt", "ipotp"), HasSubstr("did you mean ipopt?"));
  EXPECT_THAT(refused("seeds: 3", "seeds: 0"), HasSubstr("seeds must be a positive integer, not '0'"));
  EXPECT_THAT(refused("seeds: 3", "seed: 3"), HasSubstr("seeds"));
  EXPECT_THAT(refused("seeds: 3", "seeds: 2000000000"), HasSubstr("the maximum is 1e+07"));
  EXPECT_THAT(refused("question", "qestion"), HasSubstr("did you mean question?"));
  EXPECT_THAT(error_of([] { read_study("no_such_study.yaml"); }), HasSubstr("no_such_study.yaml is missing"));
}

}  // namespace
}  // namespace tandem
