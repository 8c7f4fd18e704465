#include <array>
#include <optional>
#include <utility>

#include <tandem/problem/nlp_evaluator.hpp>
#include <tandem/solvers/augmented_lagrangian.hpp>
#include <tandem/solvers/gauss_newton.hpp>
#include <tandem/solvers/marginals.hpp>

#include "fuzz/handles.hpp"

namespace {

using namespace tandem;

constexpr int kMaxCalls = 100;

/// A problem whose handles all other problems must reject. It never changes, so all executions are equal.
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

/// Calls a Problem as the input specifies and compares it with the expected state.
class Calls {
 public:
  explicit Calls(fuzz::Input& input) : input_(input) {
    // Handles of another problem, which every function must reject.
    world_.r1.add_foreign(foreign().r1);
    world_.se2.add_foreign(foreign().se2);
  }

  void run() {
    for (int i = 0; i < kMaxCalls && !input_.empty(); ++i) {
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
        return scale_losses();
      case 17:
        return covariances();
      case 18:
        return move();
      case 19:
        return make_evaluator();
      case 20:
        return use_evaluator();
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
      if (fuzz::attempt(known.exists, [&] { problem_.remove(known.handle); })) world_.forget(id);
    });
  }
  void fix() {
    world_.with_group(input_, [&](auto& handles) {
      const auto& known = handles[handles.pick(input_)];
      const bool fixed = input_.byte() & 1;
      const bool taken = fuzz::attempt(known.exists, [&] { problem_.fix(known.handle, fixed); });
      fuzz::expect(taken || !known.exists, "a variable can be fixed");
    });
  }
  void set_value() {
    world_.with_group(input_, [&]<LieGroup G>(fuzz::Handles<G>& handles) {
      const auto& known = handles[handles.pick(input_)];
      fuzz::attempt(known.exists, [&] { problem_.set_value(known.handle, fuzz::element<G>(input_)); });
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
      const bool possible = a.exists && (!two || (b.exists && a.id != b.id));
      const bool taken = fuzz::attempt(
          possible, [&] { two ? problem_.marginalize(a.handle, b.handle) : problem_.marginalize(a.handle); });
      if (!taken) return;
      world_.forget(a.id);
      if (two) world_.forget(b.id);
      fuzz::expect(problem_.marginal_prior().has_value(), "a marginal prior exists");
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
    fuzz::expect(!summary || !summary->message.empty(), "a solve has a message");
    fuzz::expect(!summary || !summary->converged() || std::isfinite(summary->cost), "a converged cost is finite");
  }
  void evaluate() {
    fuzz::accepts([&] {
      NlpEvaluator nlp(problem_);
      const Eigen::Index n = nlp.num_unknowns(), nonzeros = nlp.hessian_pattern().nonzeros();
      const double step = fuzz::number(input_);
      Eigen::VectorXd delta = Eigen::VectorXd::Constant(n, step), gradient(n), hessian(nonzeros);
      Eigen::VectorXd rows(nlp.num_rows()), jacobian(Eigen::Index(nlp.jacobian_pattern().row.size()));
      nlp.save();
      nlp.move_to(delta);
      nlp.linearize(gradient, hessian);
      nlp.linearize_constraints(rows, jacobian);
      nlp.exact_hessian(1.0, Eigen::VectorXd::Ones(rows.size()), hessian);
      nlp.stiffness(delta, Eigen::VectorXd::Ones(rows.size()));
      nlp.describe_nonfinite_block();
      const NlpEvaluator::Violation violation = nlp.violation(rows);
      if (violation.row >= 0) nlp.describe_row(violation.row);
      nlp.describe_unknown(int(input_.below(std::size_t(n))));
      input_.byte() & 1 ? nlp.restore() : nlp.recenter();
    });
  }
  void weigh() {
    const Block b = block();
    fuzz::accepts([&] { (void)problem_.weight(b); });
  }
  void scale_losses() {
    const double factor = fuzz::number(input_);
    fuzz::attempt(factor > 0 && std::isfinite(factor), [&] { problem_.scale_losses(factor); });
    fuzz::accepts([&] { (void)problem_.convex_loss_scale(); });
  }
  void covariances() {
    fuzz::accepts([&] {
      const Marginals marginals(problem_);
      world_.with_group(input_, [&](auto& handles) {
        const auto &a = handles[handles.pick(input_)], &b = handles[handles.pick(input_)];
        fuzz::attempt(a.exists && b.exists, [&] { (void)marginals.cross_covariance(a.handle, b.handle); });
      });
    });
  }
  /// Makes an NlpEvaluator that outlives later changes of the problem. It must detect them.
  void make_evaluator() {
    nlp_.reset();
    fuzz::accepts([&] { nlp_.emplace(problem_); });
  }
  void use_evaluator() {
    if (!nlp_) return;
    const Eigen::Index n = nlp_->num_unknowns();
    Eigen::VectorXd gradient(n), hessian(nlp_->hessian_pattern().nonzeros());
    Eigen::VectorXd rows(nlp_->num_rows()), jacobian(Eigen::Index(nlp_->jacobian_pattern().row.size()));
    const double step = fuzz::number(input_);
    const std::uint8_t what = input_.byte();
    fuzz::accepts([&] {
      if (what & 1) nlp_->reset();
      if (what & 2) nlp_->move_to(Eigen::VectorXd::Constant(n, step));
      if (what & 4) nlp_->recenter();
      if (what & 8) nlp_->linearize(gradient, hessian);
      if (what & 16) nlp_->linearize_constraints(rows, jacobian);
      if (what & 32) nlp_->cost();
      if (what & 64) nlp_->linearize_at_point(gradient, hessian);
      if (what & 128) nlp_->describe_nonfinite_block();
    });
  }
  void move() {
    nlp_.reset();
    Problem moved = std::move(problem_);
    world_.check(moved);
    problem_ = std::move(moved);
  }
  void read() {
    world_.with_group(input_, [&](auto& handles) {
      const auto& known = handles[handles.pick(input_)];
      fuzz::attempt(known.exists, [&] { (void)problem_.value(known.handle); });
      fuzz::attempt(known.exists, [&] { (void)problem_.id(known.handle); });
    });
    problem_.size();
    problem_.num_soft_blocks();
    problem_.num_hard_blocks();
  }

  fuzz::Input& input_;
  fuzz::World world_;
  Problem problem_;
  std::optional<NlpEvaluator> nlp_;
};

}  // namespace

// Calls of a Problem in any order and with handles of any age. Misuse must throw Error.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  fuzz::Input input(data, size);
  Calls(input).run();
  return 0;
}
