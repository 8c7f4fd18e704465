#include <cmath>

#include <tandem/studies/scenario/named_noise.hpp>
#include <tandem/studies/scenario/scenario.hpp>

#include "fuzz/input.hpp"

// A whole scenario.yaml with entries of all sensors, but without sensor files.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace tandem;
  fuzz::Input input(data, size);
  const std::string yaml = input.text();
  const RowsIn rows = size % 2 ? RowsIn::stream : RowsIn::files;
  fuzz::accepts([&] {
    Scenario scenario = read_settings(yaml, "/", rows);
    fuzz::expect(scenario.data.keyframe_interval > 0, "the keyframe interval is positive");
    fuzz::expect(scenario.data.sensors.size() == scenario.files.target.size(), "a target sensor has a file");
    for (const NamedNoise& noise : named_noise(scenario.data))
      for (const double sigma : noise.sigmas)
        fuzz::expect(std::isfinite(sigma) && sigma >= 0, "standard deviations are finite");
    if (!scenario.navigation) return;
    const NavigationData& own = *scenario.navigation;
    fuzz::expect(own.sensors.size() == scenario.files.ego.size(), "a chaser sensor has a file");
    fuzz::expect(own.imu.has_value() == scenario.files.imu.has_value(), "an imu has a file");
  });
  return 0;
}
