#include <memory>

#include <fmt/format.h>

#include <tandem/lie/error.hpp>
#include <tandem/problem/file/problem_file.hpp>
#include <tandem/problem/lanes.hpp>
#include <tandem/studies/commands/solver_options.hpp>
#include <tandem/studies/support/option_values.hpp>
#include <tandem/studies/support/text.hpp>

namespace tandem {
namespace {

IpoptOptions& ipopt(const std::string& option, Solver& solver) {
  if (auto* options = std::get_if<IpoptOptions>(&solver)) return *options;
  throw Error(fmt::format("{} needs --solver ipopt", option));
}

std::string help(const std::string& otherwise) {
  std::vector<std::string> names;
  for (const std::string& name : solver_names()) {
    const std::string shown = name.starts_with("nlopt:") ? "nlopt:ALGORITHM" : name;
    if (names.empty() || names.back() != shown) names.push_back(shown);
  }
  return fmt::format("{} (default {})", listed(names, "or"), otherwise);
}

}  // namespace

void add_solver(CommandOptions& option, std::optional<Solver>& solver, const std::string& otherwise) {
  option("--solver", "NAME", help(otherwise), solver, parse_solver);
}

void add_solver(CommandOptions& option, Solver& solver, const std::string& otherwise) {
  option("--solver", "NAME", help(otherwise), solver, parse_solver);
}

void add_ipopt(CommandOptions& option, Solver& solver) {
  option.set("--hessian", "NAME", "For ipopt: automatic (default), gauss-newton, exact or limited-memory",
             [&solver](const std::string& name, const std::string& text) {
               ipopt(name, solver).hessian = parse_hessian(name, text);
             });
  option.set("--linear-solver", "NAME", "For ipopt: block-cholesky (default) or mumps, which came with it",
             [&solver](const std::string& name, const std::string& text) {
               ipopt(name, solver).linear_solver = parse_linear_solver(name, text);
             });
  option.set_repeatedly("--ipopt", "KEY=VALUE", "An option of Ipopt's own",
                        [&solver](const std::string& name, const std::string& text) {
                          const auto [key, value] = parse_assignment(name, text);
                          ipopt(name, solver).options[key] = value;
                        });
}

void add_stops(CommandOptions& option, std::function<SolverOptions&()> options) {
  option.set("--max-iterations", "N", "Stop a solve after N iterations",
             [options](const std::string& name, const std::string& text) {
               options().max_iterations = parse_count(name, text);
             });
  option.set("--time-limit", "SECONDS", "Stop after so long, with what there is by then",
             [options](const std::string& name, const std::string& text) {
               options().time_limit = parse_magnitude(name, text);
             });
}

void add_write_problem(CommandOptions& option, std::function<void(const Problem&)>& built) {
  option.set("--write-problem", "FILE", "Write the problem as the solver gets it to FILE, for tandem solve",
             [&built](const std::string&, const std::string& text) {
               built = [file = text](const Problem& problem) { write_problem(problem, file); };
             });
}

void add_threads(CommandOptions& option) {
  const auto limit = std::make_shared<std::unique_ptr<ThreadLimit>>();  // for as long as there is the option
  option.set("--threads", "N", "That evaluate at once, whatever the number to the same result (default 0: all cores)",
             [limit](const std::string& name, const std::string& text) {
               const int threads = parse_count_or_none(name, text);
               *limit = threads > 0 ? std::make_unique<ThreadLimit>(threads) : nullptr;
             });
}

}  // namespace tandem
