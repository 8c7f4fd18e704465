#include <algorithm>
#include <cmath>
#include <numbers>
#include <type_traits>

#include <tandem/lie/operations.hpp>
#include <tandem/lie/wrapped_angle.hpp>
#include <tandem/problem/tracking/planar.hpp>
#include <tandem/solvers/heading_search/heading_starts.hpp>

namespace tandem {
namespace {

bool has_pose(const TargetVariable& x) {
  return std::holds_alternative<Variable<SE3>>(x) || std::holds_alternative<Variable<SE2>>(x);
}

double heading_at(const TrackingProblem& tracking, std::size_t k) {
  return heading(*tracking.target_state(k).rotation);
}

}  // namespace

std::vector<HeadingGap> heading_gaps(const TrackingProblem& tracking, double min_duration) {
  const std::vector<Keyframe>& keyframes = tracking.keyframes;
  std::vector<char> measured(keyframes.size());
  for (const PlacedMeasurement& m : tracking.measurements)
    if ((m.block || m.orientation) && keyframes[m.keyframe].measured_rotation) measured[m.keyframe] = true;
  for (std::size_t k = 0; k < keyframes.size(); ++k)
    measured[k] |= std::visit(
        [&]<class X>(const X& x) {
          if constexpr (std::same_as<X, Variable<SE3>> || std::same_as<X, Variable<SE2>>) {
            return tracking.problem.is_fixed(x);
          } else {
            return false;
          }
        },
        tracking.target[k]);
  std::vector<HeadingGap> gaps;
  for (std::size_t k = 0; k < keyframes.size(); ++k) {
    if (measured[k] || !has_pose(tracking.target[k])) continue;
    const std::size_t first = k;
    while (k + 1 < keyframes.size() && !measured[k + 1] && has_pose(tracking.target[k + 1])) ++k;
    const double from = keyframes[first > 0 ? first - 1 : first].t;
    const double to = keyframes[k + 1 < keyframes.size() ? k + 1 : k].t;
    if (to - from > min_duration) gaps.push_back({first, k});
  }
  return gaps;
}

std::vector<int> gap_variables(const TrackingProblem& tracking, const HeadingGap& gap, std::size_t margin,
                               bool chaser) {
  const Problem& problem = tracking.problem;
  const std::size_t from = gap.first - std::min(gap.first, margin);
  const std::size_t to = std::min(gap.last + margin, tracking.keyframes.size() - 1);
  std::vector<int> ids;
  const auto add = [&](const auto& x) { ids.push_back(problem.id(x)); };
  for (std::size_t k = from; k <= to; ++k) {
    std::visit(
        [&]<class X>(const X& x) {
          if constexpr (!requires { x.first; }) add(x);
        },
        tracking.target[k]);
    if (!tracking.twist.empty()) std::visit(add, tracking.twist[k]);
    if (!chaser) continue;
    std::visit(add, tracking.chaser[k]);
    if (!tracking.ego.empty()) {
      add(tracking.ego[k].velocity);
      if (tracking.ego[k].bias) add(*tracking.ego[k].bias);
    }
  }
  return ids;
}

std::vector<double> headings(const TrackingProblem& tracking, const HeadingGap& gap) {
  std::vector<double> found;
  for (std::size_t k = gap.first; k <= gap.last; ++k) found.push_back(heading_at(tracking, k));
  return found;
}

std::vector<double> candidate_headings(const TrackingProblem& tracking, const HeadingGap& gap,
                                       HeadingCandidate candidate) {
  const std::size_t end = tracking.keyframes.size() - 1;
  std::vector<double> found;
  if (candidate == HeadingCandidate::course || candidate == HeadingCandidate::reversed) {
    const auto position = [&](std::size_t k) { return tracking.target_state(k).position; };
    for (std::size_t k = gap.first; k <= gap.last; ++k) {
      const Vector<3> along = position(std::min(k + 1, end)) - position(k - (k > 0));
      found.push_back(std::atan2(along.y(), along.x()) +
                      (candidate == HeadingCandidate::reversed ? std::numbers::pi : 0.0));
    }
    return found;
  }
  const std::size_t before = gap.first - (gap.first > 0), after = gap.last + (gap.last < end);
  const bool first = gap.first > 0 && has_pose(tracking.target[before]);
  const bool last = gap.last < end && has_pose(tracking.target[after]);
  const double from = first ? heading_at(tracking, before) : last ? heading_at(tracking, after) : 0.0;
  double turn = first && last ? wrapped_angle(heading_at(tracking, after) - from) : 0.0;
  if (candidate == HeadingCandidate::longer_turn && first && last) turn -= std::copysign(2 * std::numbers::pi, turn);
  const double begin = tracking.keyframes[before].t, duration = tracking.keyframes[after].t - begin;
  for (std::size_t k = gap.first; k <= gap.last; ++k)
    found.push_back(from + turn * (tracking.keyframes[k].t - begin) / duration);
  return found;
}

void set_headings(TrackingProblem& tracking, const HeadingGap& gap, const std::vector<double>& headings) {
  for (std::size_t k = gap.first; k <= gap.last; ++k) {
    const SE3 level(SO3::Exp({0, 0, headings[k - gap.first]}), tracking.target_state(k).position);
    std::visit(
        [&]<class X>(const X& x) {
          if constexpr (std::same_as<X, Variable<SE3>>) {
            tracking.problem.set_value(x, level);
          } else if constexpr (std::same_as<X, Variable<SE2>>) {
            tracking.problem.set_value(x, in_group<SE2>(level));
          }
        },
        tracking.target[k]);
  }
  if (tracking.twist.empty()) return;
  for (std::size_t k = gap.first; k <= gap.last; ++k) {
    const std::size_t from = std::min(k, tracking.keyframes.size() - 2);
    const double dt = tracking.keyframes[from + 1].t - tracking.keyframes[from].t;
    const auto twist_of = [&]<LieGroup G>(const Variable<Rn<G::dof>>& twist, std::type_identity<G>) {
      const auto pose = [&](std::size_t i) {
        return tracking.problem.value(std::get<Variable<G>>(tracking.target[i]));
      };
      tracking.problem.set_value(twist, Rn<G::dof>(minus(pose(from + 1), pose(from)) / dt));
    };
    if (const auto* const in_space = std::get_if<Variable<Rn<6>>>(&tracking.twist[k])) {
      twist_of(*in_space, std::type_identity<SE3>{});
    } else {
      twist_of(std::get<Variable<Rn<3>>>(tracking.twist[k]), std::type_identity<SE2>{});
    }
  }
}

void turn(TrackingProblem& tracking, const HeadingGap& gap, const std::vector<double>& angles) {
  Problem& problem = tracking.problem;
  for (std::size_t k = gap.first; k <= gap.last; ++k) {
    const double angle = angles[k - gap.first];
    const SO3 turned = SO3::Exp({0, 0, angle});
    std::visit(
        [&]<class X>(const X& x) {
          if constexpr (std::same_as<X, Variable<SE3>> || std::same_as<X, Variable<SE2>>) {
            if (problem.is_fixed(x)) return;
            const SE3 pose = in_space(problem.value(x));
            using G = std::conditional_t<std::same_as<X, Variable<SE3>>, SE3, SE2>;
            problem.set_value(x, in_group<G>(SE3(pose.rotation() * turned, pose.translation())));
          }
        },
        tracking.target[k]);
    if (tracking.twist.empty()) continue;
    const double rate =
        k < gap.last ? (angles[k + 1 - gap.first] - angle) / (tracking.keyframes[k + 1].t - tracking.keyframes[k].t)
                     : 0;
    const auto in_body = [&](const Vector<3>& v) -> Vector<3> { return turned.inverse().act(v); };
    if (const auto* const in_space = std::get_if<Variable<Rn<6>>>(&tracking.twist[k])) {
      const Vector<6> v = problem.value(*in_space).vector();
      Vector<6> result;
      result << in_body(v.head<3>()), in_body(v.tail<3>()) + Vector<3>(0, 0, rate);
      problem.set_value(*in_space, Rn<6>(result));
    } else {
      const auto& in_plane = std::get<Variable<Rn<3>>>(tracking.twist[k]);
      const Vector<3> v = problem.value(in_plane).vector();
      problem.set_value(in_plane, Rn<3>(Vector<3>(in_body({v[0], v[1], 0}) + Vector<3>(0, 0, v[2] + rate))));
    }
  }
}

double max_heading_difference(const std::vector<double>& a, const std::vector<double>& b) {
  double largest = 0;
  for (std::size_t k = 0; k < a.size(); ++k) largest = std::max(largest, std::abs(wrapped_angle(a[k] - b[k])));
  return largest;
}

double fraction_aligned(const std::vector<double>& a, const std::vector<double>& b) {
  std::size_t alike = 0;
  for (std::size_t k = 0; k < a.size(); ++k) alike += std::abs(wrapped_angle(a[k] - b[k])) < 0.5 * std::numbers::pi;
  return double(alike) / double(a.size());
}

}  // namespace tandem
