#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <tandem/studies/navigation/systematic_error_estimates.hpp>

namespace tandem {
namespace {

using testing::HasSubstr;
using testing::Not;

TEST(SystematicErrorEstimates, VerdictComparesPosteriorWithPrior) {
  const SystematicErrorEstimate found{"usbl.scale", 0.02, 0.05, 0.003}, untold{"camera.delay", 0.1, 0.3, 0.29},
      inconsistent_with_prior{"optical.delay", -5.7, 0.3, 0.2};
  const SystematicErrorEstimate without_errors{"dvl.scale", 0.02, 0.05};
  EXPECT_EQ((SystematicErrorEstimate{"usbl.scale", 0.02, 0.05, 0.04}.verdict()),
            SystematicErrorVerdict::not_identifiable)
      << "the prior is more informative";
  EXPECT_EQ(found.verdict(), SystematicErrorVerdict::identifiable);
  EXPECT_EQ(untold.verdict(), SystematicErrorVerdict::not_identifiable);
  EXPECT_EQ(inconsistent_with_prior.verdict(), SystematicErrorVerdict::inconsistent_with_prior);
  EXPECT_EQ(without_errors.verdict(), SystematicErrorVerdict::no_standard_error);
  const std::string all = systematic_errors_text({found, untold, inconsistent_with_prior, without_errors});
  for (const SystematicErrorEstimate& c : {found, untold, inconsistent_with_prior, without_errors})
    EXPECT_THAT(all, HasSubstr(c.text() + ": " + std::string(text(c.verdict())) + "\n"));
  EXPECT_THAT(all, HasSubstr("more than two prior standard deviations from 0"));
  EXPECT_THAT(systematic_errors_text({found, untold}), Not(HasSubstr("prior standard deviations")))
      << "the advice does not apply";
}

TEST(SystematicErrorEstimates, VerdictUsesHeldOutGain) {
  SystematicErrorEstimate c{"usbl.scale", 0.02, 0.05, 0.003};
  c.held_out = {3.0, 1.0};
  EXPECT_EQ(c.verdict(), SystematicErrorVerdict::improves_prediction);
  c.held_out = {3.0, 1.6};
  EXPECT_EQ(c.verdict(), SystematicErrorVerdict::no_improvement) << "less than two standard errors";
  c.held_out = {0.9, 0.1};
  EXPECT_EQ(c.verdict(), SystematicErrorVerdict::no_improvement);
  c.value = 0.2;
  EXPECT_EQ(c.verdict(), SystematicErrorVerdict::inconsistent_with_prior);
  c.held_out = {3.0, 1.0};
  EXPECT_EQ(c.verdict(), SystematicErrorVerdict::inconsistent_but_improves_prediction)
      << "the held-out data support it";
  c.value = 0.02, c.sigma = 0.05;
  EXPECT_EQ(c.verdict(), SystematicErrorVerdict::not_identifiable) << "less informative than the prior";
}

}  // namespace
}  // namespace tandem
