#include <algorithm>
#include <cmath>
#include <optional>

#include <tandem/solvers/fixed_lag/fixed_lag.hpp>

#include "fuzz/handles.hpp"

namespace {

using namespace tandem;

constexpr int kMaxCalls = 100;

/// Calls a FixedLag as the input specifies and compares it with the expected state.
class Calls {
 public:
  explicit Calls(fuzz::Input& input) : input_(input), lag_(options()) {}

  void run() {
    for (int i = 0; i < kMaxCalls && !input_.empty(); ++i) {
      call();
      world_.check(lag_.problem());
    }
    fuzz::read_values(lag_.problem(), world_);
  }

 private:
  FixedLagOptions options() {
    FixedLagOptions options;
    const std::uint8_t b = input_.byte();
    options.window = window_ = 0.5 + b % 4;
    options.max_keyframes = b / 4 % 4 == 3 ? 0 : b / 4 % 4 + 1;
    options.max_iterations = 1 + b / 16 % 4;
    options.before_marginalize = [this](double) {
      if (leaving_ && input_.byte() > 200) throw Error("the callback rejects the marginalisation");
    };
    leaving_ = b & 128;
    return options;
  }

  void call() {
    switch (input_.byte() % 16) {
      case 0:
      case 1:
      case 2:
        return add();
      case 3:
        return add_untimed();
      case 4:
      case 5:
      case 6:
        return world_.with_group(input_,
                                 [&](auto& handles) { world_.add_block(lag_.problem(), handles, input_, false); });
      case 7:
      case 8:
        return update();
      case 9:
        return remove();
      case 10:
        return fix();
      case 11:
        return marginalize();
      case 12:
        return track();
      case 13:
        return remove_block();
      case 14:
        return covariance();
      default:
        // Rare, because hard blocks that contradict each other make later solves fail until one is removed.
        if (input_.byte() > 200)
          world_.with_group(input_, [&](auto& handles) { world_.add_block(lag_.problem(), handles, input_, true); });
    }
  }

  /// Returns the next time; times mostly increase.
  double time() {
    const std::uint8_t b = input_.byte();
    if (b >= 250) return fuzz::number(input_);
    return now_ += (int(b % 32) - 4) / 16.0;
  }
  void add() {
    const double t = time();
    const bool possible = std::isfinite(t) && !lag_.why_too_late(t);
    world_.with_group(input_, [&]<LieGroup G>(fuzz::Handles<G>& handles) {
      fuzz::attempt(possible, [&] {
        const auto x = lag_.add(t, fuzz::element<G>(input_));
        handles.add(x, lag_.problem().id(x), t);
      });
    });
  }
  void add_untimed() {
    world_.with_group(input_, [&]<LieGroup G>(fuzz::Handles<G>& handles) {
      const auto x = lag_.problem().add(fuzz::element<G>(input_));
      handles.add(x, lag_.problem().id(x), HUGE_VAL);
    });
  }
  void track() {
    const double t = time();
    const bool possible = std::isfinite(t) && !lag_.why_too_late(t);
    world_.with_group(input_, [&](auto& handles) {
      auto& known = handles[handles.pick(input_)];
      if (known.exists && known.t != HUGE_VAL) return;  // already tracked
      if (fuzz::attempt(possible && known.exists, [&] { lag_.track(t, known.handle); })) known.t = t;
    });
  }
  void update() {
    double newest = -HUGE_VAL;
    world_.each_group([&](auto& handles) {
      for (const auto& known : handles.all())
        if (known.exists && known.t < HUGE_VAL) newest = std::max(newest, known.t);
    });
    std::optional<Summary> summary;
    const bool whole = fuzz::accepts([&] { summary = lag_.update(); });
    world_.each_group([&](auto& handles) {
      for (auto& known : handles.all()) {
        if (!known.exists || lag_.problem().has(known.handle)) continue;
        known.exists = false;
        fuzz::expect(known.t < newest, "the newest variables and those without a time stay");
        if (whole)
          fuzz::expect(std::any_of(lag_.marginalized().begin(), lag_.marginalized().end(),
                                   [&](const FixedLag::Marginalized& gone) { return gone.id == known.id; }),
                       "gone() lists all variables that left");
      }
    });
    fuzz::expect(!summary || !summary->message.empty(), "an update has a message");
    fuzz::expect(!summary || !summary->converged() || std::isfinite(summary->cost), "a converged cost is finite");
    if (summary && summary->converged() && whole)
      fuzz::expect(!(lag_.newest() - lag_.oldest() > window_ + 2e-3), "the window is not longer than requested");
  }
  void remove() {
    world_.with_group(input_, [&](auto& handles) {
      const auto known = handles[handles.pick(input_)];
      const bool directly = input_.byte() & 1;  // without telling the FixedLag
      const bool taken = fuzz::attempt(
          known.exists, [&] { directly ? lag_.problem().remove(known.handle) : lag_.remove(known.handle); });
      if (taken) world_.forget(known.id);
    });
  }
  void fix() {
    world_.with_group(input_, [&](auto& handles) {
      const auto& known = handles[handles.pick(input_)];
      const bool fixed = input_.byte() & 1;
      fuzz::attempt(known.exists, [&] { lag_.problem().fix(known.handle, fixed); });
    });
  }
  void marginalize() {
    world_.with_group(input_, [&](auto& handles) {
      const auto known = handles[handles.pick(input_)];
      if (fuzz::attempt(known.exists, [&] { lag_.problem().marginalize(known.handle); })) world_.forget(known.id);
    });
  }
  void remove_block() {
    const Block block = world_.blocks[input_.below(world_.blocks.size())];
    fuzz::accepts([&] { lag_.problem().remove(block); });
  }
  void covariance() {
    world_.with_group(input_, [&](auto& handles) {
      const auto &a = handles[handles.pick(input_)], &b = handles[handles.pick(input_)];
      fuzz::attempt(a.exists && b.exists, [&] { (void)lag_.covariance(a.handle, b.handle); });
      fuzz::attempt(a.exists, [&] { (void)lag_.covariance(a.handle); });
    });
  }

  fuzz::Input& input_;
  fuzz::World world_;
  double window_ = 0, now_ = 0;
  bool leaving_ = false;
  FixedLag lag_;
};

}  // namespace

// Calls of a FixedLag in any order and with handles of any age. Misuse must throw Error.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  fuzz::Input input(data, size);
  Calls(input).run();
  return 0;
}
