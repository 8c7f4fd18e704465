#include <fstream>
#include <limits>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <tandem/problem/file/problem_file.hpp>
#include <tandem/residuals/bearing.hpp>
#include <tandem/residuals/soft_bound.hpp>
#include <tandem/residuals/vehicle/actuator_lag.hpp>
#include <tandem/residuals/vehicle/vehicle_dynamics.hpp>
#include <tandem/solvers/augmented_lagrangian.hpp>
#include <tandem/solvers/gauss_newton.hpp>

#include "fuzz/input.hpp"
#include "fuzz/text_mutation.hpp"
#include "problem/mixed_problem.hpp"
#include "studies/scratch.hpp"

/// Problem files: bitwise equal round trips, and an error message for each mistake.
namespace tandem::testing {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::StartsWith;
using ::testing::ThrowsMessage;
using Json = nlohmann::ordered_json;

constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// User-defined residual with members of all supported types.
struct UserResidual {
  static constexpr std::string_view name = "user's";
  static constexpr int dim = 1;
  using States = std::tuple<R3>;
  enum class Axis : short { x, y, z };
  struct Scale {
    double factor = 1;
    std::optional<double> offset{};
    auto fields() { return std::tie(factor, offset); }
  };
  class Hidden {
   public:
    Hidden() = default;
    explicit Hidden(double x) : x_(x) {}
    double get() const { return x_; }
    auto fields() { return std::tie(x_); }

   private:
    double x_ = 0;
  };

  Axis axis = Axis::x;
  bool squared = false;
  std::array<Scale, 2> scales{};
  Hidden hidden{};
  float shift = 0;
  double weights[2] = {1, 1};
  std::tuple<int, SO2> turn{};

  auto fields() { return std::tie(axis, squared, scales, hidden, shift, weights, turn); }

  void operator()(const R3& x, Vector<1>& r, Matrix<1, 3>* J = nullptr) const {
    const double v = x.vector()[int(axis)], f = scales[0].factor * scales[1].factor * weights[1];
    r[0] = f * (squared ? v * v : v) - hidden.get() - shift + scales[1].offset.value_or(0.0) + std::get<0>(turn);
    if (!J) return;
    J->setZero();
    (*J)(0, int(axis)) = f * (squared ? 2 * v : 1.0);
  }
};

/// Residual with a pointer, which cannot be stored in a file.
struct WithPointer {
  static constexpr std::string_view name = "with pointer";
  static constexpr int dim = 3;
  using States = std::tuple<R3>;
  const Vector<3>* at = nullptr;
  auto fields() { return std::tie(at); }
  void operator()(const R3& x, Vector<3>& r, Matrix<3, 3>* J = nullptr) const {
    r = x.vector() - (at ? *at : Vector<3>::Zero());
    if (J) J->setIdentity();
  }
};

/// Type that does not exist in this program.
constexpr const char* kUnknown = "tandem::Nowhere<tandem::SE3>";

TEST(ProblemFile, RoundTripIsBitwiseEqual) {
  const ScratchFolder scratch;
  const auto file = scratch.path() / "problem.json";
  MixedProblem made;
  const auto p = made.problem.add(R3({-0.0, 5e-324, 0.1 + 0.2}), "\"quoted\", \xc3\xa4 and\nmore");
  made.problem.fix(made.v.q);
  made.problem.scale_losses(1.0 / 3.0);
  made.problem.minimize(UserResidual{UserResidual::Axis::z,
                                     true,
                                     {{{3.0, {}}, {2.0, -0.25}}},
                                     UserResidual::Hidden(7.0),
                                     0.1f,
                                     {5, 0.5},
                                     {-3, SO2(2.0)}},
                        Gaussian{0.3}, {p}, StudentT(4.0, 1));
  made.problem.minimize(
      SoftBound<Prior<R3>>{Prior<R3>{R3({1, 2, 3})}, {Vector<3>(-kInfinity, -1, 0), Vector<3>(0, 1, kInfinity)}},
      kUnit3, {p});
  made.problem.minimize(Bearing<SE3, R3>{Direction<3>(0.3, -0.2), SE3::Exp(random_vector(6, 1, 3))}, Gaussian{0.1, 0.1},
                        {made.v.a, p});
  made.problem.minimize(ActuatorLag<3>(Vector<3>(0.1, 0.2, 0.0), 0.5), kUnit3, {p, p, p});
  made.problem.set_multipliers(made.problem.subject_to(Prior<R3>{R3()}, at_most(3.0), {p}), Vector<3>(0.0, -0.5, 2.0));

  write_problem(made.problem, file);
  EXPECT_THAT(files(scratch.path()), ElementsAre("problem.json")) << "no temporary file remains";
  Problem read = read_problem(file);
  EXPECT_EQ(problem_text(read), read_file(file));
  EXPECT_EQ(problem_text(read), problem_text(made.problem));

  // Bits that the text comparison could miss.
  const auto points = made.problem.variables<R3>(), points_read = read.variables<R3>();
  ASSERT_EQ(points.size(), points_read.size());
  for (std::size_t i = 0; i < points.size(); ++i)
    EXPECT_EQ(made.problem.value(points[i]).vector(), read.value(points_read[i]).vector());
  EXPECT_TRUE(std::signbit(read.value(points_read.back()).vector()[0]));
  EXPECT_EQ(read.name(read.id(points_read.back())), made.problem.name(made.problem.id(p)));
  EXPECT_TRUE(read.is_fixed(read.variables<SE2>()[0]));
  EXPECT_EQ(read.loss_scale(), made.problem.loss_scale());
  const std::vector<Block> blocks = made.problem.blocks(), blocks_read = read.blocks();
  ASSERT_EQ(blocks.size(), blocks_read.size());
  for (std::size_t i = 0; i < blocks.size(); ++i) {
    EXPECT_EQ(made.problem.describe(blocks[i]), read.describe(blocks_read[i]));
    EXPECT_EQ(made.problem.linearization(blocks[i]).residual, read.linearization(blocks_read[i]).residual);
    EXPECT_EQ(made.problem.linearization(blocks[i]).jacobian, read.linearization(blocks_read[i]).jacobian);
  }
  EXPECT_EQ(read.multipliers(blocks_read.back()).size(), read.linearization(blocks_read.back()).residual.size());

  AugmentedLagrangianOptions options;
  options.max_iterations = 40;
  const Summary of_made = solve(made.problem, options), of_read = solve(read, options);
  EXPECT_EQ(of_made.iterations, of_read.iterations);
  EXPECT_EQ(of_made.cost, of_read.cost);
  EXPECT_EQ(problem_text(read), problem_text(made.problem));
}

TEST(ProblemFile, StoresMarginalPriorAndNoRemovedBlocks) {
  const Gaussian noise(Vector<6>::Constant(0.1));
  Problem problem;
  std::vector<Variable<SE3>> x;
  for (unsigned i = 0; i < 6; ++i) {
    x.push_back(problem.add(SE3::Exp(random_vector(6, 0.3, i)), "x" + std::to_string(i)));
    const Block prior = problem.minimize(Prior<SE3>{SE3::Exp(random_vector(6, 1, 50 + i))}, noise, {x[i]}, Huber(1.0));
    if (i == 3) problem.remove(prior);
    if (i > 0) problem.minimize(RelativePose<SE3>{SE3::Exp(random_vector(6, 1, 90 + i))}, noise, {x[i - 1], x[i]});
  }
  problem.marginalize(x[0], x[1]);
  const auto late = problem.add(SE3(), "late");  // reuses the ID of an earlier variable
  problem.minimize(RelativePose<SE3>{SE3()}, noise, {late, x[5]});
  problem.set_value(x[2], SE3::Exp(random_vector(6, 0.7, 9)));  // away from its anchor
  Problem read = parse_problem(problem_text(problem), "it");
  EXPECT_EQ(problem_text(read), problem_text(problem));
  ASSERT_TRUE(read.marginal_prior());
  const Summary of_problem = solve(problem, GaussNewtonOptions{}), of_read = solve(read, GaussNewtonOptions{});
  EXPECT_EQ(of_problem.initial_cost, of_read.initial_cost);
  EXPECT_EQ(of_problem.iterations, of_read.iterations);
  EXPECT_EQ(of_problem.cost, of_read.cost);
  read.marginalize(read.variables<SE3>()[0]);
  problem.marginalize(x[2]);
  EXPECT_EQ(problem_text(read), problem_text(problem));
}

TEST(ProblemFile, StoresEmptyProblem) {
  const Problem read = parse_problem(problem_text(Problem()), "it");
  EXPECT_EQ(read.num_variables(), 0);
  EXPECT_TRUE(read.blocks().empty());
}

TEST(ProblemFile, RejectsPointers) {
  const ScratchFolder scratch;
  const auto file = scratch.write("problem.json", "old content");
  Problem problem;
  problem.minimize(WithPointer{}, kUnit3, {problem.add(R3(), "x")});
  EXPECT_THAT([&] { write_problem(problem, file); },
              ThrowsMessage<Error>(AllOf(HasSubstr(file.string()), HasSubstr("with pointer of x"), HasSubstr("*"))));
  EXPECT_EQ(read_file(file), "old content");
  EXPECT_THAT(files(scratch.path()), ElementsAre("problem.json"));
  EXPECT_EQ(problem.copy().num_soft_blocks(), 1) << "copy() supports pointers";
}

TEST(ProblemFile, RejectsNonfiniteNumbers) {
  Problem problem;
  const auto x = problem.add(R3(), "x");
  problem.minimize(Prior<R3>{R3({1, std::nan(""), 3})}, kUnit3, {x});
  EXPECT_THAT([&] { problem_text(problem); },
              ThrowsMessage<Error>(HasSubstr("block 0 (tandem::Prior<tandem::Rn<3>>)")));
  Problem wild;
  wild.add(R3({1, kInfinity, 3}), "x");
  EXPECT_THAT([&] { problem_text(wild); }, ThrowsMessage<Error>(HasSubstr("variable 0 (x)")));
}

TEST(ProblemFile, RejectsInvalidPaths) {
  const ScratchFolder scratch;
  const Problem problem;
  EXPECT_THAT([&] { write_problem(problem, scratch.path() / "no" / "folder.json"); },
              ThrowsMessage<Error>(HasSubstr("folder.json: No such file or directory")));
  EXPECT_THAT([&] { write_problem(problem, scratch.path()); },
              ThrowsMessage<Error>(HasSubstr("it is a folder, a pipe or a device")));
  EXPECT_TRUE(files(scratch.path()).empty());
  EXPECT_THAT([&] { read_problem(scratch.path() / "none.json"); },
              ThrowsMessage<Error>(HasSubstr("none.json is missing")));
  EXPECT_THAT([&] { read_problem(scratch.path()); }, ThrowsMessage<Error>(HasSubstr("is a folder")));
}

/// A small valid file, to which the mistakes below are applied.
Json small() {
  Problem problem;
  const auto x = problem.add(SE3(), "x"), y = problem.add(SE3(), "y");
  const auto p = problem.add(R3(), "p");
  problem.minimize(Prior<SE3>{SE3()}, Gaussian(Vector<6>::Ones()), {x});
  problem.minimize(RelativePose<SE3>{SE3()}, Gaussian::covariance(2 * Matrix<6, 6>::Identity() + Matrix<6, 6>::Ones()),
                   {x, y}, Cauchy(1.0));
  problem.minimize(UserResidual{}, Gaussian{1.0}, {p});
  problem.subject_to(Prior<R3>{R3()}, at_most(1.0), {p});
  const auto gone = problem.add(SE3(), "gone");
  problem.minimize(RelativePose<SE3>{SE3()}, Gaussian(Vector<6>::Ones()), {y, gone});
  problem.minimize(Prior<SE3>{SE3()}, Gaussian(Vector<6>::Ones()), {gone});
  problem.marginalize(gone);
  return Json::parse(problem_text(problem));
}

struct Mistake {
  const char* name;
  void (*apply)(Json& file);
  const char* message;
};

class ProblemFileMistakes : public ::testing::TestWithParam<Mistake> {};

TEST_P(ProblemFileMistakes, ErrorNamesLocationAndCause) {
  Json file = small();
  ASSERT_NO_THROW(parse_problem(file.dump(), "bug.json"));
  GetParam().apply(file);
  const std::string message = error_of([&] { parse_problem(file.dump(), "bug.json"); });
  EXPECT_THAT(message, AllOf(StartsWith("bug.json: "), HasSubstr(GetParam().message)));
  EXPECT_EQ(message.find('\n'), std::string::npos);
}

// Blocks: 0 prior, 1 relative pose, 2 UserResidual, 3 bounded prior, 4 marginal prior.
INSTANTIATE_TEST_SUITE_P(
    All, ProblemFileMistakes,
    ::testing::Values(
        Mistake{"format", [](Json& f) { f["format"] = "report"; }, "not a problem file"},
        Mistake{"no_format", [](Json& f) { f.erase("format"); }, "not a problem file"},
        Mistake{"no_object",
                [](Json& f) {
                  f = Json::array({1, 2});
                },
                "not a problem file"},
        Mistake{"version", [](Json& f) { f["version"] = 2; }, "format version 2 is not supported"},
        Mistake{"no_version", [](Json& f) { f.erase("version"); }, "version is missing"},
        Mistake{"unknown_entry", [](Json& f) { f["loss_scael"] = 2; }, "the file has an unknown entry \"loss_scael\""},
        Mistake{"problem_loss_scale", [](Json& f) { f["loss_scale"] = 0; }, "not positive and finite"},
        Mistake{"variables", [](Json& f) { f["variables"] = 3; }, "variables must be a list"},
        Mistake{"no_blocks", [](Json& f) { f.erase("blocks"); }, "blocks is missing"},
        Mistake{"group", [](Json& f) { f["variables"][0]["group"] = "tandem::SE9"; },
                "variable 0 (x): the group tandem::SE9 is not compiled into this program"},
        Mistake{"no_name", [](Json& f) { f["variables"][0]["name"] = ""; },
                "variable 0 (): the name must not be empty"},
        Mistake{"short_value", [](Json& f) { f["variables"][1]["value"].erase(0); },
                "variable 1 (y): a tandem::SE3 has 7 numbers, not 6"},
        Mistake{"long_value", [](Json& f) { f["variables"][2]["value"].push_back(1); },
                "a tandem::Rn<3> has 3 numbers, not 4"},
        Mistake{"not_unit", [](Json& f) { f["variables"][0]["value"][0] = 0.5; }, "not of unit length"},
        Mistake{"null", [](Json& f) { f["variables"][0]["value"][0] = nullptr; },
                "variable 0: value accepts only finite numbers, not null"},
        Mistake{"infinite", [](Json& f) { f["variables"][0]["value"][0] = "inf"; },
                "variable 0: value accepts only finite numbers, not \"inf\""},
        Mistake{"fixed", [](Json& f) { f["variables"][0]["fixed"] = 1; }, "variable 0: fixed must be true or false"},
        Mistake{"role", [](Json& f) { f["blocks"][0]["role"] = "soft"; },
                "block 0: role must be one of cost, constraint, marginal prior"},
        Mistake{"residual", [](Json& f) { f["blocks"][0]["residual"] = kUnknown; },
                "block 0: the residual tandem::Nowhere<tandem::SE3> as a cost is not compiled into this program"},
        Mistake{"other_role",
                [](Json& f) { f["blocks"][3]["residual"] = "tandem::Bearing<tandem::SE3, tandem::Rn<3>>"; },
                "block 3: the residual tandem::Bearing<tandem::SE3, tandem::Rn<3>> as a constraint is not compiled "
                "into this program"},
        Mistake{"out_of_range", [](Json& f) { f["blocks"][0]["variables"][0] = 3; },
                "block 0: variable 3 does not exist"},
        Mistake{"negative", [](Json& f) { f["blocks"][0]["variables"][0] = -1; },
                "block 0: variables accepts only integers from 0 up, not -1"},
        Mistake{"huge_index", [](Json& f) { f["blocks"][0]["variables"][0] = 1e30; },
                "accepts only integers from 0 up"},
        Mistake{"too_few_variables", [](Json& f) { f["blocks"][1]["variables"].erase(0); },
                "block 1: the residual reads 2 variables, not 1"},
        Mistake{"other_group", [](Json& f) { f["blocks"][1]["variables"][1] = 2; },
                "block 1: the residual cannot read variable p at position 1, because it is a tandem::Rn<3>"},
        Mistake{"short_data", [](Json& f) { f["blocks"][1]["data"].erase(0); },
                "block 1: data must be 21 numbers, not 20"},
        Mistake{"long_data", [](Json& f) { f["blocks"][0]["data"].push_back(1); },
                "block 0: data must be 7 numbers, not 8"},
        Mistake{"text_data", [](Json& f) { f["blocks"][0]["data"][0] = "nan"; },
                "block 0: data accepts only finite numbers, \"inf\" and \"-inf\", not \"nan\""},
        Mistake{"enumeration", [](Json& f) { f["blocks"][2]["data"][0] = 1e6; },
                "block 2: a member must be an integer"},
        Mistake{"flag", [](Json& f) { f["blocks"][2]["data"][1] = 0.5; },
                "block 2: a member must be an integer from 0 to 1"},
        Mistake{"no_noise", [](Json& f) { f["blocks"][0].erase("noise"); }, "block 0: noise is missing"},
        Mistake{"two_noises", [](Json& f) { f["blocks"][0]["noise"]["full"] = {{1}}; },
                "block 0: noise must have either diagonal or full"},
        Mistake{"noise_size", [](Json& f) { f["blocks"][0]["noise"]["diagonal"] = {1, 1}; },
                "block 0: the noise has 2 numbers, but 6 rows need 6"},
        Mistake{"noise_rows", [](Json& f) { f["blocks"][1]["noise"]["full"][0].erase(0); },
                "block 1: noise: full must have rows of equal length"},
        Mistake{"noise_square", [](Json& f) { f["blocks"][1]["noise"]["full"].erase(0); },
                "block 1: the noise has 30 numbers, but 6 rows need 36"},
        Mistake{"noise_singular", [](Json& f) { f["blocks"][1]["noise"]["full"] = Json(6, Json(6, 0)); }, "block 1: "},
        Mistake{"noise_sign", [](Json& f) { f["blocks"][0]["noise"]["diagonal"][2] = -1; },
                "block 0: the noise must be positive"},
        Mistake{"loss", [](Json& f) { f["blocks"][1]["loss"]["kind"] = "welsch"; },
                "block 1: loss: kind must be one of off, huber"},
        Mistake{"loss_scale", [](Json& f) { f["blocks"][1]["loss"]["scale"] = 0; },
                "block 1: the scale of the loss must be positive"},
        Mistake{"bounds", [](Json& f) { f["blocks"][3]["lower"][0] = 2; }, "block 3: prior: the lower bound 2"},
        Mistake{"bounds_size", [](Json& f) { f["blocks"][3]["upper"].erase(0); },
                "block 3: upper bounds must be 3 numbers, not 2"},
        Mistake{"multipliers", [](Json& f) { f["blocks"][3]["multipliers"] = {1}; },
                "block 3: multipliers must be 3 numbers, not 1"},
        Mistake{"anchors", [](Json& f) { f["blocks"][4]["anchors"].erase(0); },
                "block 4: anchors must be 7 numbers, not 6"},
        Mistake{"A", [](Json& f) { f["blocks"][4]["A"].erase(0); }, "block 4: A has "},
        Mistake{"two_priors", [](Json& f) { f["blocks"].push_back(Json(f["blocks"][4])); },
                "block 5: a problem has at most one marginal prior"},
        Mistake{"prior_twice", [](Json& f) { f["blocks"][4]["variables"] = {1, 1}; },
                "block 4: the marginal prior reads y twice"},
        Mistake{"block_entry", [](Json& f) { f["blocks"][0]["bounds"] = 1; },
                "block 0 has an unknown entry \"bounds\""}),
    [](const auto& mistake) { return std::string(mistake.param.name); });

TEST(ProblemFile, RejectsTruncatedFiles) {
  const std::string text = small().dump();
  for (std::size_t n = 0; n < text.size(); n += 7)
    EXPECT_THAT([&] { parse_problem(text.substr(0, n), "bug.json"); },
                ThrowsMessage<Error>(HasSubstr("bug.json: invalid JSON at byte ")));
}

TEST(ProblemFile, RejectsNumbersOutOfRange) {
  std::string text = small().dump();
  text.replace(text.find("\"loss_scale\":1"), 12, "\"loss_scale\":1e999");
  EXPECT_THAT([&] { parse_problem(text, "bug.json"); },
              ThrowsMessage<Error>(HasSubstr("exceeds the range of double precision")));
}

TEST(ProblemFile, MutatedFilesAreRejectedOrRoundTrip) {
  const std::string right = small().dump(1);
  fuzz::Random random(1);
  int read = 0;
  constexpr int kTexts = 3000;
  for (int i = 0; i < kTexts; ++i) {
    std::string text = right;
    for (unsigned long n = 1 + random() % 3; n > 0; --n) fuzz::mutate(text, random);
    fuzz::accepts([&] {
      const std::string once = problem_text(parse_problem(text, "it"));
      ++read;
      EXPECT_EQ(problem_text(parse_problem(once, "it")), once) << text;
    });
  }
  EXPECT_GT(read, kTexts / 100);
  EXPECT_LT(read, kTexts / 2);
}

TEST(ProblemFile, RejectsDeepNesting) { EXPECT_THROW(parse_problem(std::string(1000000, '['), "bug.json"), Error); }

}  // namespace
}  // namespace tandem::testing
