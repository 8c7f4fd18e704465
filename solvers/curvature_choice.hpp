#pragma once

namespace tandem::detail {

/// Decides whether damped steps use the curvature that secant pairs have learned.
///
/// Learned curvature saves iterations while the true curvature changes slowly. In a narrow curved valley it is wrong at
/// the next point: many steps are rejected, and a solve needs several times more iterations. Steps without it are taken
/// for a while if too many of the steps that use it are rejected. The pauses grow with each failure.
class CurvatureChoice {
 public:
  bool use() const { return pause_left_ == 0; }

  /// Reports a step. `learned` tells whether it used learned curvature.
  void add(bool learned, bool accepted) {
    if (pause_left_ > 0) --pause_left_;
    if (!learned) return;
    rejected_share_ += kWeight * ((accepted ? 0.0 : 1.0) - rejected_share_);
    if (rejected_share_ < kMaxRejectedShare) return;
    rejected_share_ = 0;
    pause_left_ = pause_;
    pause_ *= kGrowth;
  }

 private:
  static constexpr double kWeight = 0.1, kMaxRejectedShare = 0.3;  // the plain method rejects about one step of eight
  static constexpr int kFirstPause = 50, kGrowth = 4;              // iterations

  double rejected_share_ = 0;  // moving average
  int pause_ = kFirstPause, pause_left_ = 0;
};

}  // namespace tandem::detail
