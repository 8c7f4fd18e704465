#include <cmath>

#include <tandem/studies/scenario/named_noise.hpp>
#include <tandem/studies/scenario/scenario.hpp>

#include "fuzz/input.hpp"

// scenario.yaml, whole, with the entries of all sensors; no file beside it.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace tandem;
  fuzz::Input input(data, size);
  const std::string yaml = input.text();
  const RowsIn rows = size % 2 ? RowsIn::stream : RowsIn::files;
  fuzz::accepts([&] {
    Scenario scenario = read_settings(yaml, "/", rows);
    fuzz::expect(scenario.data.keyframe_interval > 0, "keyframes have a distance");
    fuzz::expect(scenario.data.sensors.size() == scenario.files.target.size(), "a sensor has a file");
    for (const NamedNoise& noise : named_noise(scenario.data))
      for (const double sigma : noise.sigmas)
        fuzz::expect(std::isfinite(sigma) && sigma >= 0, "standard deviations are finite");
    if (!scenario.navigation) return;
    const NavigationData& own = *scenario.navigation;
    fuzz::expect(own.sensors.size() == scenario.files.ego.size(), "a sensor of one's own has a file");
    fuzz::expect(own.imu.has_value() == scenario.files.imu.has_value(), "an imu has a file");
  });
  return 0;
}
