#include <numbers>

#include <tandem/solvers/online/restart_schedule.hpp>

namespace tandem::detail {
namespace {

constexpr double kSurprise = std::numbers::pi / 4;  // smallest surprise that makes a fresh start due [rad]

}  // namespace

bool RestartSchedule::due(double newest, double age, bool whole, double surprise) {
  const bool surprised = surprise > kSurprise && newest - last_ > kFirst;
  if (!(whole && age >= after_) && !surprised) return false;
  while (after_ <= age) after_ *= 2;
  last_ = newest;
  return true;
}

}  // namespace tandem::detail
