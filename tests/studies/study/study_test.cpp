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
    "parameters: {minutes: 2, gap: [5, 20.0], loss: [none, 'cauchy:2']}\n"
    "models: [constant-twist, 'surge:0,2.5']\nsolvers: [automatic, ipopt]\nseeds: 3\ncovariances: false\n";

TEST(Study, IsReadFromYaml) {
  const Study study = parse_study(kGaps, "gaps.yaml");
  EXPECT_EQ(study.name, "gaps");
  EXPECT_EQ(study.cells(), 4u);
  EXPECT_EQ(study.trials(), 4u * 2 * 2 * 3);
  EXPECT_FALSE(study.covariances);
  const TrialSettings settings = study.settings(study.place(study.trials() - 1));
  EXPECT_EQ(settings.docking.minutes, 2);
  EXPECT_EQ(settings.docking.gap, 20);
  EXPECT_EQ(settings.loss.kind, Loss::Kind::cauchy);
  EXPECT_EQ(study.cell_text(study.place(0)), "gap=5, loss=none");
  EXPECT_TRUE(std::holds_alternative<GaussNewtonOptions>(study.solver(study.place(0))));
  EXPECT_TRUE(std::holds_alternative<AugmentedLagrangianOptions>(study.solver(study.place(2)))) << "a hard limit";
}

TEST(Study, EachTrialHasAPlaceOfItsOwn) {
  const Study study = parse_study(kGaps, "gaps.yaml");
  std::set<std::vector<std::size_t>> places;
  for (std::size_t i = 0; i < study.trials(); ++i) {
    const TrialPlace place = study.place(i);
    EXPECT_LT(place.replicate, study.seeds);
    places.insert({place.replicate, place.values[0], place.values[1], place.values[2], place.model, place.solver});
  }
  EXPECT_EQ(places.size(), study.trials());
}

/// Settings decide, not how the file is laid out; and all of one replicate draw from one seed.
TEST(Study, TheHashIsOfWhatCounts) {
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

/// Trials that were done before have the seeds and hashes that they have now.
TEST(Study, HashesStay) {
  EXPECT_EQ(parse_study(kGaps, "gaps.yaml").hash(), 0xe08c2e0bb5dc17f9u);
  EXPECT_EQ(parse_study(kGaps, "gaps.yaml").seed_of(1), 1263625561012752501u);
}

TEST(Study, WhatIsWrongIsNamedWithItsLine) {
  const auto refused = [](const std::string& from, const std::string& to) {
    std::string text = kGaps;
    text.replace(text.find(from), from.size(), to);
    return error_of([&] { parse_study(text, "gaps.yaml"); });
  };
  EXPECT_THAT(refused("gap:", "gapp:"), HasSubstr("gaps.yaml:3: unknown key 'gapp' in parameters; did you mean gap?"));
  EXPECT_THAT(refused("[5, 20.0]", "[]"), HasSubstr("gaps.yaml:3: gap is empty: the grid has no trials"));
  EXPECT_THAT(refused("[constant-twist, 'surge:0,2.5']", "[]"), HasSubstr("models is empty"));
  EXPECT_THAT(refused("gap: [5, 20.0]", "newest: hypotheses"), HasSubstr("newest is of a window: give window"));
  EXPECT_THAT(refused("gap: [5, 20.0]", "chance: 1"), HasSubstr("chance is of a rendezvous: give rendezvous too"));
  EXPECT_THAT(refused("gap: [5, 20.0]", "rendezvous: decoupled"), HasSubstr("give one model alone"));
  EXPECT_THAT(refused("[5, 20.0]", "[5, 5.0]"), HasSubstr("gap has '5' twice"));
  EXPECT_THAT(refused("[5, 20.0]", "[5, 1000]"), HasSubstr("gap is from 0 to 600, not 1000"));
  EXPECT_THAT(refused("constant-twist", "constant-twits"), HasSubstr("did you mean"));
  EXPECT_THAT(refused("ipopt", "ipotp"), HasSubstr("did you mean ipopt?"));
  EXPECT_THAT(refused("seeds: 3", "seeds: 0"), HasSubstr("seeds is a whole number above zero, not '0'"));
  EXPECT_THAT(refused("seeds: 3", "seed: 3"), HasSubstr("seeds"));
  EXPECT_THAT(refused("seeds: 3", "seeds: 2000000000"), HasSubstr("more than 1e+07"));
  EXPECT_THAT(refused("question", "qestion"), HasSubstr("did you mean question?"));
  EXPECT_THAT(error_of([] { read_study("no_such_study.yaml"); }), HasSubstr("no_such_study.yaml is missing"));
}

}  // namespace
}  // namespace tandem
