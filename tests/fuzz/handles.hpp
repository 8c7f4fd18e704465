#pragma once

#include <cmath>
#include <limits>
#include <numbers>
#include <span>
#include <string>
#include <vector>

#include <tandem/lie/rn.hpp>
#include <tandem/lie/se2.hpp>
#include <tandem/lie/sek3.hpp>
#include <tandem/problem/problem.hpp>
#include <tandem/residuals/constant_twist.hpp>
#include <tandem/residuals/prior.hpp>
#include <tandem/residuals/relative_pose.hpp>

#include "fuzz/input.hpp"

namespace tandem::fuzz {

using R1 = Rn<1>;

/// Returns a mostly small number, sometimes one that a user should not pass.
inline double number(Input& input) {
  const std::uint8_t b = input.byte();
  switch (b) {
    case 255:
      return std::nan("");
    case 254:
      return std::numeric_limits<double>::infinity();
    case 253:
      return 1e308;
    case 252:
      return 1e-308;
    case 251:
      return std::numbers::pi;
    case 250:
      return 1e10;
    default:
      return (int(b) - 125) / 25.0;
  }
}

/// Returns a group element with such numbers.
template <LieGroup G>
G element(Input& input) {
  typename G::Tangent v;
  for (int i = 0; i < G::dof; ++i) v[i] = i < 3 ? number(input) : 0.1 * i;
  return G::Exp(v);
}

/// A handle, and whether its variable should still exist.
template <LieGroup G>
struct Known {
  Variable<G> handle;
  bool exists;
  int id;
  double t = 0;  ///< time in a FixedLag [s]
};

/// All handles so far: of existing and removed variables, of another problem and of none.
template <LieGroup G>
class Handles {
 public:
  Handles() { all_.push_back({Variable<G>{}, false, -1}); }

  void add(const Variable<G>& handle, int id, double t = 0) { all_.push_back({handle, true, id, t}); }
  void add_foreign(const Variable<G>& handle) { all_.push_back({handle, false, -1}); }
  std::size_t pick(Input& input) const { return input.below(all_.size()); }
  Known<G>& operator[](std::size_t i) { return all_[i]; }
  std::span<Known<G>> all() { return all_; }
  /// Marks the variable with this ID as removed.
  void forget(int id) {
    for (Known<G>& known : all_)
      if (known.exists && known.id == id) known.exists = false;
  }

 private:
  std::vector<Known<G>> all_;
};

/// Runs f() and returns whether it succeeded. If `possible` is false, it must throw Error.
template <class F>
bool attempt(bool possible, F f) {
  const bool taken = accepts(f);
  expect(possible || !taken, "misuse is an error");
  return taken;
}

/// Handles of all groups that the targets use, and their blocks.
class World {
 public:
  Handles<R1> r1;
  Handles<SO2> so2;
  Handles<SE2> se2;
  Handles<SE3> se3;
  std::vector<Block> blocks{Block{}};

  /// Calls f(handles) for the group that the input selects.
  template <class F>
  void with_group(Input& input, F f) {
    switch (input.byte() % 8) {
      case 0:
      case 1:
      case 2:
        return f(r1);
      case 3:
      case 4:
        return f(so2);
      case 5:
      case 6:
        return f(se2);
      default:
        return f(se3);
    }
  }
  template <class F>
  void each_group(F f) {
    f(r1);
    f(so2);
    f(se2);
    f(se3);
  }
  void forget(int id) {
    each_group([&](auto& handles) { handles.forget(id); });
  }

  /// Checks that exactly the expected variables exist.
  void check(const Problem& problem) {
    int count = 0;
    each_group([&]<class H>(H& handles) {
      for (const auto& known : handles.all()) {
        expect(problem.has(known.handle) == known.exists, "has() is correct");
        if (!known.exists) continue;
        ++count;
        expect(problem.id(known.handle) == known.id && known.id < problem.id_bound(), "a variable keeps its id");
        expect(!problem.name(known.id).empty(), "a variable has a name");
      }
    });
    expect(count <= problem.num_variables(), "num_variables() counts all variables");
  }

  /// Adds a cost or a constraint on one to three variables of a group, which may be invalid.
  template <LieGroup G>
  void add_block(Problem& problem, Handles<G>& handles, Input& input, bool hard) {
    const std::uint8_t shape = input.byte();
    const auto &a = handles[handles.pick(input)], &b = handles[handles.pick(input)];
    switch (shape % 3) {
      case 0:
        return add(problem, Prior<G>{element<G>(input)}, {a.handle}, a.exists, shape, input, hard);
      case 1:
        return add(problem, RelativePose<G>{element<G>(input)}, {a.handle, b.handle}, a.exists && b.exists, shape,
                   input, hard);
      default: {
        const auto& c = handles[handles.pick(input)];
        add(problem, ConstantTwist<G>{1, 1 + number(input)}, {a.handle, b.handle, c.handle},
            a.exists && b.exists && c.exists, shape, input, hard);
      }
    }
  }

 private:
  template <class R>
  void add(Problem& problem, const R& residual, const VariablesOf<R>& x, bool exists, std::uint8_t shape, Input& input,
           bool hard) {
    const double first = number(input), second = number(input);
    attempt(exists, [&] {
      if (hard) {
        const auto bounds = shape & 64 ? equal_to(first) : between(first, second);
        blocks.push_back(problem.subject_to(residual, bounds, x));
        return;
      }
      const Loss loss{Loss::Kind((shape / 8) % 5), second};
      const int dim = (shape & 128) && second > 4.5 ? R::dim + 1 : R::dim;
      Eigen::VectorXd sigmas = Eigen::VectorXd::Constant(dim, first);
      if (shape & 64) {
        Eigen::MatrixXd full = sigmas.cwiseAbs2().asDiagonal();
        full(0, dim - 1) = full(dim - 1, 0) = 0.5 * full(0, 0);
        blocks.push_back(problem.minimize(residual, Gaussian::covariance(full), x, loss));
      } else {
        blocks.push_back(problem.minimize(residual, Gaussian(sigmas), x, loss));
      }
    });
  }
};

/// Reads the values of all existing variables.
inline void read_values(const Problem& problem, World& world) {
  world.each_group([&](auto& handles) {
    for (const auto& known : handles.all()) {
      const auto read = [&] { (void)problem.value(known.handle); };
      if (known.exists) expect(accepts(read), "a variable that is exists has a value");
    }
  });
}

}  // namespace tandem::fuzz
