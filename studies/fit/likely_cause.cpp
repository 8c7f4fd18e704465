#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include <tandem/studies/fit/likely_cause.hpp>

namespace tandem {

std::vector<std::pair<std::string, Matrix<3, 3>>> mistaken_axes(const Matrix<3, 3>& frame) {
  const auto matrix = [](const Vector<3>& a, const Vector<3>& b, const Vector<3>& c) {
    Matrix<3, 3> A;
    A << a.transpose(), b.transpose(), c.transpose();
    return A;
  };
  const auto rows = [&](const Vector<3>& a, const Vector<3>& b, const Vector<3>& c) {
    return Matrix<3, 3>(frame * matrix(a, b, c) * frame.transpose());
  };
  const Vector<3> x = Vector<3>::UnitX(), y = Vector<3>::UnitY(), z = Vector<3>::UnitZ();
  return {{"y and z are negated", rows(x, -y, -z)},
          {"z is negated", rows(x, y, -z)},
          {"y is negated", rows(x, -y, z)},
          {"x is negated", rows(-x, y, z)},
          {"x and y are swapped", rows(y, x, z)},
          {"x and y are negated", rows(-x, -y, z)},
          {"x and z are negated", rows(-x, y, -z)},
          {"x and y are swapped and z is negated", rows(y, x, -z)},
          {"x and y are swapped and x is negated", rows(y, -x, z)},
          {"x and y are swapped and y is negated", rows(-y, x, z)},
          {"the axes are right, down, forward (a camera's)", matrix(z, -x, -y) * frame},
          {"x and z are swapped", rows(z, y, x)},
          {"y and z are swapped", rows(x, z, y)}};
}

SO3 ordered_w_first(const SO3& read) {
  const Eigen::Quaterniond q = read.quaternion();
  return SO3(Eigen::Quaterniond(q.x(), q.y(), q.z(), q.w()));
}

std::string mistaken_delay_text(double delay) {
  return fmt::format("its stamps are {:.1f} s too {}", std::abs(delay), delay > 0 ? "late" : "early");
}

void keep_best(std::vector<LikelyCause>& causes) {
  constexpr std::size_t kMaxCauses = 3;
  if (causes.empty()) return;
  // Costs that hardly differ keep their order, in which the simplest mistakes come first.
  const double best = std::min_element(causes.begin(), causes.end(), [](const auto& a, const auto& b) {
                        return a.after < b.after;
                      })->after;
  const double step = std::max(1.0, 0.01 * best);
  std::stable_sort(causes.begin(), causes.end(), [&](const LikelyCause& a, const LikelyCause& b) {
    return std::floor((a.after - best) / step) < std::floor((b.after - best) / step);
  });
  causes.resize(std::min(causes.size(), kMaxCauses));
}

std::string likely_causes_text(const std::vector<LikelyCause>& causes) {
  std::string text;
  for (const LikelyCause& cause : causes)
    text += fmt::format("Likely cause: {}: {} (cost of a part of the recording {:.6g}, without this change {:.6g}).\n",
                        cause.sensor, cause.text, cause.after, cause.before);
  return text;
}

JsonFields<LikelyCause> likely_cause_fields() {
  using C = LikelyCause;
  return JsonFields<C>()
      .add("sensor", "name of the sensor", [](const C& c) { return c.sensor; })
      .add("text", "the mistake in words", [](const C& c) { return c.text; })
      .add("cost_before", "cost of a part of the recording with the sensor", [](const C& c) { return c.before; })
      .add("cost_after", "cost of this part if the mistake is corrected", [](const C& c) { return c.after; });
}

}  // namespace tandem
