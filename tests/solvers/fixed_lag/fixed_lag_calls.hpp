#pragma once

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <variant>
#include <vector>

#include <tandem/lie/rn.hpp>
#include <tandem/lie/sek3.hpp>
#include <tandem/residuals/prior.hpp>
#include <tandem/residuals/relative_pose.hpp>
#include <tandem/solvers/fixed_lag/fixed_lag.hpp>

namespace tandem::testing {

/// Executes random calls on a FixedLag, as given by bytes, and compares it with a simple model after each call.
///
/// Variables are added with a time, without one, or get it later; they are fixed, removed and marginalized. Blocks are
/// added and removed. The window is updated, interrupted, relinearised, extended and asked for covariances. The
/// callback throws.
class FixedLagCalls {
 public:
  explicit FixedLagCalls(std::span<const std::uint8_t> bytes) : bytes_(bytes), lag_(options()) {}

  /// Returns a description of the first error, or nothing.
  std::optional<std::string> run() {
    while (!bytes_.empty() && error_.empty()) {
      call();
      compare();
    }
    if (error_.empty()) return {};
    return "after " + call_ + ": " + error_;
  }

 private:
  struct Known {
    std::variant<Variable<R3>, Variable<SE3>> handle;
    std::optional<double> t;
    int readers = 0;  // number of blocks that read it, without the marginal prior
    bool there = true;
  };
  struct KnownBlock {
    Block block;
    std::vector<std::size_t> reads;
  };
  static constexpr double kSame = 1e-3;  // [s]; closer times belong to one keyframe

  std::uint8_t byte() {
    if (bytes_.empty()) return 0;
    const std::uint8_t b = bytes_.front();
    bytes_ = bytes_.subspan(1);
    return b;
  }
  void expect(bool holds, const char* what) {
    if (!holds && error_.empty()) error_ = what;
  }
  /// Returns whether f() is accepted. If `possible` has a value, it must be equal.
  template <class F>
  bool attempt(std::optional<bool> possible, F f) {
    bool accepted = true;
    try {
      f();
    } catch (const Error&) {
      accepted = false;
    }
    if (possible) expect(accepted == *possible, *possible ? "the call was rejected" : "the call was accepted");
    return accepted;
  }

  FixedLagOptions options() {
    FixedLagOptions options;
    const std::uint8_t b = byte();
    options.window = window_ = 1.0 + b % 4;
    options.max_keyframes = max_keyframes_ = b & 4 ? 4 : 0;
    options.patience = patience_ = b & 8 ? 0.5 : 0.0;
    options.stop = &stop_;
    options.before_marginalize = [this](double) {
      if (hook_throws_) throw Error("the callback throws");
    };
    return options;
  }

  void call() {
    switch (byte() % 13) {
      case 0:
      case 1:
      case 2:
        return add();
      case 3:
        return add_untimed();
      case 4:
      case 5:
        return add_block();
      case 6:
        return remove_block();
      case 7:
        return remove();
      case 8:
        return fix();
      case 9:
        return marginalize();
      case 10:
        return covariance();
      case 11:
        return extend();
      default:
        return update();
    }
  }

  /// Mostly increasing times.
  double time() { return now_ += (byte() % 8 - 1) / 4.0; }
  std::size_t pick() { return byte() % known_.size(); }
  template <class F>
  auto with(const Known& known, F f) {
    return std::visit(f, known.handle);
  }

  void add() {
    call_ = "add";
    const double t = time();
    const bool pose = byte() & 1;
    attempt(!lag_.why_too_late(t), [&] {
      if (pose) {
        known_.push_back({lag_.add(t, SE3()), t});
      } else {
        known_.push_back({lag_.add(t, R3()), t});
      }
    });
  }
  void add_untimed() {
    call_ = "add of a variable without a time, or track";
    if (known_.empty() || byte() & 1) {
      known_.push_back({lag_.problem().add(R3()), {}});
      return;
    }
    Known& known = known_[pick()];
    const double t = time();
    const bool possible = known.there && !known.t && !lag_.why_too_late(t);
    if (attempt(possible, [&] { with(known, [&](const auto& x) { lag_.track(t, x); }); })) known.t = t;
  }

  void add_block() {
    call_ = "a block";
    if (known_.empty()) return;
    const std::size_t a = pick(), b = pick();
    const double z = byte() / 64.0 - 2;
    std::optional<Block> block;
    bool two = false;
    const auto put = [&]<LieGroup G>(const Variable<G>& x) {
      const auto* y = std::get_if<Variable<G>>(&known_[b].handle);
      const Gaussian sigma(Eigen::VectorXd::Constant(G::dof, 0.5));
      const G at = G::Exp(G::Tangent::Constant(z));
      two = y && a != b;
      if (two) {
        block = lag_.problem().minimize(RelativePose<G>{at}, sigma, {x, *y});
      } else {
        block = lag_.problem().minimize(Prior<G>{at}, sigma, {x});
      }
    };
    const bool both = known_[a].handle.index() == known_[b].handle.index() && a != b;
    if (!attempt(known_[a].there && (!both || known_[b].there), [&] { with(known_[a], put); })) return;
    blocks_.push_back({*block, {a}});
    if (two) blocks_.back().reads.push_back(b);
    for (const std::size_t i : blocks_.back().reads) ++known_[i].readers;
  }
  void remove_block() {
    call_ = "remove of a block";
    if (blocks_.empty()) return;
    const std::size_t i = byte() % blocks_.size();
    attempt(true, [&] { lag_.problem().remove(blocks_[i].block); });
    forget_block(i);
  }
  void forget_block(std::size_t i) {
    for (const std::size_t k : blocks_[i].reads) --known_[k].readers;
    blocks_.erase(blocks_.begin() + std::ptrdiff_t(i));
  }

  void remove() {
    call_ = "remove";
    if (known_.empty()) return;
    Known& known = known_[pick()];
    const bool directly = byte() & 1;  // through the problem, not through the window
    const auto take = [&](const auto& x) { directly ? lag_.problem().remove(x) : lag_.remove(x); };
    std::optional<bool> possible;  // unknown if the marginal prior may read it
    if (!known.there || known.readers > 0) possible = false;
    if (attempt(possible, [&] { with(known, take); })) known.there = false;
  }
  void fix() {
    call_ = "fix";
    if (known_.empty()) return;
    const Known& known = known_[pick()];
    const bool fixed = byte() & 1;
    attempt(known.there, [&] { with(known, [&](const auto& x) { lag_.problem().fix(x, fixed); }); });
  }
  void marginalize() {
    call_ = "marginalize";
    if (known_.empty()) return;
    const std::size_t i = pick();
    if (attempt(known_[i].there, [&] { with(known_[i], [&](const auto& x) { lag_.problem().marginalize(x); }); }))
      mark_removed(i);
  }
  void mark_removed(std::size_t i) {
    known_[i].there = false;
    for (std::size_t b = blocks_.size(); b-- > 0;)
      if (std::count(blocks_[b].reads.begin(), blocks_[b].reads.end(), i)) forget_block(b);
  }

  void covariance() {
    call_ = "covariance";
    if (known_.empty()) return;
    const Known& known = known_[pick()];
    attempt(known.there ? std::nullopt : std::optional(false), [&] {
      with(known, [&](const auto& x) { expect(lag_.covariance(x).allFinite(), "a covariance is not finite"); });
    });
  }

  void extend() {
    const bool relinearizes = byte() & 1;
    call_ = relinearizes ? "relinearize" : "extend";
    bool has_covariance = false;
    attempt(true, [&] { has_covariance = relinearizes ? lag_.relinearize() : lag_.extend(); });
    if (!has_covariance) return;
    for (const Known& known : known_)
      if (known.there)
        attempt(true, [&] {
          with(known, [&](const auto& x) { expect(lag_.covariance(x).allFinite(), "a covariance is not finite"); });
        });
  }

  double newest() const {
    double t = -HUGE_VAL;
    for (const Known& known : known_)
      if (known.there && known.t) t = std::max(t, *known.t);
    return t;
  }
  double oldest() const {
    double t = HUGE_VAL;
    for (const Known& known : known_)
      if (known.there && known.t) t = std::min(t, *known.t);
    return std::isinf(t) ? -HUGE_VAL : t;
  }

  void update() {
    call_ = "update";
    const std::uint8_t b = byte();
    stop_ = b % 4 == 0;
    hook_throws_ = b % 16 < 3;
    const double newest = this->newest(), before = oldest();
    std::optional<Summary> summary;
    const bool whole = attempt(hook_throws_ ? std::nullopt : std::optional(true), [&] { summary = lag_.update(); });
    std::size_t left = 0;
    for (std::size_t i = 0; i < known_.size(); ++i) {
      if (!known_[i].there || with(known_[i], [&](const auto& x) { return lag_.problem().has(x); })) continue;
      expect(known_[i].t && *known_[i].t < newest, "the newest variable, or one without a time, left the window");
      ++left;
      mark_removed(i);
    }
    expect(lag_.marginalized().size() == left, "marginalized() must list the variables that left");
    expect(!hook_throws_ || left == 0, "a variable left although the callback threw");
    if (!whole) return;
    const bool patient = !summary->converged() && patience_ > 0 && !max_keyframes_;
    expect(!patient || left == 0 || newest - before > (1 + patience_) * window_ - kSame,
           "a variable left before convergence");
    if (summary->status == Status::failed || summary->status == Status::unsupported) {
      expect(left == 0, "a variable left without a solution");
    } else {
      const double stretch = summary->converged() ? 1.0 : 1.0 + patience_;
      expect(!(newest - oldest() > stretch * window_ + kSame), "the window is too long");
    }
  }

  void compare() {
    int there = 0;
    for (const Known& known : known_) {
      there += known.there;
      const bool has = with(known, [&](const auto& x) { return lag_.problem().has(x); });
      expect(has == known.there, has ? "a removed variable still exists" : "a variable is missing");
    }
    expect(lag_.problem().num_variables() == there, "the number of variables is wrong");
    expect(lag_.newest() == newest(), "newest() is wrong");
    expect(lag_.oldest() == oldest(), "oldest() is wrong");
  }

  std::span<const std::uint8_t> bytes_;
  double window_ = 0, patience_ = 0, now_ = 0;
  int max_keyframes_ = 0;
  std::atomic<bool> stop_ = false;
  bool hook_throws_ = false;
  FixedLag lag_;
  std::vector<Known> known_;
  std::vector<KnownBlock> blocks_;
  std::string call_ = "construction", error_;
};

/// Runs the calls, for a fuzzer. Returns a description of the first error, or nothing.
inline std::optional<std::string> fixed_lag_calls(std::span<const std::uint8_t> bytes) {
  return FixedLagCalls(bytes).run();
}

}  // namespace tandem::testing
