#include <algorithm>
#include <cmath>
#include <optional>

#include <tandem/solvers/online/fixed_lag.hpp>

#include "fuzz/handles.hpp"

namespace {

using namespace tandem;

constexpr int kMostCalls = 100;

/// Calls on a FixedLag in the order that the input says, each checked against what should be there.
class Calls {
 public:
  explicit Calls(fuzz::Input& input) : input_(input), lag_(options()) {}

  void run() {
    for (int i = 0; i < kMostCalls && !input_.empty(); ++i) {
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
    options.leaving = [this](double) {
      if (leaving_ && input_.byte() > 200) throw Error("the caller will not let it go");
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
        return add_for_ever();
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
        // Rarely: from then on nothing can be solved, until it is removed.
        if (input_.byte() > 240)
          world_.with_group(input_, [&](auto& handles) { world_.add_block(lag_.problem(), handles, input_, true); });
    }
  }

  /// Times go on, mostly.
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
  void add_for_ever() {
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
      if (known.there && known.t != HUGE_VAL) return;  // has a time already
      if (fuzz::attempt(possible && known.there, [&] { lag_.track(t, known.handle); })) known.t = t;
    });
  }
  void update() {
    double newest = -HUGE_VAL;
    world_.each_group([&](auto& handles) {
      for (const auto& known : handles.all())
        if (known.there && known.t < HUGE_VAL) newest = std::max(newest, known.t);
    });
    std::optional<Summary> summary;
    const bool whole = fuzz::accepts([&] { summary = lag_.update(); });
    world_.each_group([&](auto& handles) {
      for (auto& known : handles.all()) {
        if (!known.there || lag_.problem().has(known.handle)) continue;
        known.there = false;
        fuzz::expect(known.t < newest, "neither the newest variables nor those without a time leave");
        if (whole)
          fuzz::expect(std::any_of(lag_.gone().begin(), lag_.gone().end(),
                                   [&](const FixedLag::Gone& gone) { return gone.id == known.id; }),
                       "who leaves is told");
      }
    });
    fuzz::expect(!summary || !summary->message.empty(), "an update says why it ended");
    fuzz::expect(!summary || !summary->converged() || std::isfinite(summary->cost), "a converged cost is finite");
    if (summary && summary->converged() && whole)
      fuzz::expect(!(lag_.newest() - lag_.oldest() > window_ + 2e-3), "the window is no longer than asked for");
  }
  void remove() {
    world_.with_group(input_, [&](auto& handles) {
      const auto known = handles[handles.pick(input_)];
      const bool behind = input_.byte() & 1;  // its back
      const bool taken =
          fuzz::attempt(known.there, [&] { behind ? lag_.problem().remove(known.handle) : lag_.remove(known.handle); });
      if (taken) world_.forget(known.id);
    });
  }
  void fix() {
    world_.with_group(input_, [&](auto& handles) {
      const auto& known = handles[handles.pick(input_)];
      const bool fixed = input_.byte() & 1;
      fuzz::attempt(known.there, [&] { lag_.problem().fix(known.handle, fixed); });
    });
  }
  void marginalize() {
    world_.with_group(input_, [&](auto& handles) {
      const auto known = handles[handles.pick(input_)];
      if (fuzz::attempt(known.there, [&] { lag_.problem().marginalize(known.handle); })) world_.forget(known.id);
    });
  }
  void remove_block() {
    const Block block = world_.blocks[input_.below(world_.blocks.size())];
    fuzz::accepts([&] { lag_.problem().remove(block); });
  }
  void covariance() {
    world_.with_group(input_, [&](auto& handles) {
      const auto &a = handles[handles.pick(input_)], &b = handles[handles.pick(input_)];
      fuzz::attempt(a.there && b.there, [&] { (void)lag_.covariance(a.handle, b.handle); });
      fuzz::attempt(a.there, [&] { (void)lag_.covariance(a.handle); });
    });
  }

  fuzz::Input& input_;
  fuzz::World world_;
  double window_ = 0, now_ = 0;
  bool leaving_ = false;
  FixedLag lag_;
};

}  // namespace

// Calls on a FixedLag, in any order and on handles of any age: what is misuse is an error.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  fuzz::Input input(data, size);
  Calls(input).run();
  return 0;
}
