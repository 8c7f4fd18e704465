#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include <tandem/problem/quantile.hpp>
#include <tandem/studies/navigation/gross_errors.hpp>

namespace tandem {
namespace {

// Standard deviations from which a measurement is rejected, and below which it is cleared.
constexpr double kRejected = 10, kCleared = 5;
constexpr double kMedianOfNormal = 0.6745;
constexpr double kRare = 1.0 / 3;
// A residual below this fraction of the largest may be caused by that error, so it is not rejected yet.
constexpr double kFractionOfWorst = 1e-2;
constexpr std::size_t kNeighbours = 8;  // on either side; of them, only the worst is rejected at a time
constexpr int kMaxRevisions = 6;
constexpr double kNoInfluence = 1e10;  // factor of the standard deviations

/// Returns the largest residual of a block in standard deviations of the sensor.
double sigmas_of(const Problem& problem, const Block& block, const Eigen::VectorXd& sigma) {
  const double largest = (problem.linearization(block).residual.array().abs() / sigma.array()).maxCoeff();
  return std::isfinite(largest) ? largest : HUGE_VAL;
}

}  // namespace

GrossErrors::GrossErrors(const NavigationData& data, double suggested) : data_(data), suggested_(suggested) {
  for (const EgoSensor& sensor : data.sensors) verdicts_.emplace_back(sensor.measurements.size());
}

void GrossErrors::suggest(const std::string& sensor, double t, double sigmas) {
  if (!(sigmas > suggested_)) return;
  for (std::size_t s = 0; s < data_.sensors.size(); ++s) {
    const EgoSensor& by = data_.sensors[s];
    if (by.name != sensor) continue;
    // Without gyroscopes, a fast turn contradicts the online prediction. The batch solution judges it by what follows.
    if (!data_.imu && by.type->reading == EgoReading::orientation) continue;
    const auto m = std::lower_bound(by.measurements.begin(), by.measurements.end(), t + by.delay - 0.5 * kSameInstant,
                                    [](const EgoMeasurement& x, double time) { return x.t < time; });
    if (m == by.measurements.end() || std::abs(by.valid_at(*m) - t) > 0.5 * kSameInstant) continue;
    verdicts_[s][std::size_t(m - by.measurements.begin())] = {true, false, sigmas};
  }
}

void GrossErrors::keep_rare() {
  for (auto& verdicts : verdicts_) {
    const auto n = std::count_if(verdicts.begin(), verdicts.end(), [](const Verdict& v) { return v.rejected; });
    if (double(n) > kRare * double(verdicts.size())) verdicts.assign(verdicts.size(), {});
  }
}

void GrossErrors::apply(NavigationProblem& built) const {
  for (const PlacedEgoMeasurement& m : built.measurements)
    if (m.block && of(m).rejected)
      built.problem.set_noise(*m.block, Gaussian(Eigen::VectorXd(kNoInfluence * data_.sensors[m.sensor].sigma)));
}

bool GrossErrors::revise(const NavigationProblem& built) {
  struct Judged {
    const PlacedEgoMeasurement* m;
    double sigmas;
  };
  std::vector<std::vector<Judged>> used(verdicts_.size()), rejected(verdicts_.size());
  for (const PlacedEgoMeasurement& m : built.measurements) {
    if (!m.block) continue;
    const double sigmas = sigmas_of(built.problem, *m.block, data_.sensors[m.sensor].sigma);
    (of(m).rejected ? rejected : used)[m.sensor].push_back({&m, sigmas});
  }
  double worst = 0;
  std::vector<double> typical(verdicts_.size(), 1);
  for (std::size_t s = 0; s < used.size(); ++s) {
    std::vector<double> all;
    for (const Judged& judged : used[s]) all.push_back(judged.sigmas);
    if (!all.empty()) typical[s] = std::max(1.0, detail::median(all) / kMedianOfNormal);
    for (const Judged& judged : used[s]) worst = std::max(worst, judged.sigmas / typical[s]);
  }
  bool changed = false;
  for (std::size_t s = 0; s < used.size(); ++s) {
    for (const Judged& judged : rejected[s]) {
      Verdict& verdict = of(*judged.m);
      verdict.sigmas = judged.sigmas;
      if (verdict.cleared || judged.sigmas > kCleared * typical[s]) continue;
      verdict = {false, true, judged.sigmas};
      changed = true;
    }
    const double limit = std::max(kRejected, kFractionOfWorst * worst) * typical[s];
    for (std::size_t i = 0; i < used[s].size(); ++i) {
      if (used[s][i].sigmas <= limit) continue;
      const auto from = used[s].begin() + std::ptrdiff_t(i - std::min(i, kNeighbours));
      const auto to = used[s].begin() + std::ptrdiff_t(std::min(i + kNeighbours + 1, used[s].size()));
      const bool largest = std::none_of(from, to, [&](const Judged& x) { return x.sigmas > used[s][i].sigmas; });
      if (!largest) continue;
      of(*used[s][i].m) = {true, of(*used[s][i].m).cleared, used[s][i].sigmas};
      changed = true;
    }
  }
  return changed && ++revisions_ <= kMaxRevisions;
}

std::vector<std::size_t> GrossErrors::rejected_in(const std::vector<std::pair<double, double>>& intervals) const {
  std::vector<std::size_t> counts(verdicts_.size());
  for (std::size_t s = 0; s < verdicts_.size(); ++s)
    for (std::size_t i = 0; i < verdicts_[s].size(); ++i) {
      const double t = data_.sensors[s].valid_at(data_.sensors[s].measurements[i]);
      counts[s] += verdicts_[s][i].rejected &&
                   std::any_of(intervals.begin(), intervals.end(),
                               [t](const auto& interval) { return t >= interval.first && t <= interval.second; });
    }
  return counts;
}

std::vector<std::vector<double>> GrossErrors::remove(NavigationProblem& built, NavigationData& data,
                                                     std::vector<NavigationFinding>& findings) const {
  std::vector<std::vector<double>> times(verdicts_.size());
  std::erase_if(built.measurements, [&](const PlacedEgoMeasurement& m) {
    if (!m.block || !of(m).rejected) return false;
    built.problem.remove(*m.block);
    return true;
  });
  for (std::size_t s = 0; s < verdicts_.size(); ++s) {
    NavigationFinding finding{NavigationFinding::Kind::rejected, data.sensors[s].name};
    double largest = 0;
    std::vector<EgoMeasurement> kept;
    for (std::size_t i = 0; i < verdicts_[s].size(); ++i) {
      const EgoMeasurement& m = data.sensors[s].measurements[i];
      if (!verdicts_[s][i].rejected) {
        kept.push_back(m);
        continue;
      }
      times[s].push_back(m.t);
      largest = std::max(largest, verdicts_[s][i].sigmas);
    }
    if (times[s].empty()) continue;
    finding.count = times[s].size();
    finding.from = times[s].front();
    finding.to = times[s].back();
    finding.channel = fmt::format(" by up to {:.3g} standard deviations", largest);
    findings.push_back(finding);
    data.sensors[s].measurements = std::move(kept);
  }
  return times;
}

}  // namespace tandem
