#include <numbers>

#include "hock_schittkowski.hpp"

namespace tandem::testing {
namespace {

using std::sqrt;

HockSchittkowskiBuilder<2> rosenbrock(int number, double minimum, const std::array<double, 2>& start) {
  HockSchittkowskiBuilder<2> p(number, minimum, start);
  p.square([](auto x) { return x[1] - x[0] * x[0]; }, 100).square([](auto x) { return 1.0 - x[0]; });
  return p;
}

void add_rosenbrock_functions(std::vector<HockSchittkowski>& all) {
  rosenbrock(1, 0, {-2, 1}).bound(2, -1.5, kUnbounded).to(all);
  rosenbrock(2, 0.0504261879, {-2, 1}).bound(2, 1.5, kUnbounded).to(all);
  rosenbrock(15, 306.5, {-2, 1})
      .positive([](auto x) { return x[0] * x[1] - 1.0; })
      .positive([](auto x) { return x[0] + x[1] * x[1]; })
      .bound(1, -kUnbounded, 0.5)
      .to(all);
  rosenbrock(16, 0.25, {-2, 1})
      .positive([](auto x) { return x[0] + x[1] * x[1]; })
      .positive([](auto x) { return x[0] * x[0] + x[1]; })
      .bound(1, -0.5, 0.5)
      .bound(2, -kUnbounded, 1)
      .to(all);
  rosenbrock(17, 1, {-2, 1})
      .positive([](auto x) { return x[1] * x[1] - x[0]; })
      .positive([](auto x) { return x[0] * x[0] - x[1]; })
      .bound(1, -0.5, 0.5)
      .bound(2, -kUnbounded, 1)
      .to(all);
  rosenbrock(20, 81.5 - 25 * sqrt(3.0), {-2, 1})
      .positive([](auto x) { return x[0] + x[1] * x[1]; })
      .positive([](auto x) { return x[0] * x[0] + x[1]; })
      .positive([](auto x) { return x[0] * x[0] + x[1] * x[1] - 1.0; })
      .bound(1, -0.5, 0.5)
      .to(all);
}

}  // namespace

void add_two_unknowns(std::vector<HockSchittkowski>& all) {
  add_rosenbrock_functions(all);
  using Two = HockSchittkowskiBuilder<2>;
  Two(6, 0, {-1.2, 1})
      .square([](auto x) { return 1.0 - x[0]; })
      .zero([](auto x) { return 10.0 * (x[1] - x[0] * x[0]); })
      .to(all);
  Two(7, -sqrt(3.0), {2, 2})
      .objective(10, [](auto x) { return log(1.0 + x[0] * x[0]) - x[1] + 10.0; })
      .zero([](auto x) { return power(1.0 + x[0] * x[0], 2) + x[1] * x[1] - 4.0; })
      .to(all);
  Two(9, -0.5, {0, 0})
      .objective(
          10, [](auto x) { return sin(std::numbers::pi / 12.0 * x[0]) * cos(std::numbers::pi / 16.0 * x[1]) + 10.0; })
      .zero([](auto x) { return 4.0 * x[0] - 3.0 * x[1]; })
      .to(all);
  Two(10, -1, {-10, 10})
      .objective(50, [](auto x) { return x[0] - x[1] + 50.0; })
      .positive([](auto x) { return -3.0 * x[0] * x[0] + 2.0 * x[0] * x[1] - x[1] * x[1] + 1.0; })
      .to(all);
  Two(11, -8.498464223, {4.9, 0.1})
      .square([](auto x) { return x[0] - 5.0; })
      .square([](auto x) { return x[1]; })
      .minus(25)
      .positive([](auto x) { return x[1] - x[0] * x[0]; })
      .to(all);
  Two(12, -30, {0, 0})
      .square([](auto x) { return x[0] - 21.0 - (x[1] - 14.0); }, 0.5)
      .square([](auto x) { return x[1] - 14.0; }, 0.5)
      .minus(122.5)
      .positive([](auto x) { return 25.0 - 4.0 * x[0] * x[0] - x[1] * x[1]; })
      .to(all);
  Two(13, 1, {-2, -2})
      .square([](auto x) { return x[0] - 2.0; })
      .square([](auto x) { return x[1]; })
      .positive([](auto x) { return power(1.0 - x[0], 3) - x[1]; })
      .bound_all(0, kUnbounded)
      .to(all);
  Two(14, 9 - 2.875 * sqrt(7.0), {2, 2})
      .square([](auto x) { return x[0] - 2.0; })
      .square([](auto x) { return x[1] - 1.0; })
      .positive([](auto x) { return -0.25 * x[0] * x[0] - x[1] * x[1] + 1.0; })
      .zero([](auto x) { return x[0] - 2.0 * x[1] + 1.0; })
      .to(all);
  Two(18, 5, {2, 2})
      .square([](auto x) { return x[0]; }, 0.01)
      .square([](auto x) { return x[1]; })
      .positive([](auto x) { return x[0] * x[1] - 25.0; })
      .positive([](auto x) { return x[0] * x[0] + x[1] * x[1] - 25.0; })
      .bound(1, 2, 50)
      .bound(2, 0, 50)
      .to(all);
  Two(21, -99.96, {-1, -1})
      .square([](auto x) { return x[0]; }, 0.01)
      .square([](auto x) { return x[1]; })
      .minus(100)
      .positive([](auto x) { return 10.0 * x[0] - x[1] - 10.0; })
      .bound(1, 2, 50)
      .bound(2, -50, 50)
      .to(all);
  Two(22, 1, {2, 2})
      .square([](auto x) { return x[0] - 2.0; })
      .square([](auto x) { return x[1] - 1.0; })
      .positive([](auto x) { return 2.0 - x[0] - x[1]; })
      .positive([](auto x) { return x[1] - x[0] * x[0]; })
      .to(all);
  Two(23, 2, {3, 1})
      .square([](auto x) { return x[0]; })
      .square([](auto x) { return x[1]; })
      .positive([](auto x) { return x[0] + x[1] - 1.0; })
      .positive([](auto x) { return x[0] * x[0] + x[1] * x[1] - 1.0; })
      .positive([](auto x) { return 9.0 * x[0] * x[0] + x[1] * x[1] - 9.0; })
      .positive([](auto x) { return x[0] * x[0] - x[1]; })
      .positive([](auto x) { return x[1] * x[1] - x[0]; })
      .bound_all(-50, 50)
      .to(all);
}

}  // namespace tandem::testing
