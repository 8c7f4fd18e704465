#include "tandem/solvers/session.hpp"

namespace tandem::detail {

Session::Session(std::string solver, const SolverOptions& options) : options_(options) {
  summary.solver = std::move(solver);
}

double Session::seconds() const {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count();
}

bool Session::should_stop() {
  if (options_.stop && options_.stop->load(std::memory_order_relaxed)) {
    end(Status::interrupted);
    return true;
  }
  if (seconds() > options_.time_limit) {
    end(Status::time_limit);
    return true;
  }
  return false;
}

void Session::report(int iteration, double cost, double step, double violation) const {
  if (options_.progress) options_.progress({iteration, cost, step, violation, seconds()});
}

void Session::end(Status status, std::string message) {
  if (ended_) return;
  ended_ = true;
  summary.status = status;
  summary.message = message.empty() ? std::string(sentence(status)) : std::move(message);
  summary.seconds = seconds();
}

}  // namespace tandem::detail
