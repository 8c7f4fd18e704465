#include <array>
#include <optional>
#include <utility>

#include <tandem/problem/program.hpp>
#include <tandem/solvers/augmented_lagrangian.hpp>
#include <tandem/solvers/gauss_newton.hpp>
#include <tandem/solvers/marginals.hpp>

#include "fuzz/handles.hpp"

namespace {

using namespace tandem;

constexpr int kMostCalls = 100;

/// A problem whose handles every other one is to refuse. Nothing changes it: all executions have the same.
struct Foreign {
  Problem problem;
  Variable<fuzz::R1> r1 = problem.add(fuzz::R1());
  Variable<SE2> se2 = problem.add(SE2());
  Block block = problem.minimize(Prior<fuzz::R1>{fuzz::R1()}, Gaussian({1.0}), {r1});
};
const Foreign& foreign() {
  static const Foreign made;
  return made;
}

/// Calls on a Problem in the order that the input says, each checked against what should be there.
class Calls {
 public:
  explicit Calls(fuzz::Input& input) : input_(input) {
    // Handles that this problem has never given out.
    world_.r1.add_foreign(foreign().r1);
    world_.se2.add_foreign(foreign().se2);
  }

  void run() {
    for (int i = 0; i < kMostCalls && !input_.empty(); ++i) {
      call();
      world_.check(problem_);
    }
    fuzz::read_values(problem_, world_);
  }

 private:
  void call() {
    switch (input_.byte() % 22) {
      case 0:
      case 1:
        return add();
      case 2:
        return remove();
      case 3:
        return fix();
      case 4:
        return set_value();
      case 5:
      case 6:
      case 7:
        return world_.with_group(input_, [&](auto& handles) { world_.add_block(problem_, handles, input_, false); });
      case 8:
        return world_.with_group(input_, [&](auto& handles) { world_.add_block(problem_, handles, input_, true); });
      case 9:
        return remove_block();
      case 10:
        return marginalize();
      case 11:
        return marginalize_ids();
      case 12:
        return solve_by(GaussNewtonOptions{});
      case 13:
        return solve_by(AugmentedLagrangianOptions{});
      case 14:
        return evaluate();
      case 15:
        return weigh();
      case 16:
        return widen();
      case 17:
        return covariances();
      case 18:
        return move();
      case 19:
        return keep_program();
      case 20:
        return use_program();
      default:
        return read();
    }
  }

  void add() {
    world_.with_group(input_, [&]<LieGroup G>(fuzz::Handles<G>& handles) {
      const auto x = problem_.add(fuzz::element<G>(input_));
      handles.add(x, problem_.id(x));
    });
  }
  void remove() {
    world_.with_group(input_, [&](auto& handles) {
      auto& known = handles[handles.pick(input_)];
      const int id = known.id;
      if (fuzz::attempt(known.there, [&] { problem_.remove(known.handle); })) world_.forget(id);
    });
  }
  void fix() {
    world_.with_group(input_, [&](auto& handles) {
      const auto& known = handles[handles.pick(input_)];
      const bool fixed = input_.byte() & 1;
      const bool taken = fuzz::attempt(known.there, [&] { problem_.fix(known.handle, fixed); });
      fuzz::expect(taken || !known.there, "a variable can be fixed");
    });
  }
  void set_value() {
    world_.with_group(input_, [&]<LieGroup G>(fuzz::Handles<G>& handles) {
      const auto& known = handles[handles.pick(input_)];
      fuzz::attempt(known.there, [&] { problem_.set_value(known.handle, fuzz::element<G>(input_)); });
    });
  }
  Block block() {
    const std::size_t i = input_.byte();
    if (i == 255) return {int(input_.byte()) - 3, int(input_.byte()) - 3, input_.byte()};
    if (i == 254) return foreign().block;
    return world_.blocks[i % world_.blocks.size()];
  }
  void remove_block() {
    const Block b = block();
    if (fuzz::accepts([&] { problem_.remove(b); }))
      fuzz::expect(!fuzz::accepts([&] { problem_.remove(b); }), "a block is removed once");
  }
  void marginalize() {
    world_.with_group(input_, [&](auto& handles) {
      const auto a = handles[handles.pick(input_)], b = handles[handles.pick(input_)];
      const bool two = input_.byte() & 1;
      const bool possible = a.there && (!two || (b.there && a.id != b.id));
      const bool taken = fuzz::attempt(
          possible, [&] { two ? problem_.marginalize(a.handle, b.handle) : problem_.marginalize(a.handle); });
      if (!taken) return;
      world_.forget(a.id);
      if (two) world_.forget(b.id);
      fuzz::expect(problem_.marginal_prior().has_value(), "a prior is left");
    });
  }
  void marginalize_ids() {
    std::vector<int> ids(input_.below(5));
    for (int& id : ids) id = int(input_.byte() % 16) - 2;
    if (fuzz::accepts([&] { problem_.marginalize(ids); }))
      for (const int id : ids) world_.forget(id);
  }
  template <class Options>
  void solve_by(Options options) {
    options.max_iterations = int(input_.below(8));
    std::optional<Summary> summary;
    fuzz::accepts([&] { summary = solve(problem_, options); });
    fuzz::expect(!summary || !summary->message.empty(), "a solve says why it ended");
    fuzz::expect(!summary || !summary->converged() || std::isfinite(summary->cost), "a converged cost is finite");
  }
  void evaluate() {
    fuzz::accepts([&] {
      Program program(problem_);
      const Eigen::Index n = program.num_unknowns(), nonzeros = program.hessian_pattern().nonzeros();
      const double step = fuzz::number(input_);
      Eigen::VectorXd delta = Eigen::VectorXd::Constant(n, step), gradient(n), hessian(nonzeros);
      Eigen::VectorXd rows(program.num_rows()), jacobian(Eigen::Index(program.jacobian_pattern().row.size()));
      program.keep();
      program.move_to(delta);
      program.linearize(gradient, hessian);
      program.linearize_constraints(rows, jacobian);
      program.exact_hessian(1.0, Eigen::VectorXd::Ones(rows.size()), hessian);
      program.stiffness(delta, Eigen::VectorXd::Ones(rows.size()));
      program.describe_bad_block();
      const Program::Violation violation = program.violation(rows);
      if (violation.row >= 0) program.describe_row(violation.row);
      program.describe_unknown(int(input_.below(std::size_t(n))));
      input_.byte() & 1 ? program.restore() : program.recenter();
    });
  }
  void weigh() {
    const Block b = block();
    fuzz::accepts([&] { (void)problem_.weight(b); });
  }
  void widen() {
    const double factor = fuzz::number(input_);
    fuzz::attempt(factor > 0 && std::isfinite(factor), [&] { problem_.widen_losses(factor); });
    fuzz::accepts([&] { (void)problem_.convex_widening(); });
  }
  void covariances() {
    fuzz::accepts([&] {
      const Marginals marginals(problem_);
      world_.with_group(input_, [&](auto& handles) {
        const auto &a = handles[handles.pick(input_)], &b = handles[handles.pick(input_)];
        if (a.foreign || b.foreign) return;  // a snapshot does not know of what problem it was
        fuzz::attempt(a.there && b.there, [&] { (void)marginals.cross_covariance(a.handle, b.handle); });
      });
    });
  }
  /// A Program that lives while the problem changes: it is to notice.
  void keep_program() {
    program_.reset();
    fuzz::accepts([&] { program_.emplace(problem_); });
  }
  void use_program() {
    if (!program_) return;
    const Eigen::Index n = program_->num_unknowns();
    Eigen::VectorXd gradient(n), hessian(program_->hessian_pattern().nonzeros());
    Eigen::VectorXd rows(program_->num_rows()), jacobian(Eigen::Index(program_->jacobian_pattern().row.size()));
    const double step = fuzz::number(input_);
    const std::uint8_t what = input_.byte();
    fuzz::accepts([&] {
      if (what & 1) program_->reset();
      if (what & 2) program_->move_to(Eigen::VectorXd::Constant(n, step));
      if (what & 4) program_->recenter();
      if (what & 8) program_->linearize(gradient, hessian);
      if (what & 16) program_->linearize_constraints(rows, jacobian);
      if (what & 32) program_->cost();
      if (what & 64) program_->linearize_at_point(gradient, hessian);
      if (what & 128) program_->describe_bad_block();
    });
  }
  void move() {
    program_.reset();
    Problem moved = std::move(problem_);
    world_.check(moved);
    problem_ = std::move(moved);
  }
  void read() {
    world_.with_group(input_, [&](auto& handles) {
      const auto& known = handles[handles.pick(input_)];
      const bool good = known.there || known.foreign;
      fuzz::attempt(good, [&] { (void)problem_.value(known.handle); });
      fuzz::attempt(good, [&] { (void)problem_.id(known.handle); });
    });
    problem_.size();
    problem_.num_soft_blocks();
    problem_.num_hard_blocks();
  }

  fuzz::Input& input_;
  fuzz::World world_;
  Problem problem_;
  std::optional<Program> program_;
};

}  // namespace

// Calls on a Problem, in any order and on handles of any age: what is misuse is an error.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  fuzz::Input input(data, size);
  Calls(input).run();
  return 0;
}
