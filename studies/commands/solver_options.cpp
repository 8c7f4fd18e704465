#include <memory>

#include <fmt/format.h>

#include <tandem/lie/error.hpp>
#include <tandem/problem/file/problem_file.hpp>
#include <tandem/problem/parallel_tasks.hpp>
#include <tandem/studies/commands/solver_options.hpp>
#include <tandem/studies/support/option_values.hpp>
#include <tandem/studies/support/text.hpp>

namespace tandem {
namespace {

IpoptOptions& ipopt(const std::string& option, AnySolver& solver) {
  if (auto* options = std::get_if<IpoptOptions>(&solver)) return *options;
  throw Error(fmt::format("{} needs --solver ipopt", option));
}

std::string solver_help(const std::string& default_solver) {
  std::vector<std::string> names;
  for (const std::string& name : solver_names()) {
    const std::string shown = name.starts_with("nlopt:") ? "nlopt:ALGORITHM" : name;
    if (names.empty() || names.back() != shown) names.push_back(shown);
  }
  return fmt::format("Solver: {}. Default: {}", listed(names, "or"), default_solver);
}

}  // namespace

void add_solver(CommandOptions& option, std::optional<AnySolver>& solver, const std::string& default_solver) {
  option("--solver", "NAME", solver_help(default_solver), solver, parse_solver);
}

void add_solver(CommandOptions& option, AnySolver& solver, const std::string& default_solver) {
  option("--solver", "NAME", solver_help(default_solver), solver, parse_solver);
}

void add_ipopt(CommandOptions& option, AnySolver& solver) {
  option.advanced();
  option.set("--hessian", "NAME",
             "Hessian for ipopt: automatic, gauss-newton, exact or limited-memory (default automatic)",
             [&solver](const std::string& name, const std::string& text) {
               ipopt(name, solver).hessian = parse_hessian(name, text);
             });
  option.set("--linear-solver", "NAME", "Linear solver for ipopt: block-cholesky or mumps (default block-cholesky)",
             [&solver](const std::string& name, const std::string& text) {
               ipopt(name, solver).linear_solver = parse_linear_solver(name, text);
             });
  option.set_repeatedly("--ipopt", "KEY=VALUE", "Set an option of Ipopt, e.g. tol=1e-9",
                        [&solver](const std::string& name, const std::string& text) {
                          const auto [key, value] = parse_assignment(name, text);
                          ipopt(name, solver).options[key] = value;
                        });
}

void add_stop_criteria(CommandOptions& option, std::function<SolverOptions&()> options) {
  option.everyday();
  option.set("--time-limit", "SECONDS", "Wall-clock time limit; the result is then the best so far",
             [options](const std::string& name, const std::string& text) {
               options().time_limit = parse_non_negative(name, text);
             });
  option.advanced();
  option.set("--max-iterations", "N",
             "Maximum number of iterations of a solve (default 1000; nlopt: 100000 evaluations)",
             [options](const std::string& name, const std::string& text) {
               options().max_iterations = parse_count(name, text);
             });
}

void add_write_problem(CommandOptions& option, std::function<void(const Problem&)>& built) {
  option.advanced();
  option.set("--write-problem", "FILE", "Write the problem to FILE before it is solved, for tandem solve",
             [&built](const std::string&, const std::string& text) {
               built = [file = text](const Problem& problem) { write_problem(problem, file); };
             });
}

void add_threads(CommandOptions& option) {
  const auto limit = std::make_shared<std::unique_ptr<ThreadLimit>>();  // lives as long as the option
  option.everyday();
  option.set("--threads", "N", "Number of threads (default 0: one per core). Results do not depend on it",
             [limit](const std::string& name, const std::string& text) {
               const int threads = parse_count_or_zero(name, text);
               *limit = threads > 0 ? std::make_unique<ThreadLimit>(threads) : nullptr;
             });
}

}  // namespace tandem
