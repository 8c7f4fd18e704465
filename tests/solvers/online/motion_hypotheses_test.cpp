#include <cmath>
#include <numbers>
#include <random>

#include <Eigen/LU>
#include <gtest/gtest.h>

#include <tandem/lie/error.hpp>
#include <tandem/solvers/online/motion_hypotheses.hpp>

namespace tandem::testing {
namespace {

constexpr HypothesesNoise kNoise{
    .drift = 0.2, .drift_time = 60, .surge = 0.04, .yaw_rate = 0.0075, .yaw_time = 60, .climb = 0.05, .tilt = 6e-4};

/// A vessel at 1.2 m/s that moves straight for 100 s and then turns at 0.04 rad/s.
struct Vessel {
  static constexpr double speed = 1.2, rate = 0.04, turns_at = 100;
  static double heading(double t) { return 0.5 + rate * std::max(0.0, t - turns_at); }
  static Vector<3> position(double t) {
    const double straight = std::min(t, turns_at), h = heading(t), radius = speed / rate;
    Vector<3> p(speed * straight * std::cos(0.5), speed * straight * std::sin(0.5), -2);
    if (t > turns_at) p += radius * Vector<3>(std::sin(h) - std::sin(0.5), std::cos(0.5) - std::cos(h), 0);
    return p;
  }
};

class Fixes {
 public:
  explicit Fixes(std::uint64_t seed) : random_(seed) {}
  TargetFix position(double t, double sigma) {
    return {Vessel::position(t) + sigma * Vector<3>(normal_(random_), normal_(random_), normal_(random_)),
            sigma * sigma * Matrix<3, 3>::Identity()};
  }
  TargetFix pose(double t) {
    TargetFix fix = position(t, 0.1);
    fix.heading = std::remainder(Vessel::heading(t) + 0.03 * normal_(random_), 2 * std::numbers::pi);
    fix.heading_sigma = 0.03;
    return fix;
  }

 private:
  std::mt19937_64 random_;
  std::normal_distribution<double> normal_;
};

TEST(MotionHypotheses, StartAtTheFirstFix) {
  MotionHypotheses target(kNoise);
  target.add(1.0, {});
  EXPECT_FALSE(target.started());
  const TargetFix fix{{3, 4, 5}, 0.25 * Matrix<3, 3>::Identity()};
  target.add(2.0, fix);
  ASSERT_TRUE(target.started());
  const TargetMoments m = target.at(2.0);
  EXPECT_EQ(m.position, fix.position);
  EXPECT_EQ(m.covariance, fix.covariance);
  EXPECT_FALSE(m.heading) << "a single position determines no course";
}

TEST(MotionHypotheses, PredictTheContinuationOfATurn) {
  Fixes fixes(1);
  MotionHypotheses target(kNoise);
  for (double t = 0; t <= 130; t += 0.5) target.add(t, fixes.pose(t));
  const TargetMoments now = target.at(130), ahead = target.at(140);
  EXPECT_LE((now.position - Vessel::position(130)).norm(), 0.3);
  EXPECT_LE(std::abs(std::remainder(now.heading.value() - Vessel::heading(130), 2 * std::numbers::pi)), 0.05);
  EXPECT_NEAR(now.velocity.norm(), Vessel::speed, 0.1);
  // A straight prediction would be wrong by 2.4 m after 10 s.
  EXPECT_LE((ahead.position - Vessel::position(140)).norm(), 1.2);
  EXPECT_GT(ahead.covariance.trace(), now.covariance.trace());
}

/// Without measured orientations.
TEST(MotionHypotheses, EstimateTheHeadingFromTheCourse) {
  Fixes fixes(2);
  MotionHypotheses target(kNoise);
  for (double t = 0; t <= 90; t += 3) target.add(t, fixes.position(t, 1.0));
  EXPECT_LE(std::abs(std::remainder(target.at(90).heading.value() - Vessel::heading(90), 2 * std::numbers::pi)), 0.2);
}

TEST(MotionHypotheses, ReplaceAFailedCourse) {
  Fixes fixes(3);
  MotionHypotheses target(kNoise);
  for (double t = 0; t <= 60; t += 0.5) target.add(t, fixes.pose(t));
  // The vessel turns by 90° at once.
  const Vector<3> corner = Vessel::position(60), way(-std::sin(0.5), std::cos(0.5), 0);
  for (double t = 60.5; t <= 75; t += 0.5) {
    TargetFix fix = fixes.position(0, 0.1);
    fix.position += corner + Vessel::speed * (t - 60) * way - Vessel::position(0);
    fix.heading = 0.5 + std::numbers::pi / 2;
    fix.heading_sigma = 0.03;
    target.add(t, fix);
  }
  const TargetMoments now = target.at(75);
  EXPECT_LE((now.position - corner - Vessel::speed * 15 * way).norm(), 0.4);
  EXPECT_LE(std::abs(std::remainder(now.heading.value() - 0.5 - std::numbers::pi / 2, 2 * std::numbers::pi)), 0.1);
}

/// Mean NEES of the newest state and of a prediction by 10 s.
TEST(StatisticalMotionHypotheses, CovariancesMatchTheErrors) {
  double now = 0, ahead = 0;
  const int runs = 200;
  for (int run = 0; run < runs; ++run) {
    Fixes fixes(100 + std::uint64_t(run));
    MotionHypotheses target(kNoise);
    for (double t = 0; t <= 80; t += 4) target.add(t, fixes.position(t, 1.0));
    const auto nees = [&](double t) {
      const TargetMoments m = target.at(t);
      const Vector<3> e = m.position - Vessel::position(t);
      return e.dot(m.covariance.inverse() * e);
    };
    now += nees(80) / runs;
    ahead += nees(90) / runs;
  }
  EXPECT_GT(now, 3 / 1.5);
  EXPECT_LT(now, 3 * 1.5);
  EXPECT_LT(ahead, 3 * 1.5);  // the vessel moves straight, so predictions are better than the noise implies
}

/// Mean position error now and 12 s ahead [m], and mean trace of the covariance [m²].
struct Accuracy {
  double error = 0, ahead = 0, trace = 0;
};
/// Tracks the vessel with fixes every 2 s of true standard deviation `sigma` and stated one `stated`.
Accuracy accuracy(const HypothesesNoise& noise, double sigma, double stated, const Loss& loss = {}) {
  Accuracy mean;
  const int runs = 40;
  for (int run = 0; run < runs; ++run) {
    Fixes fixes(300 + std::uint64_t(run));
    MotionHypotheses target(noise);
    for (double t = 0; t <= 160; t += 2) {
      TargetFix fix = fixes.position(t, sigma);
      fix.covariance = stated * stated * Matrix<3, 3>::Identity();
      fix.loss = loss;
      target.add(t, fix);
    }
    const TargetMoments m = target.at(160);
    mean.error += (m.position - Vessel::position(160)).norm() / runs;
    mean.ahead += (target.at(172).position - Vessel::position(172)).norm() / runs;
    mean.trace += m.covariance.trace() / runs;
  }
  return mean;
}

HypothesesNoise times(double factor) {
  HypothesesNoise noise = kNoise;
  noise.surge *= factor;
  noise.yaw_rate *= factor;
  noise.drift *= std::max(factor, 1.0);
  return noise;
}

TEST(StatisticalMotionHypotheses, AdaptToTheAgilityOfTheTarget) {
  const double known = accuracy(kNoise, 0.2, 0.2).ahead;
  EXPECT_LE(accuracy(times(1.0 / 3), 0.2, 0.2).ahead, 1.25 * known);
  EXPECT_LE(accuracy(times(3), 0.2, 0.2).ahead, 1.25 * known) << "3.7 times without adaptation";
}

TEST(StatisticalMotionHypotheses, AdaptToFixesThatAreBetterThanStated) {
  const Accuracy known = accuracy(kNoise, 0.3, 0.3), better = accuracy(kNoise, 0.3, 0.6);
  EXPECT_LE(better.error, 1.1 * known.error);
  EXPECT_LE(better.trace, 1.3 * known.trace) << "four times without adaptation";
}

/// With small assumed noise, a loss down-weights more fixes. This must not make small noise more likely.
TEST(StatisticalMotionHypotheses, ALossDoesNotBiasTheNoiseScale) {
  const Accuracy plain = accuracy(kNoise, 0.3, 0.3), robust = accuracy(kNoise, 0.3, 0.3, Cauchy(2.0));
  EXPECT_GE(robust.trace, 0.95 * plain.trace);
  EXPECT_LE(accuracy(kNoise, 0.3, 0.6, Cauchy(2.0)).trace, 1.5 * plain.trace) << "better fixes are still detected";
}

/// During a gap, a calm target may become agile again.
TEST(MotionHypotheses, ForgetTheNoiseScaleDuringALongGap) {
  Fixes fixes(9);
  MotionHypotheses target(kNoise);
  for (double t = 0; t <= 95; t += 0.5) target.add(t, fixes.pose(t));
  // A vessel that keeps turning is within 60 m of its old position after 300 s.
  const TargetMoments m = target.at(395);
  const Vector<3> e = m.position - Vessel::position(395);
  EXPECT_LT(e.dot(m.covariance.inverse() * e), 9);
}

TEST(MotionHypotheses, RecoverFromAnOverflow) {
  Fixes fixes(10);
  MotionHypotheses target(kNoise);
  for (int t = 0; t <= 20; ++t) target.add(t, fixes.pose(t));
  target.add(21, TargetFix{{1e200, 0, 0}, Matrix<3, 3>::Identity()});
  for (int t = 22; t <= 60; ++t) target.add(t, fixes.pose(t));
  EXPECT_LE((target.at(60).position - Vessel::position(60)).norm(), 0.5);
  const TargetMoments ahead = target.at(1e9);
  EXPECT_TRUE(ahead.position.allFinite() && ahead.covariance.allFinite());
}

TEST(MotionHypotheses, FollowASharpTurnAfterALongCalm) {
  Fixes fixes(7);
  MotionHypotheses target(kNoise);
  // Straight for 600 s, then a circle of 3 m radius.
  const double rate = 0.4, radius = Vessel::speed / rate;
  const auto heading = [&](double t) { return 0.5 + rate * std::max(0.0, t - 600); };
  const auto position = [&](double t) {
    Vector<3> p = Vessel::speed * std::min(t, 600.0) * Vector<3>(std::cos(0.5), std::sin(0.5), 0);
    const double h = heading(t);
    return Vector<3>(p + radius * Vector<3>(std::sin(h) - std::sin(0.5), std::cos(0.5) - std::cos(h), 0));
  };
  for (double t = 0; t <= 620; t += 0.5) {
    TargetFix fix = fixes.position(0, 0.1);
    fix.position += position(t) - Vessel::position(0);
    fix.heading = std::remainder(heading(t), 2 * std::numbers::pi);
    fix.heading_sigma = 0.03;
    target.add(t, fix);
  }
  EXPECT_LE((target.at(620).position - position(620)).norm(), 0.3);
  EXPECT_LE((target.at(622).position - position(622)).norm(), 0.6);
}

/// In a frame whose tilt grows, a circling vessel climbs and dives.
TEST(StatisticalMotionHypotheses, FollowTheTiltOfTheFrame) {
  const auto rms_of_height = [](double tilt) {
    HypothesesNoise noise = kNoise;
    noise.tilt = tilt;
    double sum = 0;
    int n = 0;
    for (std::uint64_t run = 0; run < 20; ++run) {
      Fixes fixes(500 + run);
      MotionHypotheses target(noise);
      double climbed = 0;
      for (double t = 0; t <= 900; t += 4) {
        TargetFix fix = fixes.position(t, 1.0);
        fix.position.z() += climbed;
        target.add(t, fix);
        const Vector<3> way = Vessel::position(t + 4) - Vessel::position(t);
        if (t > 300) sum += std::pow(target.at(t).position.z() - Vessel::position(t).z() - climbed, 2), ++n;
        climbed += 5e-5 * t * (way.x() + way.y());
      }
    }
    return std::sqrt(sum / n);
  };
  EXPECT_LE(rms_of_height(kNoise.tilt), 0.45);
  EXPECT_LE(rms_of_height(kNoise.tilt), 0.7 * rms_of_height(0));
}

bool same(const TargetMoments& a, const TargetMoments& b, double within) {
  return (a.position - b.position).norm() <= within && (a.covariance - b.covariance).norm() <= within &&
         (a.velocity - b.velocity).norm() <= within;
}

TEST(MotionHypotheses, AcceptFixesInAnyOrder) {
  Fixes one(4), other(4);
  MotionHypotheses in_order(kNoise), late(kNoise);
  std::optional<TargetFix> held;
  for (int t = 0; t <= 40; ++t) {
    in_order.add(t, one.position(t, 0.5));
    const TargetFix fix = other.position(t, 0.5);
    if (t == 30) held = fix;
    late.add(t, t == 30 ? std::nullopt : std::optional(fix));
    if (t == 35) late.add(30, held);
  }
  EXPECT_TRUE(same(in_order.at(45), late.at(45), 1e-9));
}

TEST(MotionHypotheses, DroppedHistoryStaysInTheState) {
  Fixes one(5), other(5);
  MotionHypotheses all(kNoise), window(kNoise);
  for (int t = 0; t <= 60; ++t) {
    all.add(t, one.position(t, 0.5));
    window.add(t, other.position(t, 0.5));
    window.forget_before(t - 10);
  }
  EXPECT_TRUE(same(all.at(65), window.at(65), 1e-12));
  const TargetMoments before = window.at(60);
  window.add(20, one.position(20, 0.01));  // before the stored history
  EXPECT_TRUE(same(before, window.at(60), 0));
}

/// As after a restart of the process, when the last fixes are added again.
TEST(MotionHypotheses, RestoreACheckpoint) {
  Fixes one(8), other(8);
  MotionHypotheses first(kNoise), second(kNoise);
  for (int t = 0; t <= 120; ++t) {
    first.add(t, one.pose(t));
    first.forget_before(t - 10);
    const TargetFix fix = other.pose(t);
    if (t >= 100) second.add(t, fix);
  }
  EXPECT_FALSE(same(first.at(125), second.at(125), 1e-3));
  const MotionHypotheses::Checkpoint checkpoint = first.checkpoint();
  EXPECT_EQ(checkpoint.t, 109);
  second.restore(checkpoint);
  EXPECT_TRUE(same(first.at(125), second.at(125), 1e-12));
  MotionHypotheses::Checkpoint cut = checkpoint, longer = checkpoint;
  cut.numbers.pop_back();
  longer.numbers.push_back(0);
  EXPECT_THROW(second.restore(cut), Error);
  EXPECT_THROW(second.restore(longer), Error);
  for (std::size_t i = 0; i < 5; ++i) {
    MotionHypotheses::Checkpoint wrong = checkpoint;
    wrong.numbers[i] = NAN;
    EXPECT_THROW(second.restore(wrong), Error) << i;
  }
  EXPECT_TRUE(same(first.at(125), second.at(125), 1e-12)) << "a rejected checkpoint changes nothing";
}

TEST(MotionHypotheses, ALossLimitsTheEffectOfAnOutlier) {
  Fixes fixes(6);
  MotionHypotheses target(kNoise);
  for (int t = 0; t <= 40; ++t) target.add(t, fixes.position(t, 0.3));
  TargetFix outlier{Vessel::position(41) + Vector<3>(200, 0, 0), 0.09 * Matrix<3, 3>::Identity()};
  MotionHypotheses without_loss = target;
  without_loss.add(41, outlier);
  EXPECT_GT((without_loss.at(41).position - Vessel::position(41)).norm(), 20);
  outlier.loss = Cauchy(2);
  target.add(41, outlier);
  EXPECT_LE((target.at(41).position - Vessel::position(41)).norm(), 1);
}

TEST(MotionHypotheses, RespectHardLimits) {
  const HypothesesLimits limits{.min_surge = 0, .max_surge = 0.8, .max_yaw_rate = 0.01};
  MotionHypotheses limited(kNoise, limits), free(kNoise);
  Fixes fixes(3);
  for (int t = 0; t < 200; t += 5) {
    const TargetFix fix = t % 20 == 0 ? fixes.pose(t) : fixes.position(t, 0.5);
    limited.add(t, fix);
    free.add(t, fix);
    EXPECT_LE(limited.at(t).velocity.norm(), 0.81) << t;
    const TargetMoments now = limited.at(t), later = limited.at(t + 20);
    EXPECT_LE(later.velocity.norm(), 0.81) << t;
    if (t > 20 && now.heading && later.heading)
      EXPECT_LE(std::abs(std::remainder(*later.heading - *now.heading, 2 * std::numbers::pi)), 0.2 + 1e-9) << t;
  }
  EXPECT_GT(free.at(195).velocity.norm(), 1.0);
}

}  // namespace
}  // namespace tandem::testing
