/// Consistency of fixed-lag smoothing with the chaser's own sensors: the NEES of the newest keyframe, averaged over
/// simulated dives, against the 95 % band of a consistent estimator. One instant in twenty is outside by chance.
///   bench_consistency [runs = 50] [minutes = 4] [mems | tactical = tactical] [window = 20 s]

#include <cstdio>
#include <cstdlib>
#include <string>
#include <vector>

#include <tandem/studies/study/nees.hpp>

namespace {

using namespace tandem;

void print(const char* what, int rows, int runs, const std::vector<double>& instants, const std::vector<double>& mean) {
  const auto [low, high] = chi_squared_band(rows, runs);
  std::printf("%-10s 95 %% band %.3f to %.3f\n", what, low, high);
  for (std::size_t i = 0; i < instants.size(); ++i)
    std::printf("  %6.0f s   %7.3f   %s\n", instants[i], mean[i],
                mean[i] < low    ? "below"
                : mean[i] > high ? "above"
                                 : "inside");
}

}  // namespace

int main(int argc, char** argv) {
  const int runs = argc > 1 ? std::atoi(argv[1]) : 50;
  DiveOptions options;
  options.minutes = argc > 2 ? std::atof(argv[2]) : 4;
  options.grade = argc > 3 && std::string(argv[3]) == "mems" ? Grade::mems : Grade::tactical;
  options.dvl_scale = false;
  const double window = argc > 4 ? std::atof(argv[4]) : 20;

  std::vector<double> instants;
  for (double t = 30; t < 60 * options.minutes; t += 30) instants.push_back(t);
  std::vector<double> pose(instants.size()), velocity(pose), bias(pose);
  for (int run = 0; run < runs; ++run) {
    options.seed = std::uint64_t(run) + 1;
    const std::vector<EgoNees> found = nees_of_fixed_lag(simulate_dive(options), instants, window);
    for (std::size_t i = 0; i < found.size(); ++i) {
      pose[i] += found[i].pose / runs;
      velocity[i] += found[i].velocity / runs;
      bias[i] += found[i].bias / runs;
    }
  }
  std::printf("%d dives of %g min, %s, window %g s\n", runs, options.minutes, std::string(name(options.grade)).c_str(),
              window);
  print("pose", 6, runs, instants, pose);
  print("velocity", 3, runs, instants, velocity);
  print("bias", 6, runs, instants, bias);
}
