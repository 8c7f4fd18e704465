// Reads an installed scenario, and checks that the error for an invalid folder names the missing file.
#include <iostream>
#include <string>

#include <tandem/lie/error.hpp>
#include <tandem/studies/scenario/scenario.hpp>

int main(int, char** argv) {
  const std::string scenarios = argv[1];
  const tandem::Scenario scenario = tandem::read_scenario(scenarios + "/docking_a");
  std::cout << scenario.name << ": " << scenario.data.odometry.size() << " poses of odometry\n";
  if (scenario.name != "docking_a" || scenario.data.sensors.size() != 2 || !scenario.has_truth()) return 1;
  try {
    tandem::read_scenario(scenarios);
  } catch (const tandem::Error& error) {
    std::cout << error.what() << "\n";
    return std::string(error.what()).find("scenario.yaml") == std::string::npos;
  }
  return 1;
}
