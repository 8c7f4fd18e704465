#pragma once

#include <filesystem>

namespace tandem {

/// Returns the path of the running program.
std::filesystem::path executable_path();

/// Returns the prefix of the installation, or the build directory: the nearest folder above the program that contains
/// share/tandem.
std::filesystem::path installation_folder();

/// Returns share/tandem of the installation: scenarios, plot scripts, studies and vehicles.
std::filesystem::path share_folder();

/// Returns libexec/tandem of the installation: the programs of the commands.
std::filesystem::path libexec_folder();

}  // namespace tandem
